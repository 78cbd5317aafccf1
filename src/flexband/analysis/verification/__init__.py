"""A result is compared with runs at random points that its surrogate has not seen."""

RUNS = 16
"""Number of verification runs, unless another is given."""

MAX_RUNS = 1_000_000
