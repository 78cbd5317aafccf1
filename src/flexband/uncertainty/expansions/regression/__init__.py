"""Sparse fits, and which few of many variables matter."""
