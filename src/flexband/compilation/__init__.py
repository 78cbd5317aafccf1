"""Compiled functions as objects that need neither Numba nor Python, and on disk."""
