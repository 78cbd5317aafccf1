"""Expansions with names and labels: bands of them, and their files."""
