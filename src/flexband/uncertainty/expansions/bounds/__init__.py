"""The search for bounds of expansions over boxes and discs."""
