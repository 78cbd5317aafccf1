"""The memory that a study takes at its peak, beside Python and its libraries."""

from __future__ import annotations

from typing import Any

LEAST = 4e6
"""Bytes that a study with the smallest outputs takes."""

BOUNDS = 6
"""Lower and upper bounds of μ, μ − σ and μ + σ: each has a value and a place, of each time."""

IN_RESULT = 12
"""Arrays in the result without places, of the size of one run: ends of bands, expected errors."""

PLACES = 4
"""Places in the result: of both ends of interval mean and error bar."""


def peak_memory(method: Any, intervals: int, runs: int, run_bytes: float) -> tuple[float, float]:
    """Return the bytes at the peak of a study, and those that each carrier of ringing outputs adds.

    Carriers that are tried count, also if they are not used in the end.

    A method has `copies`, the number of times that all outputs are in memory while it fits them,
    and `copies_per_carrier`. Then there are bands, whose places grow with the number of intervals.
    `benchmarks/memory/study_memory.py` measures both.

    Parameters
    ----------
    intervals : number of interval variables.
    runs : number of runs.
    run_bytes : bytes of the outputs of one run.
    """
    expansion = 1 if callable(getattr(method, "expand", None)) else 0
    bands = BOUNDS * (1 + intervals) + IN_RESULT + PLACES * intervals
    most = max(getattr(method, "copies", 2.0) * runs, (1 + expansion) * runs + bands)
    return LEAST + run_bytes * most, run_bytes * runs * getattr(method, "copies_per_carrier", 0.0)
