"""Sticking and sliding on lanes, compiled."""
