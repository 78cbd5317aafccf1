"""The memory that a study takes at its peak, beside Python and its libraries."""

from __future__ import annotations

from flexband.uncertainty.methods.method import Method


def peak_memory(method: Method, intervals: int, runs: int, run_bytes: float) -> tuple[float, float]:
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
    smallest = 4e6  # of a study with the smallest outputs
    bounds = 6 * (1 + intervals)  # of μ, μ − σ and μ + σ: each has a value and a place
    in_result = 12 + 4 * intervals  # ends of bands and errors; places of the ends of both bands
    most = max(method.copies * runs, (1 + method.expands) * runs + bounds + in_result)
    return smallest + run_bytes * most, run_bytes * runs * method.copies_per_carrier
