"""Which input matters most is told for the outputs that have limits, or for each output."""

import numpy as np
import xarray as xr

import flexband as fb
from flexband.report.page.definitions import definitions
from flexband.report.page.verdict import verdict, what_matters
from flexband.report.text import band_tables
from flexband.study.results.reliability import Doubt, DoubtKind

T = np.linspace(0.0, 1.0, 101)


def response(a, b):
    """a alone moves "far"; "near" is moved by a at first, and by b in the end."""
    blend = a[:, None] * (1 - T) + 0.5 * b[:, None] * T**4
    line = 3 * a[:, None] + 0 * T
    coords = {"output": ["far", "near"], "time": T}
    return xr.DataArray(np.stack([line, blend], 1), coords, ("sample", "output", "time"))


INPUTS = {"a": fb.Interval(-1, 1), "b": fb.Normal(0, 1)}
SURROGATE = fb.expand(response, INPUTS, fb.AdaptivePCCI())
SHARES = fb.analysis.contributions(SURROGATE)


def test_with_limits_it_is_that_of_the_limit_with_the_least_margin():
    by_time = [
        (
            [
                fb.Requirement("near", below=0.2, during=(0.9, 1.0)),
                fb.Requirement("far", below=50.0),
            ],
            "b",
        ),
        ([fb.Requirement("near", below=0.2, during=(0.0, 0.1))], "a"),
    ]
    for limits, name in by_time:
        text = what_matters(SHARES, fb.analysis.check_requirements(SURROGATE, limits))
        assert f"for the limit near below 0.2 from {limits[0].during[0]:g}" in text
        assert f" is {name}: without its uncertainty, the error bar would be " in text
        assert "where its margin is least" in text
        assert ("; for far below 50, it is a (100 %)." in text) == (len(limits) == 2)


def test_without_limits_it_is_told_of_every_output():
    text = what_matters(SHARES, None)
    assert "is a for far (without its uncertainty, the error bar would be 100 % narrower" in text
    assert "a for near (" in text
    single = what_matters(SHARES.sel(output=["far"]), None)
    assert single.startswith("What matters most is a: without its uncertainty")


def test_definitions_are_those_of_what_the_study_has():
    bands = SURROGATE.bands()
    rows = (["input", "kind", "known"], [["a", "interval", ""], ["b", "Normal", ""]])
    limits = fb.analysis.check_requirements(SURROGATE, fb.Requirement("far", below=9.0))
    likely = fb.analysis.failure_probability(SURROGATE, fb.Requirement("near", below=2.0))
    terms = dict(definitions(bands, rows, limits, likely))
    assert {"margin", "probability", "95 % confidence", "μ and σ", "interval"} <= set(terms)
    assert "μ ± 3σ" in terms["margin"]
    assert "random field" not in terms
    of_constants = dict(definitions(bands, (rows[0], [["a", "constant", ""]]), None, None))
    assert not {"margin", "probability", "μ and σ", "interval", "random field"} & set(of_constants)


def test_doubts_and_confirmed_errors_do_not_contradict_each_other():
    verification = fb.verify(SURROGATE, response).verification
    assert verification.attrs["confirmed"] == "yes"
    agree = "16 verification runs agree with this estimate."
    doubt = Doubt(DoubtKind.TOLERANCE_NOT_MET, 0.06, 0.02)
    for doubts, first in (
        ([], "Estimated accuracy: ±"),
        ([doubt], "Accuracy target missed (6 % instead of 2 %)."),
        ([Doubt(DoubtKind.NOT_TRUSTED)], "Not reliable: the method does not trust its result."),
    ):
        lines = verdict({"doubts": doubts}, SURROGATE.bands(), verification, SHARES, None)
        assert lines[0].startswith(first)
        assert agree in lines
    opening = "Estimate confirmed: 16 verification runs"
    assert band_tables.remarks(SURROGATE.bands(), verification)[0].startswith(opening)
    larger = verification.assign(implied_error=2 * verification["expected_error"])
    assert band_tables.checked_in_words(larger).endswith(
        "this estimate, as far as so few can tell."
    )
    not_trusted = SURROGATE.bands().assign_attrs(not_trusted="far (60 % of it is missed)")
    not_trusted["trusted"] = not_trusted["trusted"].copy(data=[False, True])
    _, rows = band_tables.summary_table(not_trusted, verification)
    assert [row[-1] for row in rows] == ["not trusted", "yes"]
