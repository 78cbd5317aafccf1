"""Probabilities of violating limits."""

FINEST = 0.002
COARSEST = 0.5
"""Relative standard errors that can be asked for."""
