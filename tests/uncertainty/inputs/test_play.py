"""Plays: pairs in discs and rhombi, whose runs lie inside, and whose bounds are exact."""

from dataclasses import replace

import numpy as np
import pytest

import flexband as fb
from benchmarks.play.linkages import Dyad, Linkage, ends, four_bar, stephenson
from flexband.errors import InputError

A = 3.0
B = -2.0
SIZE = np.hypot(A, B)


def linear(pin, length, guide):
    return A * pin[0] + B * pin[1] + length + guide[0] - 4 * guide[1]


INPUTS = {
    "pin": fb.Play(0.1),
    "length": fb.Interval(1.0, 1.2),
    "guide": fb.GuidePlay(0.05, length=0.5),
}
REACH = 0.1 * SIZE + max(0.05, 4 * 0.05 * 2 / 0.5)
METHODS = [
    fb.AdaptivePCCI(1e-6),
    fb.ImprovedPCCI(0, 1),
    fb.PCCI(0, 2),
    fb.methods.RegressionPCCI(1),
    fb.methods.PerturbationChebyshev(1),
]


@pytest.mark.parametrize("method", METHODS)
def test_a_linear_response_has_exact_bounds(method):
    bands = fb.propagate(linear, INPUTS, method)
    np.testing.assert_allclose(bands["mean"], [1.0 - REACH, 1.2 + REACH], rtol=1e-9)
    at = bands["mean_at"].sel(bound="upper")
    assert at["input"].values.tolist() == [
        "guide.offset",
        "guide.angle",
        "length",
        "pin.x",
        "pin.y",
    ]
    exact = [0.0, -0.2, 1.2, 0.1 * A / SIZE, 0.1 * B / SIZE]
    np.testing.assert_allclose(at, exact, atol=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_all_runs_lie_inside(method):
    """The model exists in the disc and the rhombus only; held-out runs are in them, too."""
    points = []

    def response(pin, guide):
        points.append(np.concatenate([np.atleast_2d(pin), np.atleast_2d(guide)]))
        assert np.all(np.hypot(*pin) <= 0.1 * (1 + 1e-12))
        assert np.all(np.abs(guide[0]) + 0.25 * np.abs(guide[1]) <= 0.05 * (1 + 1e-12))
        return np.exp(5 * pin[0] - 3 * pin[1]) + guide[0] + guide[1]

    inputs = {name: INPUTS[name] for name in ("pin", "guide")}
    fb.propagate(response, inputs, method)
    x, y = np.concatenate(points, axis=1)[:2]
    assert np.hypot(x, y).max() == pytest.approx(0.1, rel=0.31)


def test_many_plays_are_expanded_by_regression():
    """60 variables are more than interpolation starts with."""
    inputs = {f"pin{k:02}": fb.Play(1.0) for k in range(30)}

    def response(**pins):
        assert all(np.all(np.hypot(*pin) <= 1 + 1e-12) for pin in pins.values())
        return 10 + pins["pin03"][0] + 2 * pins["pin17"][1]

    bands = fb.propagate(response, inputs, fb.AdaptivePCCI(1e-3))
    np.testing.assert_allclose(bands["mean"], [7.0, 13.0], rtol=1e-6)


def test_the_largest_of_an_uncertain_radius_counts():
    bands = fb.propagate(lambda pin: pin[0], {"pin": fb.Play(fb.Interval(0.1, 0.3))}, fb.PCCI(0, 1))
    np.testing.assert_allclose(bands["mean"], [-0.3, 0.3], rtol=1e-9)


def test_values_and_variables_are_inverse_and_checked():
    surrogate = fb.expand(linear, INPUTS, fb.ImprovedPCCI(0, 1))
    pairs = np.array([[0.0, 0.06], [0.1, 0.08]])
    values = surrogate.evaluate(pin=pairs, length=1.1, guide=(0.01, 0.1))
    np.testing.assert_allclose(values, linear(pairs, 1.1, (0.01, 0.1)), rtol=1e-12)
    with pytest.raises(InputError, match=r"pin: values must be pairs of Play.*got \(0.1, 0.05\)"):
        surrogate.evaluate(pin=(0.1, 0.05), length=1.1, guide=(0.0, 0.0))
    with pytest.raises(InputError, match="guide: values must be pairs of GuidePlay"):
        surrogate.evaluate(pin=(0.1, 0.0), length=1.1, guide=(0.03, 0.15))
    with pytest.raises(InputError, match="pin: values must be a pair"):
        surrogate.evaluate(pin=0.1, length=1.1, guide=(0.0, 0.0))


def test_a_surrogate_is_narrowed_saved_and_loaded(tmp_path):
    surrogate = fb.expand(linear, INPUTS, fb.AdaptivePCCI(1e-6))
    fb.save_surrogate(surrogate, tmp_path / "s.nc")
    copy = fb.load_surrogate(tmp_path / "s.nc")
    np.testing.assert_array_equal(copy.bands()["mean"], surrogate.bands()["mean"])
    narrow = copy.narrowed(pin=fb.Play(0.02), guide=fb.GuidePlay(0.01, length=0.5), length=1.1)
    reach = 0.02 * SIZE + 4 * 0.01 * 2 / 0.5
    np.testing.assert_allclose(narrow.bands()["mean"], [1.1 - reach, 1.1 + reach], rtol=1e-9)
    for play in (fb.Play(0.2), fb.Play(0.05, within="rim"), fb.Interval(-0.1, 0.1), 0.0):
        with pytest.raises(InputError, match="pin: must be Play"):
            copy.narrowed(pin=play)


def test_random_inputs_scatter_beside_plays():
    inputs = {"pin": fb.Play(0.1), "force": fb.Normal(1.0, 0.2)}
    bands = fb.propagate(lambda pin, force: force * (2 + pin[0]), inputs, fb.PCCI(1, 1))
    np.testing.assert_allclose(bands["mean"], [1.9, 2.1], rtol=1e-9)
    np.testing.assert_allclose(bands["error_bar"], [1.9 * 0.8, 2.1 * 1.2], rtol=1e-9)


def test_scans_are_over_the_disc():
    """Of 17 points in each direction, 64 are on the rim, at most 1/8 rad apart."""
    inputs = {"pin": fb.Play(0.1), "length": fb.Interval(1.0, 1.1)}
    radii = []

    def response(pin, length):
        radii.append(np.hypot(*pin).max())
        return length + A * pin[0] + B * pin[1]

    bands = fb.propagate(response, inputs, fb.LHSScanning(points=17))
    assert max(radii) == pytest.approx(0.1, rel=1e-12)
    ends = np.array([1.0, 1.1]) + 0.1 * SIZE * np.array([-1, 1])
    np.testing.assert_allclose(bands["mean"], ends, atol=0.1 * SIZE * (1 - np.cos(1 / 16)))


def test_what_cannot_take_a_play_says_so():
    inputs = {"pin": fb.Play(0.1), "force": fb.Normal(1.0, 0.2)}

    def response(pin, force):
        return force + pin[0]

    with pytest.raises(InputError, match="does not take a Play: pin"):
        fb.propagate(response, inputs, fb.methods.PhaseResolvedPCCI(1, 1))
    surrogate = fb.expand(response, inputs, fb.PCCI(1, 1))
    analyses = (
        lambda: fb.analysis.quantiles(surrogate, 0.5),
        lambda: fb.analysis.sobol_indices(surrogate),
        lambda: fb.analysis.p_box(surrogate),
        lambda: fb.analysis.derived(surrogate, lambda values: values),
        lambda: fb.analysis.failure_probability(surrogate, fb.Requirement("response", below=1.5)),
    )
    for analysis in analyses:
        with pytest.raises(InputError, match="not take a Play"):
            analysis()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: fb.Play(0.0), "Play radius must be positive"),
        (lambda: fb.Play(fb.Interval(-0.1, 0.1)), "Play radius must be positive"),
        (lambda: fb.Play(fb.Normal(0.1, 0.01)), "Play radius must be"),
        (lambda: fb.Play(0.1, within="square"), "Play within must be"),
        (lambda: fb.GuidePlay(0.1, length=0.0), "GuidePlay length must be positive"),
        (lambda: fb.GuidePlay("0.1", length=1.0), "GuidePlay clearance must be"),
    ],
)
def test_bad_plays_are_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()


