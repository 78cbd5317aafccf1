"""Surrogates of runs that exist; nothing here runs a response."""
