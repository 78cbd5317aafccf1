"""Verdicts on requirements: what a margin, its error and a run decide."""

from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr

from flexband.analysis.requirements.least_margin import LimitVerdict
from flexband.study.results.verdicts import Reason, Verdict, _by_margin


def verdict_of(margin, between, error=0.1, run=np.nan, estimate="error_bar_expected_error"):
    kept = LimitVerdict.KEPT if min(margin, between) > 0 else LimitVerdict.NOT_KEPT
    least = SimpleNamespace(margin=margin, between=between, error=error, verdict=kept)
    limit = xr.Dataset({"run_margin": run})
    margins = xr.Dataset(attrs={"error": estimate})
    return _by_margin(limit, least, margins, None)[:2]


@pytest.mark.parametrize(
    ("margin", "between", "verdict", "reason"),
    [
        (0.5, 0.5, Verdict.PASS, Reason.MARGIN),
        (0.5, 0.05, Verdict.UNDECIDED, Reason.ERROR),
        (0.05, 0.05, Verdict.UNDECIDED, Reason.ERROR),
        (-0.05, -0.05, Verdict.UNDECIDED, Reason.ERROR),
        (-0.5, -0.5, Verdict.FAIL, Reason.MARGIN),
        (0.2, -0.5, Verdict.UNDECIDED, Reason.BETWEEN),  # the error is not that of such peaks
    ],
)
def test_a_margin_decides_where_it_exceeds_its_error(margin, between, verdict, reason):
    assert verdict_of(margin, between) == (verdict, reason)


def test_a_run_beyond_the_bounds_decides_whatever_the_surrogate_says():
    assert verdict_of(0.5, 0.5, run=-0.01) == (Verdict.FAIL, Reason.RUN)
    assert verdict_of(0.5, 0.5, run=0.01) == (Verdict.PASS, Reason.MARGIN)


def test_without_an_error_nothing_is_decided():
    assert verdict_of(5.0, 5.0, estimate="not estimated") == (Verdict.UNDECIDED, Reason.NO_ERROR)
