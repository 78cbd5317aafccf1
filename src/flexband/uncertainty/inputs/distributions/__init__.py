"""Distributions of random inputs, one kind in each file."""
