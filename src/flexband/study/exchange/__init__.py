"""Runs and points as tables that other programs read and write."""
