"""Runs of a response."""

BATCH = 2048
"""Most runs in one call of a response."""
