"""Random and interval fields of time as loads and prescribed motions, against exact results."""

import numpy as np
import pytest

import flexband as fb
from flexband.mechanics.time_functions.evaluation import Evaluation, table

OMEGA = 2 * np.pi
DAMPING = 0.1
MEMORY = 0.4


def pull(t, x, v, p, force):
    force[0, 0] = p[0] - OMEGA**2 * x[0, 0] - 2 * DAMPING * OMEGA * v[0, 0]


def oscillator(force):
    return fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0)},
        joints={"guide": fb.Slot("m", (0.0, 0.0))},
        loads={"pull": fb.ForceLaw(["m"], pull, [force])},
        sensors={"m": fb.Position("m")},
    )


def test_the_variance_of_an_oscillator_under_a_random_force():
    """σ²(t) = ∫∫ h(t − s) h(t − s′) ρ(s − s′) ds ds′, with the duration found by runs."""
    response = fb.dynamic_response(oscillator, duration=1.0, step=2.5e-3, output_step=0.5)
    inputs = {"force": fb.RandomField(0.0, 3.0, MEMORY, tolerance=1e-6)}

    def across(force):
        return response(force=force).sel(output="m_X")

    bands = fb.propagate(across, inputs, fb.AdaptivePCCI(1e-3))
    std = np.diff(bands["error_bar"].values, axis=0)[0] / 2
    omega = OMEGA * np.sqrt(1 - DAMPING**2)
    for end, deviation in zip((0.5, 1.0), std[1:], strict=True):
        s, w = np.polynomial.legendre.leggauss(60)
        s = end * (1 + s) / 2
        w = end * w / 2
        h = w * np.exp(-DAMPING * OMEGA * (end - s)) * np.sin(omega * (end - s)) / omega
        variance = h @ np.exp(-(((s[:, None] - s) / MEMORY) ** 2)) @ h
        assert deviation == pytest.approx(3 * np.sqrt(variance), rel=2e-4)


def test_the_rate_of_crossings_is_that_of_rice():
    """ν = √(−ρ″(0)) exp(−a²/2)/2π of upward crossings of a level a σ; −ρ″(0) = 2/length²."""
    field = fb.RandomField(0.0, 1.0, MEMORY, domain=(0.0, 8.0), tolerance=1e-4)
    x = np.linspace(0.0, 8.0, 801)
    samples = field.realizations(x, 3000)
    for level in (0.0, 1.0):
        crossings = (samples[:, :-1] < level) & (samples[:, 1:] >= level)
        expected = np.sqrt(2) / (2 * np.pi * MEMORY) * np.exp(-(level**2) / 2)
        assert crossings.sum() / (3000 * 8) == pytest.approx(expected, rel=0.02)


def shaker(road):
    return fb.Mechanism(
        bodies={"pad": fb.PointMass(mass=2.0)},
        joints={"road": fb.PrescribedPath("pad", x=lambda t: 0.0, y=lambda t: road(2.0 * t))},
        sensors={"a": fb.Acceleration("pad"), "y": fb.Position("pad")},
    )


@pytest.mark.parametrize(
    "road",
    [
        fb.RandomField(0.0, 0.01, 1.0, (0.0, 1.0), tolerance=1e-5),
        fb.RandomField(0.0, 0.01, 1.0, (0.0, 1.0), 7, discretization=fb.fields.karhunen_loeve),
        fb.IntervalField(-0.01, 0.01, 0.4, (0.0, 1.0), smooth=True),
    ],
)
def test_a_road_prescribes_accelerations(road):
    standard = np.random.default_rng(0).uniform(-1, 1, (3, road.dimension))
    profile = road.value(standard)
    motion = fb.simulate(shaker(profile), duration=0.5, step=1e-3)
    x = 2 * motion["time"].values[5:-5]
    h = 1e-4
    exact = 4 * (profile(x + h) - 2 * profile(x) + profile(x - h)) / h**2
    accelerations = motion.sel(output="a_Y").values[:, 5:-5]
    np.testing.assert_allclose(accelerations, exact, atol=3e-3 * np.abs(exact).max())


@pytest.mark.parametrize(
    ("road", "text"),
    [
        (
            fb.RandomField(0.0, 0.01, 1.0, (0.0, 1.0), correlation=fb.fields.exponential),
            r"Matern\(2.5\)",
        ),
        (
            fb.RandomField(0.0, 0.01, 1.0, (0.0, 1.0), correlation=fb.fields.Matern(2.0)),
            "RandomField",
        ),
        (fb.IntervalField(-0.01, 0.01, 0.4, (0.0, 1.0)), "take smooth=True"),
    ],
)
def test_rough_roads_prescribe_no_motion(road, text):
    """Even where a function of the user stands between; as a parameter of a law they may."""
    profile = road.value(np.zeros((2, road.dimension)))
    with pytest.raises(fb.errors.InputError, match=f"joint 'road' cannot be prescribed .*{text}"):
        fb.simulate(shaker(profile), duration=0.5, step=0.01)
    fb.simulate(oscillator(profile), duration=0.5, step=0.01)


def test_accelerations_that_the_terms_lack_are_warned_of():
    road = fb.RandomField(0.0, 0.01, 0.2, (0.0, 1.0))
    with pytest.warns(
        fb.errors.FlexbandWarning, match=r"joint 'road' .* lack \d+ % of the variance"
    ):
        fb.simulate(shaker(road.value(np.zeros((2, road.dimension)))), duration=0.5, step=0.01)


def test_a_field_is_asked_for_many_times_at_once():
    """Looking for kinks at thousands of times takes one call of a field, not one for each."""
    times = np.linspace(0.0, 1.0, 1001)
    calls = []

    def road(t):
        calls.append(np.size(t))
        if np.shape(t)[:1] not in ((), (1,)):
            raise ValueError("a field takes one row of positions")
        return (np.array([[1.0], [2.0]]) * np.sin(np.atleast_2d(t))).reshape(2, *np.shape(t)[1:])

    at = Evaluation(road, 2, times)
    calls.clear()
    assert at(times) == pytest.approx(np.outer(np.sin(times), [1.0, 2.0]), abs=1e-15)
    assert calls == [1001]


@pytest.mark.parametrize("error", [0.0, 1.0])
def test_values_at_many_times_are_compared_with_those_at_single_ones(error):
    """A function that does not take many times, though it takes five, is called with each."""
    times = np.linspace(0.0, 1.0, 101)
    calls = []

    def drive(t):
        calls.append(np.size(t))
        return np.sin(t) + error * (np.size(t) > 5)

    values, _ = table(drive, 1, times)
    assert values[:, 0] == pytest.approx(np.sin(times), rel=1e-15)
    assert calls.count(1) >= 101 if error else calls.count(1) < 30


def test_a_function_that_changes_the_times_in_place_changes_no_others():
    times = np.linspace(0.0, 1.0, 101)

    def drive(t):
        t *= 2.0
        return t

    values, _ = table(drive, 1, times)
    assert values[:, 0] == pytest.approx(2 * np.linspace(0.0, 1.0, 101), rel=1e-15)
    assert times[-1] == 1.0
