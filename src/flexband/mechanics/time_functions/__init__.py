"""Functions of time: their values in a run, and what they do between its times."""
