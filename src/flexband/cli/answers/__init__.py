"""The commands that ask a surrogate."""
