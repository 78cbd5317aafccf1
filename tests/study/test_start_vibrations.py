"""Vibrations that the start excites: their frequency and size, against closed forms."""

import numpy as np
import pytest

import flexband as fb
from flexband.study.start_vibrations import StartVibration, attributes, of_attributes
from flexband.study.start_vibrations import start_vibrations as vibrations

MASS = 1.0
STIFFNESS = 400.0
SPEED = 0.5
OMEGA = np.sqrt(STIFFNESS / MASS)


def pulled(travel, damping=0.0):
    """Return a mass that a spring pulls behind a driven point."""

    def build(tare):
        return fb.Mechanism(
            bodies={
                "cart": fb.PointMass(mass=1.0, position=(0.0, 0.0)),
                "load": fb.PointMass(mass=MASS, position=(1.0, 0.0)),
            },
            joints={
                "rail": fb.Slot("cart", (0.0, 0.0)),
                "guide": fb.Slot("load", (0.0, 0.0)),
                "drive": fb.PrescribedTravel("cart", (0.0, 0.0), travel),
            },
            loads={
                "spring": fb.Spring(
                    "load", "cart", stiffness=STIFFNESS, damping=damping, rest_length=1.0
                ),
                "pull": fb.Force("load", x=tare),
            },
            sensors={"load": fb.Position("load")},
        )

    return build


def study(travel, **options):
    response = fb.dynamic_response(pulled(travel), duration=4.0, step=5e-3, **options)
    return fb.Study(response, {"tare": fb.Interval(-0.4, 0.4)}, fb.PCCI(0, 1))


def vibrations_of(case):
    surrogate = case.expand()
    bands = surrogate.bands()
    return vibrations(case, surrogate, bands), bands


def test_a_drive_at_full_speed_is_named_with_its_frequency_and_share():
    """The load lags behind, as x = vt − v/ω sin ωt."""
    (vibration,), bands = vibrations_of(study(lambda t: SPEED * t))
    width = np.ptp(bands["error_bar"].sel(output="load_X").values, axis=0).mean()
    assert vibration.output == "load_X"
    assert vibration.frequency == pytest.approx(OMEGA / (2 * np.pi), rel=0.01)
    assert vibration.share == pytest.approx(SPEED / OMEGA / width, rel=0.05)


@pytest.mark.parametrize(
    ("travel", "options"),
    [
        (fb.ramp(SPEED, 1.5).integral, {"start": "static"}),
        (lambda t: 0.0 * t, {"start": "static"}),
    ],
)
def test_soft_starts_excite_none(travel, options):
    assert not vibrations_of(study(travel, **options))[0]


def test_a_rest_that_is_not_taken_is_one_too():
    """The load leaves its place for where force and spring are in balance."""
    case = study(lambda t: 0.0 * t)
    case = fb.Study(case.response, {"tare": fb.Interval(1.0, 3.0)}, case.method)
    (vibration,), _ = vibrations_of(case)
    assert vibration.frequency == pytest.approx(OMEGA / (2 * np.pi), rel=0.01)


def test_outputs_that_no_input_changes_have_none():
    """Their bands are as wide as rounding errors, of which nothing is a share."""
    case = study(lambda t: SPEED * t)
    surrogate = case.expand()
    bands = surrogate.bands()
    middle = bands["error_bar"].mean("bound")
    rounding = [-1e-16, 1e-16]
    bands["error_bar"] = middle + bands["bound"].copy(data=rounding)
    assert not vibrations(case, surrogate, bands)


def test_models_without_a_start_have_none(tmp_path):
    case = fb.Study(lambda a: np.outer(a, [1.0, 2.0]), {"a": fb.Interval(0.0, 1.0)}, fb.PCCI(0, 1))
    assert not vibrations_of(case)[0]


def test_bands_of_a_run_in_a_folder_have_it(tmp_path):
    case = study(lambda t: SPEED * t)
    result = case.run_in(tmp_path / "run", fb.RunOptions(verification_runs=0))
    assert of_attributes(result.bands.attrs) == vibrations_of(case)[0]
    second = case.run_in(tmp_path / "run", fb.RunOptions(verification_runs=0))
    assert second.reused
    assert of_attributes(second.bands.attrs) == vibrations_of(case)[0]
    pair = [StartVibration("a", 1.0, 2.0), StartVibration("b", 3.0, 0.5)]
    assert of_attributes(attributes(pair)) == pair
    assert not of_attributes(attributes([]))
