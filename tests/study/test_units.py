"""Units of the inputs of a study."""

import numpy as np
import pytest

import flexband as fb
from flexband.report.page.inputs import inputs_table

PAIR = fb.Correlated({"p": fb.Normal(0.0, 1.0), "q": fb.Normal(0.0, 1.0)}, 0.5)
INPUTS = {"length": fb.Interval(1.0, 2.0), "load": fb.Normal(10.0, 1.0), "pair": PAIR, "two": 2.0}


def response(length, load, p, q, two):
    return (length * load + p + q + two)[:, None] * np.ones(2)


def test_the_table_of_inputs_tells_the_units_that_are_given():
    units = {"length": "mm", "q": "kg", "p": "N"}
    study = fb.Study(response, INPUTS, fb.PCCI(1, 1), units=units)
    header, rows = inputs_table(study.inputs, study.units)
    assert header[-1] == "unit"
    assert {row[0]: row[-1] for row in rows} == {
        "length": "mm",
        "load": "",
        "pair": "p: N; q: kg",
        "two": "",
    }
    assert "unit" not in inputs_table(study.inputs, {})[0]


@pytest.mark.parametrize(
    ("units", "message"),
    [
        ({"lenght": "mm"}, "units must be 'length', 'load'.*got 'lenght'"),
        ({"length": 1e-3}, r"units\['length'\] must be a text, \"mm\" say; got 0.001"),
        ("mm", "units must be .*crank_length.*got 'mm'"),
    ],
)
def test_units_that_are_none_are_refused(units, message):
    with pytest.raises(fb.errors.InputError, match=message):
        fb.Study(response, INPUTS, fb.PCCI(1, 1), units=units)
