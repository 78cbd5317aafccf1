"""Uncertain inputs, and what they make of any response; mechanisms are not known here."""
