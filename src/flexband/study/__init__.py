"""A study as data, and its run into a folder; it prints and draws nothing."""
