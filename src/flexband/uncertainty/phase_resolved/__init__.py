"""Phases and envelopes with given orders, judged by held-out runs."""