def bands_of(linkage, radii, method):
    response = linkage.outputs_at
    bands = fb.propagate(
        lambda **pins: response(pins), {k: fb.Play(r) for k, r in radii.items()}, method
    )

    def values(pairs):
        pins = dict(zip(radii, pairs, strict=True))
        return response(pins).reshape(pairs.shape[-1], -1)

    exact = ends(values, list(radii.values()), tries=2, count=2000).reshape(bands["mean"].shape)
    return bands, exact, np.abs(bands["mean"].values - exact) / (exact[1] - exact[0])


def test_the_function_generator_has_the_bounds_of_an_exact_optimum():
    """Garrett and Hall, 1969: a four-bar with ψ ≈ 76° + 60° sin 0.75(γ − 95.5°) [mm].

    The slopes of ψ by all four pins have the size of that by the length of the coupler.
    """
    angles = np.deg2rad(np.linspace(95.5, 215.5, 4))
    places = ("crank", 53.0, 0.0), ("ground", 100.0, 0.0)
    dyad = Dyad(("coupler", "rocker"), (122.0, 66.5), places)
    linkage = Linkage(53.0, [dyad], ["rocker"], angles)
    nominal = np.rad2deg(linkage.outputs_at({}))[0, 0]
    target = 76 + 60 * np.sin(0.75 * (angles - angles[0]))
    np.testing.assert_allclose(nominal, target, atol=0.5)
    radii = dict.fromkeys(linkage.pins, 0.5)
    bands, _, error = bands_of(linkage, radii, fb.AdaptivePCCI(3e-6))
    assert error.max() < 1e-5
    assert bands.attrs["runs"] <= 200
    lengths = np.array([122 - 1e-4, 122 + 1e-4])
    slope = np.diff(linkage.outputs_at({}, coupler=lengths)[:, 0], axis=0)[0] / 2e-4
    width = (bands["mean"][1] - bands["mean"][0]).values[0]
    np.testing.assert_allclose(width, 2 * 4 * 0.5 * np.abs(slope), rtol=5e-3)


@pytest.mark.parametrize("seed", [0, 1])
def test_random_linkages_have_the_bounds_of_dense_scans(seed):
    rng = np.random.default_rng(seed)
    linkage = (four_bar, stephenson)[seed](rng)
    linkage = replace(linkage, angles=linkage.angles[:2])
    radii = {name: float(10 ** rng.uniform(-3, -2)) for name in linkage.pins}
    _, _, error = bands_of(linkage, radii, fb.AdaptivePCCI(1e-3))
    assert error.max() < 5e-3


def test_eight_pins_take_few_runs():
    linkage = stephenson(np.random.default_rng(3), dyads=3)
    linkage = replace(linkage, angles=linkage.angles[:1])
    radii = dict.fromkeys(linkage.pins[:8], 0.003)
    bands, _, error = bands_of(linkage, radii, fb.AdaptivePCCI(1e-3, max_runs=200))
    assert error.max() < 2e-3
    assert bands.attrs["runs"] <= 200
