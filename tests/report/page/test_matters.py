"""Which input matters most is told for the outputs that have limits, or for each output."""

import re

import numpy as np
import xarray as xr

import flexband as fb
from flexband.analysis.limits.limit_verdicts import LimitCheck, requirement_verdicts
from flexband.report.page.definitions import definitions
from flexband.report.text import band_tables
from flexband.report.text.headline import headline, what_matters
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


def verdicts_of(*limits):
    margins = fb.analysis.check_requirements(SURROGATE, list(limits))
    return requirement_verdicts(LimitCheck(margins, None, written=False), SHARES, None)


def test_with_requirements_it_is_that_of_each_around_its_least_margin():
    late = fb.Requirement("end", "near", below=0.2, during=(0.9, 1.0))
    early = fb.Requirement("start", "near", below=0.2, during=(0.0, 0.1))
    far = fb.Requirement("reach", "far", below=50.0)
    text = what_matters(SHARES, verdicts_of(late, far))
    assert re.fullmatch(
        r"What matters most: b for end \(\d\d % of the width\), a for reach \(100 %\)\.", text
    )
    assert re.fullmatch(
        r"What matters most: a \(\d+ % of the width\)\.", what_matters(SHARES, verdicts_of(early))
    )


def test_without_requirements_it_is_told_of_every_output():
    text = what_matters(SHARES, [])
    assert text.startswith("What matters most: a for far (100 % of the width), a for near (")
    single = what_matters(SHARES.sel(output=["far"]), [])
    assert single == "What matters most: a (100 % of the width)."


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
    doubt = Doubt(DoubtKind.TOLERANCE_NOT_MET, 0.06, 0.02)
    for doubts, first in (
        ([], "Estimated accuracy: ±"),
        ([doubt], "Accuracy target missed (6 % instead of 2 %)."),
        ([Doubt(DoubtKind.NOT_TRUSTED)], "Not reliable: the method does not trust its result."),
    ):
        lines = headline(doubts, [], SURROGATE.bands(), verification, SHARES, None)
        assert lines[0].startswith(first)
        assert sum(line.endswith(", checked by 16 new runs.") for line in lines) == 1
    opening = "Estimate confirmed: 16 verification runs"
    assert band_tables.remarks(SURROGATE.bands(), verification)[0].startswith(opening)
    larger = verification.assign(implied_error=2 * verification["expected_error"])
    assert band_tables.accuracy_line(SURROGATE.bands(), larger).endswith(
        ", not contradicted by 16 new runs."
    )
    not_trusted = SURROGATE.bands().assign_attrs(not_trusted="far (60 % of it is missed)")
    not_trusted["trusted"] = not_trusted["trusted"].copy(data=[False, True])
    _, rows = band_tables.summary_table(not_trusted, verification)
    assert [row[-1] for row in rows] == ["not trusted", "yes"]
