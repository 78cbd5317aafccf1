"""Names of what is in the folder of a study, and the statuses of its runs.

Who only looks at a folder, as `flexband status` does, needs nothing that computes.
"""

from enum import IntEnum, StrEnum


class FileName(StrEnum):
    """Names of files and folders in the folder of a study."""

    STUDY = "study.json"
    """Which study it is, and how far it is."""
    OWNER = "results.json"
    """Of whose the results are."""
    BANDS = "bands.nc"
    SURROGATE = "surrogate.npz"
    VERIFICATION = "verification.nc"
    CONTRIBUTIONS = "contributions.nc"
    CONTRIBUTIONS_PICTURE = "contributions.png"
    NOMINAL = "nominal.nc"
    """The response at the nominal values, if a requirement is around it."""
    PAGE = "page.json"
    """What the report shows of the study's code."""
    REPORT = "report.html"
    STUDY_LOCK = "study.lock"
    """Locked while a study runs."""
    STORE_LOCK = "lock"
    """Locked while the store is open."""
    HOLDER = "holder"
    """Who holds the locks."""
    RUNS = "runs.zarr"
    """The recorded runs."""
    SAMPLES = "samples"
    """The folder of the recorded samples of the parts, at more times than other runs."""
    DOMAINS = "domains.json"
    """Of random fields."""
    LEDGER = "points.json"
    """All points that were asked for, of a response that is run elsewhere."""
    POINTS = "points.csv"
    """The last of them."""


class RunStatus(IntEnum):
    """What became of a run."""

    LOST = 0
    """Its chunk was damaged."""
    DONE = 1
    FAILED = 2
    AGAIN = 3
    """It failed, and is to run again."""


ANSWERS = (
    "allocation", "p_boxes", "derived", "limits", "narrowed", "p_box", "parts", "path",
    "probability", "quantiles", "range", "sobol", "yield",
)  # fmt: skip
"""Answers, which commands write as NAME.nc and NAME.png."""

WRITTEN_BY_RUN = ("limits", "parts", "path", "probability", "yield")
"""Answers that ``flexband run`` writes, too."""
