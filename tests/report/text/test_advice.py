"""One next thing to do for every reason why an accuracy is missed."""

import pytest
import xarray as xr

from flexband.report.text.advice import advice_on
from flexband.study.results.shortfall import Shortfall, shortfalls

MISSED = {
    "tolerance": 0.02, "expected_error": 0.06, "expansion_error": 0.06, "refined": ["step"],
    "discretization_error": 0.0, "step_error": 0.0, "stop_reason": "budget-used",
    "advice": "allow more runs", "largest_miss": "of output F", "sigmas": 1.0,
}  # fmt: skip
COARSE = {
    "expected_error": 0.07, "expansion_error": 0.01, "discretization_error": 0.06,
    "stop_reason": "tolerance-met",
}  # fmt: skip
RINGING = {"ringing_output": ["F"], "ringing_frequency": [41.8], "ringing_share": [0.47]}
REFUTED = xr.Dataset(attrs={"confirmed": "no"})
CASES = {
    "budget": ({}, [Shortfall.BUDGET], "NOT met: allow more runs"),
    "integration": (
        {"integration_error": 0.05},
        [Shortfall.INTEGRATION],
        "NOT met: most is due to the integration of the moments",
    ),
    "kinks": (
        {"orders_used": ["a (9)"], "advice": "more runs hardly help"},
        [Shortfall.KINKS],
        "NOT met: more runs hardly help",
    ),
    "ringing": (
        RINGING,
        [Shortfall.RINGING],
        "F vibrates at 41.8 Hz from the start, by up to 47 % of the band's width; start smoothly",
    ),
    "step": ({**COARSE, "step_error": 0.06}, [Shortfall.STEP], "give a shorter step, or omit"),
    "step chosen": (
        {**COARSE, "step_error": 0.06, "halved": ["step"]},
        [Shortfall.STEP],
        "NOT met by the discretization: the given step or elements are",
    ),
    "elements": (
        {**COARSE, "refined": ["elements"], "elements_error": 0.06},
        [Shortfall.ELEMENTS],
        "give more elements",
    ),
    "ringing and step": (
        {**COARSE, **RINGING, "step_error": 0.06},
        [Shortfall.RINGING, Shortfall.STEP],
        "start smoothly",
    ),
    "failed runs": (
        {"runs_failed": 3},
        [Shortfall.FAILED_RUNS, Shortfall.BUDGET],
        "3 runs failed: correct the model there, or narrow the ranges",
    ),
    "sigmas": (
        {"sigmas": 3.0, "stop_reason": "tolerance-met"},
        [Shortfall.SIGMAS],
        "met for μ ± σ, but NOT for μ ± 3σ: choose a smaller one",
    ),
}


@pytest.mark.parametrize("case", CASES)
def test_each_reason_has_its_advice(case):
    attrs, reasons, text = CASES[case]
    bands = xr.Dataset(attrs=MISSED | attrs)
    assert shortfalls(bands) == reasons
    assert text in advice_on(bands)[0]


def test_runs_that_refute_an_accuracy_meet_a_rare_effect():
    bands = xr.Dataset(attrs=MISSED | {"expected_error": 0.01, "expansion_error": 0.01})
    assert shortfalls(bands, REFUTED) == [Shortfall.RARE_EFFECTS]
    (text,) = advice_on(bands, REFUTED)
    assert text.startswith("Verification runs found an effect that the other runs missed: study")


def test_every_reason_has_a_case_and_where_it_is_met_only_the_ringing_is_stated():
    covered = {reason for _, reasons, _ in CASES.values() for reason in reasons}
    assert covered | {Shortfall.RARE_EFFECTS} == set(Shortfall)
    attrs = MISSED | RINGING | {"expected_error": 0.01, "expansion_error": 0.01}
    (text,) = advice_on(xr.Dataset(attrs=attrs))
    assert text == "F vibrates at 41.8 Hz from the start, by up to 47 % of the band's width"
    assert not advice_on(xr.Dataset())
