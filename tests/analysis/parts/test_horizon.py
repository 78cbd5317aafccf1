"""The horizon of predictability, against motions whose growth of disturbances is known."""

import runpy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import flexband as fb
from flexband.analysis import Final, predictability_horizon
from flexband.errors import InputError

EXAMPLE = runpy.run_path(str(Path(__file__).parents[3] / "examples" / "worn_pin.py"))
TIME = np.arange(0.0, 10.0, 0.01)


def with_labels(values, units=("m",), time=TIME):
    """Return a response with outputs y0, y1, … of these units."""
    names = [f"y{k}" for k in range(len(units))]
    coords = {"output": names, "unit": ("output", list(units)), "time": ("time", time)}
    response = xr.DataArray(values, coords, ("sample", "output", "time"))
    response["time"].attrs["units"] = "s"
    return response


def folded(x, rate=1.0):
    """Return a triangular wave of x e^(rate t), from 0 to 1, with slopes of ± 2/π."""
    phase = np.exp(rate * TIME) * x[:, None] / np.pi
    return 2 * np.abs(phase - np.round(phase))


@pytest.mark.parametrize("rate", [1.0, 1.5])
@pytest.mark.parametrize("change", [1e-4, 1e-6])
def test_disturbances_that_grow_exponentially_have_the_horizon_of_the_closed_form(rate, change):
    """2/π · 5 change · e^(rate t) is a tenth of the width, which is 1."""
    horizon = predictability_horizon(
        lambda x: with_labels(folded(x, rate)[:, None]), {"x": fb.Interval(0.0, 5.0)}, change=change
    )
    exact = np.log(0.1 * np.pi / (2 * 5 * change)) / rate
    assert horizon["horizon"].attrs["units"] == "s"
    if exact > TIME[-1]:
        assert horizon["predictable"]
        assert np.isinf(horizon["horizon_low"])
        return
    for name in ("horizon_low", "horizon", "horizon_high"):
        assert float(horizon[name].item()) == pytest.approx(exact, abs=0.02)
    assert not horizon["predictable"]


def test_the_chaotic_map_of_chebyshev_doubles_disturbances():
    """x → 2x² − 1 maps cos θ to cos 2θ: 2^k · 1e-4 π is a tenth of 2 after 9.3 steps."""

    def orbit(angle):
        x = [np.cos(angle)]
        for _ in range(24):
            x.append(2 * x[-1] ** 2 - 1)
        return np.stack(x, axis=1)

    horizon = predictability_horizon(orbit, {"angle": fb.Interval(0.0, np.pi)}, points=64)
    assert 9 <= float(horizon["horizon"]) <= 11
    assert float(horizon["horizon_low"]) >= 9
    assert float(horizon["horizon_high"]) <= 13
    assert not horizon["quantity_predictable"].sel(quantity="smallest the response")


def test_periodic_motions_that_are_linear_in_the_inputs_have_no_horizon():
    inputs = {"a": fb.Interval(0.9, 1.1), "b": fb.Normal(0.0, 0.1)}
    horizon = predictability_horizon(
        lambda a, b: with_labels((a[:, None] * np.cos(TIME) + b[:, None])[:, None]), inputs
    )
    assert horizon["predictable"].all()
    assert np.isinf(horizon["horizon_low"]).all()
    assert horizon["quantity_predictable"].all()
    assert horizon.attrs["runs"] == 16 * 3


def test_each_input_is_changed_by_its_part_of_its_range_and_stays_inside():
    """± 3 standard deviations are the range of a normal input."""
    batches = []

    def response(a, b):
        batches.append(np.stack([a, b]))
        return a + b

    inputs = {"a": fb.Interval(-1.0, 3.0), "b": fb.Normal(5.0, 2.0)}
    predictability_horizon(response, inputs, points=500, change=1e-2)
    (values,) = batches
    at, *neighbours = np.split(values, 3, axis=1)
    changes = np.sort(np.abs(np.array(neighbours) - at).max(axis=2).max(axis=0))
    assert changes == pytest.approx([4e-2, 12e-2])
    assert ((np.array(neighbours) != at).sum(axis=1) == 1).all()
    assert np.abs(values[0] - 1.0).max() < 2.0


