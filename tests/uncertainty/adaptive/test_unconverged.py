"""Outputs that converge at no affordable step: recognized early, named, and what helps."""

import numpy as np
import pytest

import flexband as fb
from flexband.report.text.band_tables import remarks
from flexband.uncertainty.adaptive.refinement.spectrum import ErrorSpectrum
from flexband.uncertainty.surrogates.unconverged import (
    Cause,
    Unconverged,
    attributes,
    in_words,
    of_attributes,
)

INPUTS = {"modulus": fb.Interval(2.0e11, 2.2e11), "weight": fb.Normal(1.0, 0.01)}
LENGTH = 0.5


def response(tau=0.0, average=None):
    """A mass on an elastic pendulum that is released from the horizontal."""

    def pendulum(modulus, weight):
        force = fb.Reaction("hinge")
        rod = fb.Beam(
            length=LENGTH, height=0.01, width=0.01, density=7800.0, youngs_modulus=modulus,
            poissons_ratio=0.3, retardation_time=tau,
        )  # fmt: skip
        return fb.Mechanism(
            bodies={"rod": rod, "mass": fb.PointMass(mass=weight, position=(LENGTH, 0.0))},
            joints={
                "hinge": fb.Revolute("rod.start", (0.0, 0.0)),
                "end": fb.Revolute("mass", "rod.end"),
            },
            loads={"gravity": fb.Gravity()},
            sensors={
                "tip": fb.Position("mass"),
                "F": force if average is None else fb.sensors.Average(force, average),
            },
        )

    return fb.dynamic_response(pendulum, duration=0.2, output_step=0.0025)


TOLERANCE = 0.1
METHOD = fb.AdaptivePCCI(TOLERANCE)


@pytest.fixture(scope="module")
def undamped():
    with pytest.warns(
        fb.errors.ToleranceWarning, match=r"as waves that the mesh carries.*damp them"
    ):
        return fb.propagate(response(), INPUTS, METHOD)


def test_reactions_of_an_undamped_member_are_named_with_the_frequency_of_its_waves(undamped):
    verdicts = of_attributes(undamped.attrs)
    assert [verdict.output for verdict in verdicts] == ["F_X", "F_Y"]
    assert {verdict.cause for verdict in verdicts} == {Cause.WAVES}
    assert {verdict.part for verdict in verdicts} == {"step"}
    rigidity = 2.1e11 * 0.01 * 0.01**3 / 12
    mass = 7800 * 0.01**2
    bending = [
        (n * np.pi / LENGTH) ** 2 * np.sqrt(rigidity / mass) / (2 * np.pi) for n in (1, 2, 3, 4)
    ]
    step = float(undamped.attrs["discretization"].split(",")[0].split()[-1])
    for verdict in verdicts:
        assert min(abs(verdict.frequency / f - 1) for f in bending) < 0.02
        assert verdict.frequency > 0.4 / 0.0025  # which the times of the response do not show
        assert verdict.steps == pytest.approx(1 / (verdict.frequency * step), rel=1e-4)
        assert verdict.error > 0.01
    assert undamped.attrs["unconverged_remedies"][:3] == [
        "retardation-time",
        "spectral-radius",
        "average",
    ]


def test_it_ends_early_and_claims_the_error_that_these_reactions_have(undamped):
    attrs = undamped.attrs
    assert attrs["halved"].count("step") <= 7
    assert attrs["runs"] < 150
    assert attrs["stop_reason"] == "tolerance-met"  # that of the other outputs
    errors = undamped["relative_expected_error"]
    assert errors.sel(output=["tip_X", "tip_Y"]).max() < TOLERANCE
    assert errors.sel(output=["F_X", "F_Y"]).min() > TOLERANCE
    assert attrs["expected_error"] > TOLERANCE
    last = remarks(undamped)[-1]
    assert last.startswith(
        "The tolerance of 10 % is NOT met by the discretization: the error of F_X"
    )
    assert "sensors.Average" in last


@pytest.mark.parametrize("options", [{"tau": 1e-4}, {"average": 0.05}], ids=str)
def test_what_is_advised_helps(options):
    bands = fb.propagate(response(**options), INPUTS, METHOD)
    assert bands.attrs["expected_error"] < TOLERANCE
    assert not of_attributes(bands.attrs)


@pytest.mark.parametrize("halvings", [1, 3])
def test_the_error_of_a_lag_after_halvings_is_that_of_a_late_sine(halvings):
    """A sine of 40 Hz that lags as with a step h, h/2 and so on, at 4000 times."""
    t = np.linspace(0.0, 1.0, 4001)
    f = 40.0
    h = 2e-4
    lag = 2 * np.pi * f * (2 * np.pi * f * h) ** 2 / 12

    def sine(step):
        return np.sin(2 * np.pi * f * t - lag * t * (step / h) ** 2)

    change = (sine(h / 2) - sine(h))[None, None]
    spectrum = ErrorSpectrum.from_change(change, t[1], resolved=True)
    assert spectrum.largest == pytest.approx(f, abs=1.0)
    at_f = spectrum.frequency == f
    np.testing.assert_allclose(spectrum.lag(1.0, h)[at_f], lag)
    remaining_error = np.sqrt(spectrum.after(halvings, spectrum.lag(1.0, h)).sum())
    expected = np.std(sine(h / 2**halvings / 2) - sine(h / 2**halvings)) / np.std(change)
    assert remaining_error == pytest.approx(expected, rel=0.2)


def test_verdicts_survive_a_file_where_lists_of_one_are_numbers():
    verdict = Unconverged("b", "step", Cause.STAGNANT, 2.0, 50.0, 0.1)
    attrs = attributes([verdict])
    assert of_attributes(attrs) == [verdict]
    scalars = {name: values[0] for name, values in attrs.items()}
    assert of_attributes(scalars) == [verdict]
    assert in_words(scalars).startswith("the error of b that is due to the step no longer falls")
    assert in_words({}) == ""
    assert attributes([]) == {}
