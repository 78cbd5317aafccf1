"""What expansions cannot follow: how far motions are predictable, and how parts are distributed."""
