"""Probabilities of leaving limits."""

FINEST, COARSEST = 0.002, 0.5
"""Relative standard errors that can be asked for."""
