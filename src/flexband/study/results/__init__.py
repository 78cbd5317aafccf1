"""The result of a study: its files, limits, answers and doubts."""
