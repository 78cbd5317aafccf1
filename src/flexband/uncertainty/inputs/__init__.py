"""Intervals, plays, choices, correlations: inputs as functions of standard variables."""
