"""Names of what is in the folder of a study, and the statuses of its runs.

Who only looks at a folder, as `flexband status` does, needs nothing that computes.
"""

STUDY, OWNER = "study.json", "results.json"
"""Files of which study it is and how far it is, and of whose the results are."""

BANDS, SURROGATE, VERIFICATION, CONTRIBUTIONS = (
    "bands.nc", "surrogate.npz", "verification.nc", "contributions.nc",
)  # fmt: skip
"""Files of the results."""

CONTRIBUTIONS_PICTURE = "contributions.png"
"""File that ``flexband contributions`` draws."""

ANSWERS = (
    "allocation", "p_boxes", "derived", "limits", "narrowed", "p_box", "path", "probability",
    "quantiles", "range", "sobol",
)  # fmt: skip
"""Answers, which commands write as NAME.nc and NAME.png."""

WRITTEN_BY_RUN = ("limits", "path", "probability")
"""Answers that ``flexband run`` writes, too."""

PAGE, REPORT = "page.json", "report.html"
"""Files of what the report shows of the study's code, and of the report."""

STUDY_LOCK, STORE_LOCK, HOLDER = "study.lock", "lock", "holder"
"""Files that are locked while a study runs and while its store is open, and of who holds them."""

RUNS = "runs.zarr"
"""Folder of the recorded runs."""

DOMAINS = "domains.json"
"""File of the domains of random fields."""

LEDGER, POINTS = "points.json", "points.csv"
"""Files of the points that are run elsewhere: all that were asked for, and the last ones."""

LOST, DONE, FAILED, AGAIN = range(4)
"""Status of a run: its chunk was damaged; it is done; it failed; it failed and is to run again."""
