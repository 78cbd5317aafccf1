"""Answers over plays, against closed forms: a pin moves an output by its radius times the slope."""

import numpy as np
import pytest

import flexband as fb
from benchmarks.play.allocation import EXACT, allocate_tolerances
from flexband.errors import InputError

SIZE = np.hypot(3.0, -2.0)


def response(pin, length):
    return 3 * pin[0] - 2 * pin[1] + length


def surrogate_of(**play):
    inputs = {"pin": fb.Play(0.1, **play), "length": fb.Interval(0.9, 1.1)}
    return fb.expand(response, inputs, fb.PCCI(0, 1))


def test_contributions_are_the_widths_of_the_discs():
    result = fb.analysis.contributions(surrogate_of(), shapley=True)
    assert result["name"].values.tolist() == ["pin", "length"]
    for name in ("contribution", "shapley"):
        np.testing.assert_allclose(result[name], [0.2 * SIZE, 0.2], rtol=1e-9)


def test_limits_and_the_largest_tolerance_are_over_the_disc():
    surrogate = surrogate_of()
    check = fb.analysis.check_requirements(surrogate, fb.Requirement("response", below=2.0))
    assert float(check["least_margin"][0]) == pytest.approx(2.0 - 1.1 - 0.1 * SIZE, rel=1e-9)
    tolerances = fb.analysis.tolerance_for(surrogate, "pin", share=0.7)
    assert float(tolerances["tolerance"]) == pytest.approx(
        (0.7 * (SIZE + 1) - 1) / SIZE / 10, rel=1e-3
    )
    assert float(fb.analysis.value_range(surrogate, 1.0)["range"][1]) == pytest.approx(
        1.1 + 0.1 * SIZE, rel=1e-9
    )


def test_runs_that_verify_lie_in_the_disc():
    pins = []

    def recorder(pin, length):
        pins.append(pin)
        return response(pin, length)

    fb.verify(surrogate_of(), recorder, runs=32)
    size = np.hypot(*np.concatenate(pins, axis=1))
    assert size.max() == pytest.approx(0.1, rel=1e-12)


def test_a_play_and_a_length_are_allocated_as_in_closed_form():
    """1/r + 1/t with |∇| r + t = 0.2 is least at r = 0.2/(|∇| + √|∇|) and t = √|∇| r."""
    plan = fb.analysis.allocate(
        surrogate_of(),
        fb.Requirement("response", below=1.2),
        {"pin": 1.0, "length": 1.0},
        response=response,
    )
    r = 0.2 / (SIZE + np.sqrt(SIZE))
    np.testing.assert_allclose(plan["tolerance"], [r, r * np.sqrt(SIZE)], rtol=1e-5)
    assert plan.attrs["confirmed"] == "yes"


@pytest.mark.parametrize(("within", "power"), [("disc", 0.5), ("rim", 0.0)])
def test_the_yield_is_that_of_a_uniform_disc_or_rim(within, power):
    scatter = {"length": fb.Uniform(0.9, 1.1)}
    production = fb.production_yield(
        surrogate_of(within=within), fb.Requirement("response", below=1.2), scatter
    )
    grid = (np.arange(400) + 0.5) / 400
    radius, angle = np.meshgrid(grid**power, 2 * np.pi * grid)
    room = 1.2 - 0.1 * SIZE * radius * np.cos(angle)
    exact = np.mean(np.clip((room - 0.9) / 0.2, 0, 1))
    assert production["yield_low"][0] < exact < production["yield_high"][0]
    assert float(production["failing"][0]) == pytest.approx(1 - exact, rel=0.06)


def test_plays_scatter_by_themselves_and_not_over_intervals():
    surrogate = surrogate_of()
    with pytest.raises(InputError, match="a name in scatter"):
        fb.production_yield(
            surrogate, fb.Requirement("response", below=1.2), {"pin": fb.Uniform(0.0, 0.1)}
        )
    with pytest.raises(InputError, match="allocate with a probability does not take a Play: pin"):
        fb.analysis.allocate(
            surrogate, fb.Requirement("response", below=1.2), {"pin": 1.0}, probability=0.01
        )


def test_a_six_bar_is_allocated_as_over_the_exact_discs():
    """A Stephenson III whose output is a coupler point: seven plays and two lengths together."""
    plan = allocate_tolerances()
    assert plan.attrs["cost"] == pytest.approx(EXACT, rel=5e-3)
    assert plan.attrs["confirmed"] == "yes"