def test_a_jump_that_comes_a_little_earlier_does_not_make_a_velocity_unpredictable():
    """A ball that turns at the time x: its velocity jumps, its position has a kink."""
    time = np.linspace(0.0, 2.0, 10_001)

    def ball(x):
        return np.where(time < x[:, None], 1.0, -1.0)

    inputs = {"x": fb.Interval(0.5, 1.5)}
    units = ("m/s", "mm/min", "m")

    def response(x):
        return with_labels(np.stack([ball(x)] * 3, axis=1), units, time)

    horizon = predictability_horizon(response, inputs, change=1e-3)
    assert horizon["predictable"].values.tolist() == [True, True, False]
    one_time_only = predictability_horizon(response, inputs, change=1e-4)
    assert one_time_only["predictable"].all()


def test_impacts_are_compared_in_order_and_their_horizon_is_their_instant():
    """The k-th instant doubles the disturbance of the one before."""

    def response(x):
        instants = [k + (2.0 ** (2 * k) * x) % 1.0 for k in range(10)]
        values = np.broadcast_to(np.stack(instants, axis=1)[..., None], (len(x), 10, len(TIME)))
        return with_labels(values, ["s"] * 10)

    horizon = predictability_horizon(response, {"x": fb.Interval(0.0, 1.0)}, points=32)
    assert horizon["predictable"].values.tolist() == [True] * 5 + [False] * 5
    assert 5 <= float(horizon["horizon"][5]) <= 6
    assert float(horizon["horizon"][9]) == pytest.approx(9.5, abs=0.5)


def test_rounding_errors_are_predictable():
    inputs = {"x": fb.Interval(0.0, 1.0)}

    def response(x):
        rng = np.random.default_rng(0)
        noise = 1e-18 * rng.standard_normal((len(x), len(TIME)))
        return with_labels(np.stack([x[:, None] * np.cos(TIME), noise], axis=1), ("m", "m"))

    assert predictability_horizon(response, inputs)["predictable"].all()


def pin(clearance):
    """Return the engine with a worn pin, and what the impacts of two of its turns do."""
    sensors = {
        "slider": fb.Position("slider"),
        "early": fb.contact.Contacts("pin", first=10),
        "late": fb.contact.Contacts("pin", first=0, window=(0.012, 0.036)),
    }
    return replace(EXAMPLE["engine"](clearance), sensors=sensors)


@pytest.mark.parametrize(("clearance", "predictable"), [(5e-5, True), (5e-4, False)])
def test_a_worn_pin_is_predictable_at_a_twentieth_of_a_millimetre_and_not_at_half_of_one(
    clearance, predictable
):
    response = fb.dynamic_response(
        pin, duration=0.036, step=2e-5, integrator=fb.GeneralizedAlpha(step_tolerance=1e-6)
    )
    inputs = {"clearance": fb.Interval(0.9 * clearance, 1.1 * clearance)}
    quantities = {"peak": Final("late_force"), "count": Final("early_number")}
    horizon = predictability_horizon(response, inputs, quantities=quantities)
    assert horizon["predictable"].sel(output=["early_t1", "early_t10"]).all()
    assert horizon["predictable"].sel(output="slider_X") == predictable
    assert horizon["quantity_predictable"].values.tolist() == [predictable] * 2
    if not predictable:  # after the first impacts, and within the run
        assert 2e-3 < float(horizon["horizon_low"].sel(output="slider_X")) < 0.036


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"points": 1}, "points must be 2 or more; got 1"),
        ({"change": 0.5}, "change must be above 0 and at most 0.01; got 0.5"),
        ({"quantities": {"y": 1.0}}, r"quantities\['y'\] must be a function"),
        ({"quantities": {"y": lambda F: F}}, r"quantities\['y'\] must return one number per"),
        ({"quantities": [Final()]}, "quantities must be"),
        ({"quantities": {}}, "quantities must have one or more; got none"),
        ({"inputs": {"x": fb.Choice(1.0, 2.0)}}, "inputs must"),
    ],
)
def test_bad_arguments_are_refused_by_name(arguments, message):
    defaults = {"inputs": {"x": fb.Interval(0.0, 1.0)}}
    with pytest.raises(InputError, match=message):
        predictability_horizon(folded, **(defaults | arguments))
