"""What motions do between the times of their outputs, against the closed form of an oscillator."""

import warnings

import numpy as np
import pytest
import xarray as xr
from scipy.stats import norm

import flexband as fb
from flexband.errors import FlexbandWarning
from flexband.report.text.band_tables import remarks

OMEGA = 20.0  # rad/s; a half period takes 0.157 s


def oscillator(amplitude, stiffness):
    """x = a cos ωt, a mass on a spring without length."""
    return fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0, position=(amplitude, 0.0))},
        joints={"along": fb.Slot("m", (0.0, 0.0), (1.0, 0.0))},
        loads={"s": fb.Spring("m", (-10.0, 0.0), stiffness, 10.0)},
        sensors={"m": fb.Position("m")},
    )


INPUTS = {"amplitude": fb.Interval(0.98, 1.02), "stiffness": fb.Normal(OMEGA**2, 0.5)}
METHOD = fb.AdaptivePCCI(tolerance=0.05)


def response(output_step, step=1e-3):
    return fb.dynamic_response(oscillator, duration=0.2, step=step, output_step=output_step)


@pytest.fixture(scope="module")
def coarse():
    """x at 0, 0.1 and 0.2 s is 1, −0.416 and −0.654, but −1 between the last two."""
    return fb.expand(response(0.1), INPUTS, METHOD)


def test_what_is_between_the_times_is_that_of_the_closed_form(coarse):
    bands = coarse.bands().sel(output="m_X")
    lowest = np.minimum(np.cos(2.0), np.cos(4.0))
    below = [bands[f"below_between{kind}"].values for kind in ("", "_least")]
    assert np.array(below)[:, [0, 2]] == pytest.approx(0.0, abs=1e-9)
    assert below[0][1] == pytest.approx(1.02 * (1 + lowest), rel=0.01)
    assert below[1][1] == pytest.approx(0.98 * (1 + lowest), rel=0.01)
    assert bands["above_between"].values == pytest.approx(0.0, abs=1e-9)
    assert bands.attrs["runs_between"] == 8
    xr.testing.assert_identical(coarse.bands(), fb.propagate(response(0.1), INPUTS, METHOD))


@pytest.mark.parametrize(
    ("above", "verdict"), [(-0.95, "not kept"), (-1.015, "undecided"), (-1.1, "kept")]
)
def test_limits_hold_between_the_times_too(coarse, above, verdict):
    margins = fb.analysis.check_requirements(coarse, fb.Requirement("m_X", above=above))
    assert float(margins["least_margin"][0]) > 0.2  # at the times
    assert margins["verdict"].values.tolist() == [verdict]
    assert float(margins["margin_between"][0]) == pytest.approx(-1.02 - above, abs=0.02)
    text = "m between the output times, after 0.1 s"
    assert (text in margins.attrs["verdict"]) == (verdict != "kept")


def test_times_that_are_not_limited_are_left_out(coarse):
    limit = fb.Requirement("m_X", above=-0.95, during=(0.0, 0.1))
    assert fb.analysis.check_requirements(coarse, limit)["verdict"].values.tolist() == ["kept"]


def test_saved_and_narrowed_surrogates_know_it_too(coarse, tmp_path):
    file = tmp_path / "surrogate.npz"
    fb.save_surrogate(coarse, file)
    limit = fb.Requirement("m_X", above=-0.95)
    for surrogate in (fb.load_surrogate(file), coarse.narrowed(stiffness=400.0)):
        assert fb.analysis.check_requirements(surrogate, limit)["verdict"].values.tolist() == [
            "not kept"
        ]


def test_with_choices_it_is_that_of_all_options():
    def ballasted(amplitude, ballast):
        return oscillator(amplitude * np.where(ballast == "some", 0.5, 1.0), OMEGA**2)

    model = fb.dynamic_response(ballasted, duration=0.2, step=1e-3, output_step=0.1)
    inputs = {"amplitude": fb.Interval(0.98, 1.02), "ballast": fb.Choice("none", "some")}
    surrogate = fb.expand(model, inputs, METHOD)
    margins = fb.analysis.check_requirements(surrogate, fb.Requirement("m_X", above=-0.95))
    assert margins["verdict"].values.tolist() != ["kept"]
    assert surrogate.bands().attrs["runs_between"] == 16


def test_a_remark_tells_what_the_bands_do_not_show(coarse):
    lines = [line for line in remarks(coarse.bands()) if line.startswith("Between the output")]
    # nothing is told of m_Y, which does not move
    assert len(lines) == 1
    assert "m_X goes down to -1.0" in lines[0]
    assert "after 0.1 s, below every band at these times" in lines[0]
    assert "a smaller output_step" in lines[0]
    fine = fb.propagate(response(0.01), INPUTS, METHOD)
    assert not [line for line in remarks(fine) if line.startswith("Between the output")]


