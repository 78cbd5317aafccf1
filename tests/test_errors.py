from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

import flexband as fb
from flexband.basics import checks
from flexband.basics.user_functions import evaluate_function
from flexband.basics.warning import warn


def test_a_warning_points_to_the_line_of_the_user():
    with pytest.warns(fb.errors.FlexbandWarning, match="implausible") as records:
        warn("an implausible number")
    assert Path(records[0].filename) == Path(__file__)


REFUSED = [
    "1.0",
    b"1.0",
    np.datetime64("2020-01-01"),
    np.timedelta64(1, "s"),
    np.array(["2020-01-01"], dtype="datetime64[D]"),
    1j,
    np.array([1.0, 2j]),
    np.ma.array([1.0, 2.0], mask=[False, True]),
    np.ma.masked,
    True,
    np.bool_(True),
    None,
    object(),
    {},
    {1.0},
    Fraction(1, 2),
    10**400,
    np.zeros(0),
    np.ones((2, 2)),
    np.nan,
    -np.inf,
    float,
    lambda: 1.0,
    (1.0, 2.0),
    [1.0],
]


@pytest.mark.parametrize("value", REFUSED, ids=lambda value: type(value).__name__)
def test_what_is_no_number_is_refused_by_name(value):
    for check in (
        checks.check_finite,
        checks.check_positive,
        checks.check_non_negative,
        checks.check_numbers,
    ):
        with pytest.raises(fb.errors.InputError, match=r"mass \[kg\] must be"):
            check("mass [kg]", value)


@pytest.mark.parametrize("value", [2, 2.0, np.float32(2), np.int8(2), 10**30, np.array(2.0)])
def test_a_number_is_a_float(value):
    array = checks.check_positive("mass", value)
    assert array.dtype == float
    assert array == float(value)


def test_a_list_is_refused_with_a_hint():
    with pytest.raises(fb.errors.InputError, match=r"the tuple \(0.0, -5.0\).*np.array"):
        fb.Force("b.end", (0.0, -5.0))


def test_what_a_function_returns_is_named():
    def angle(time):
        return None if time > 1 else 1 / (time - 1)

    with pytest.raises(
        fb.errors.InputError, match=r"function '.*angle' raised an error at 1: ZeroDiv"
    ):
        evaluate_function(angle, 1)
    with pytest.raises(fb.errors.InputError, match="angle' at 2 must be numbers; got None"):
        evaluate_function(angle, 2)


def test_an_angle_in_degrees_is_remarked_on():
    with pytest.warns(
        fb.errors.FlexbandWarning, match=r"RigidBody angle is 90 rad.* is it degrees\?"
    ):
        fb.RigidBody(mass=1.0, inertia=1.0, angle=90)


def test_a_text_in_place_of_a_number_is_called_one():
    with pytest.raises(
        fb.errors.InputError, match=r"got the text '1e-3'; write .* without quotes. YAML"
    ):
        checks.check_positive("mass [kg]", "1e-3")
    with pytest.raises(
        fb.errors.InputError, match=r"got the text '12'; write the number without quotes$"
    ):
        checks.check_integer("samples", "12", 1)
    with pytest.raises(
        fb.errors.InputError, match=r"must be finite numbers; got the text 'heavy'$"
    ):
        checks.check_numbers("mass [kg]", "heavy")


def test_zero_may_be_allowed_besides_a_range():
    assert [checks.check_integer("runs", k, 2, or_zero=True) for k in (0, 2, 5)] == [0, 2, 5]
    for bad in (1, -1):
        with pytest.raises(fb.errors.InputError, match=f"runs must be 0, or 2 or more; got {bad}"):
            checks.check_integer("runs", bad, 2, or_zero=True)
