"""Phases and envelopes with given orders, judged by check runs."""