class Sampled:
    """A cosine at some times, with more of them, or with wrong ones."""

    def __init__(self, times, dense_times=None):
        self.times = times
        self.dense_times = dense_times

    def __call__(self, amplitude):
        return np.outer(amplitude, np.cos(OMEGA * self.times))

    def at_more_times(self):
        return None if self.dense_times is None else Sampled(self.dense_times)


@pytest.mark.parametrize(
    ("dense_times", "warning_count"),
    [(np.linspace(0, 0.2, 4), 1), (np.linspace(0, 0.2, 41), 0), (None, 0)],
)
def test_a_response_of_ones_own_may_tell_more_times(dense_times, warning_count):
    model = Sampled(np.linspace(0, 0.2, 3), dense_times)
    inputs = {"amplitude": fb.Interval(0.98, 1.02)}
    with warnings.catch_warnings(record=True) as records:
        warnings.simplefilter("always")
        bands = fb.propagate(model, inputs, METHOD)
    messages = [
        str(record.message) for record in records if issubclass(record.category, FlexbandWarning)
    ]
    assert len([record for record in messages if "as many" in record]) == warning_count
    assert ("below_between" in bands) == (dense_times is not None and not warning_count)


SCATTERED = {"amplitude": fb.Normal(1.0, 0.02), "stiffness": OMEGA**2}


def test_the_probability_is_that_of_the_motion_between_its_times():
    """The oscillator leaves −1.03 if its amplitude does; at the output times it never does."""
    surrogate = fb.expand(response(0.1), SCATTERED, METHOD)
    probabilities = fb.analysis.failure_probability(surrogate, fb.Requirement("m_X", above=-1.03))
    assert float(probabilities["probability"].max()) < 1e-9
    exact = norm.sf(1.5)
    low, high = (probabilities[f"between_times_{end}"].values[0, 0] for end in ("low", "high"))
    assert low < exact < high
    assert "at the output times alone, P ≤" in probabilities.attrs["verdict"]
    fine = fb.expand(response(0.001), SCATTERED, METHOD)
    probabilities = fb.analysis.failure_probability(fine, fb.Requirement("m_X", above=-1.03))
    assert float(probabilities["between_times"][0, 0]) == pytest.approx(exact, rel=0.1)
    assert "95 % confidence: 6." in probabilities.attrs["verdict"]
    assert "alone" not in probabilities.attrs["verdict"]


@pytest.mark.parametrize(
    ("output_step", "step", "parts"),
    [(0.1, 1e-3, 50), (0.1, 0.1 / 67, 67), (0.1, 0.1, 1), (1e-5, 5e-6, 2), (1e-4, 1e-4 / 24, 12)],
)
def test_all_steps_are_looked_at_or_a_part_of_them_that_divides_their_number(
    output_step, step, parts
):
    """67 is a prime above the most parts; 20 000 times are more than half of the most times."""
    model = response(output_step, step)
    dense_model = model.at_more_times()
    assert (model.output_step / dense_model.output_step if dense_model else 1) == pytest.approx(
        parts
    )
    assert dense_model is None or dense_model.step == pytest.approx(step)


def falling(height):
    """A unit mass that falls on a floor without friction or loss."""
    law = fb.contact.HuntCrossley(stiffness=1e5, restitution=1.0, exponent=1.0)
    return fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0, position=(0.0, height))},
        loads={
            "gravity": fb.Gravity(),
            "floor": fb.contact.Stop("m", (0.0, 0.0), law, lower=0.0, axis=(0.0, 1.0)),
        },
        sensors={"m": fb.Position("m"), "force": fb.contact.ContactForce("floor")},
    )


def test_samples_that_choose_their_steps_are_known_at_eight_times_as_many_times():
    """The largest force, k d with k d²/2 = g (h + d), is between output times."""
    coarse = fb.dynamic_response(falling, duration=0.4, step=0.01)
    height = np.array([0.2])
    assert coarse.at_more_times() is None  # without values, contacts are not known of
    many = fb.dynamic_response(falling, duration=40.0, step=1e-3)
    assert many.at_more_times(height=height) is None  # more than 32 768 times would be kept
    fine = coarse.at_more_times(height=height)
    refinement = coarse.refined().at_more_times(height=height)
    assert (fine.output_step, fine.step) == pytest.approx((0.01 / 8, 0.01 / 8))
    assert (refinement.output_step, refinement.step) == pytest.approx((0.01 / 8, 0.01 / 16))
    at, dense_values = (
        model(height=height).sel(output="m_Y").values[0] for model in (coarse, fine)
    )
    np.testing.assert_allclose(dense_values[::8], at, rtol=0, atol=1e-6)
    depth = (9.81 + np.sqrt(9.81**2 + 2e5 * 9.81 * 0.2)) / 1e5
    peaks = [model(height=height).sel(output="force").max() for model in (coarse, fine)]
    assert peaks[0] < 0.6e5 * depth
    assert 0.97e5 * depth < peaks[1] < 1.001e5 * depth
