"""Pairs of shapes that touch: gaps and travels."""
