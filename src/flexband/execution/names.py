"""Names of what is in the folder of a study, and the statuses of its runs.

Who only looks at a folder, as `flexband status` does, needs nothing that computes.
"""

RUNS = "runs.zarr"
"""Folder of the recorded runs."""

DOMAINS = "domains.json"
"""File of the domains of random fields."""

LEDGER, POINTS = "points.json", "points.csv"
"""Files of the points that are run elsewhere: all that were asked for, and the last ones."""

LOST, DONE, FAILED, AGAIN = range(4)
"""Status of a run: its chunk was damaged; it is done; it failed; it failed and is to run again."""
