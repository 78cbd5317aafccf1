"""Phases: runs split into carriers, and bounds of phase expansions against closed forms."""

import itertools

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from numba import njit
from scipy.special import ndtri
from scipy.stats import qmc

from benchmarks.accuracy.formulas import TAU, TIMES, two_carriers, wave
from flexband.uncertainty.expansions.expansion import SIGMAS
from flexband.uncertainty.expansions.families import HERMITE, LEGENDRE
from flexband.uncertainty.expansions.hybrid import HybridExpansion, term_values
from flexband.uncertainty.expansions.polynomials import chebyshev_values
from flexband.uncertainty.phases import terms
from flexband.uncertainty.phases.carriers import split, track
from flexband.uncertainty.phases.decomposition import decompose
from flexband.uncertainty.phases.expansion import PhaseExpansion
from flexband.uncertainty.phases.integration.rules import PhaseChange, axis_rule, scan_points
from flexband.uncertainty.phases.layout import MomentColumns, PartColumns, turning_parts
from flexband.uncertainty.phases.moment_orders import MomentPolynomials, moment_orders
from flexband.uncertainty.phases.phase_bounds import search
from flexband.uncertainty.phases.trigonometry import cos_and_sin

FINE = np.linspace(-1, 1, 20001)[:, None]


def surrogate(index, phases, envelopes, base, families):
    """Return F of terms: phases (terms, times), real envelopes and base (terms, outputs, times)."""
    outputs = base.shape[1]
    series = [base.reshape(len(index), -1)]
    for phase, envelope in zip(phases, envelopes, strict=True):
        flat = envelope.reshape(len(index), -1)
        series += [phase, flat, 0 * flat]
    parts = HybridExpansion(tuple(families), np.array(index), np.concatenate(series, axis=1))
    return PhaseExpansion(np.arange(outputs), parts, PartColumns.from_outputs(outputs, len(phases)))


def one_wave(slopes, times, interval=0.3, bend=0.0):
    """Return cos((10 + interval η + slopes ξ) t + bend t (ξ₁² − 1)) as terms of η and the ξ."""
    n = len(slopes)
    index = np.concatenate([np.eye(n + 2, n + 1, -1), np.eye(1, n + 1, 1) * 2]).astype(int)
    phase = np.outer([10.0, interval, *slopes, bend], times)
    zeros = np.zeros((len(index), 1, len(times)))
    envelope = zeros.copy()
    envelope[0] = 1.0
    return surrogate(index, [phase], [envelope], zeros, [HERMITE] * n)


def moments_of_a_wave(size, times, interval=0.3, bend=0.0, first=0.0):
    """Return μ and σ of `one_wave` at `FINE`, with |slopes| = size, of which the first bends.

    E e^{i(aξ + b(ξ² − 1))} = e^{−ib} e^{−a²/2(1 − 2ib)}/√(1 − 2ib).
    """

    def average(k):
        a = k * first * times
        rest = k**2 * (size**2 - first**2) * times**2
        b = k * bend * times
        bent = np.exp(-1j * b - a**2 / (2 * (1 - 2j * b))) / np.sqrt(1 - 2j * b)
        return bent * np.exp(-rest / 2) * np.exp(1j * k * (10.0 + interval * FINE) * times)

    mean = average(1).real
    return mean, np.sqrt(np.maximum(0.5 * (1 + average(2).real) - mean**2, 0.0))


def check(results, mean, std, limit):
    for c, result in zip(SIGMAS, results, strict=True):
        values = mean + c * std
        np.testing.assert_allclose(result.values[0, 0], values.min(axis=0), atol=limit)
        np.testing.assert_allclose(result.values[1, 0], values.max(axis=0), atol=limit)


def test_a_wave_until_its_phase_is_lost():
    """E cos = e^{−s²t²/2} cos ω₀t, from no scatter of the phase to 60 rad."""
    times = np.linspace(0.0, 200.0, 200)
    results = one_wave([0.3], times).extremes(SIGMAS)
    check(results, *moments_of_a_wave(0.3, times), 3e-5)


def test_where_the_phase_is_lost_few_points_are_enough(monkeypatch):
    def refuse(*_):
        pytest.fail("there is nothing to resolve")

    monkeypatch.setattr(terms, "by_points", refuse)
    times = np.linspace(30.0, 200.0, 100)
    results = one_wave([0.3], times).extremes(SIGMAS)
    check(results, *moments_of_a_wave(0.3, times), 1e-7)


@pytest.mark.parametrize("bend", [0.0, 0.05])
def test_a_wave_whose_phase_moves_with_six_random_variables(bend, monkeypatch):
    """Along the saddle the integrals are exact, phases that are bent included."""
    calls = []
    saddles = terms.by_saddles
    monkeypatch.setattr(terms, "by_saddles", lambda *a: (calls.append(1), saddles(*a)))
    monkeypatch.setattr(terms, "resolving_rule", lambda *_: None)
    slopes = np.array([0.3, 0.2, -0.2, 0.1, 0.1, 0.05])
    times = np.linspace(0.0, 12.0, 20)
    results = one_wave(slopes, times, bend=bend).extremes(SIGMAS)
    size = np.linalg.norm(slopes)
    check(results, *moments_of_a_wave(size, times, bend=bend, first=slopes[0]), 3e-5)
    assert calls


@pytest.mark.parametrize("n", [4, 9])
def test_products_of_variables_count_along_saddles(n, monkeypatch):
    """Where the phase hardly moves, σ² is a sum of squares of coefficients."""
    monkeypatch.setattr(terms, "resolving_rule", lambda *_: None)
    r = np.random.default_rng(n)
    index = np.array([row for row in np.ndindex(*[3] * n) if sum(row) <= 2])
    base, envelope = 0.3 * r.standard_normal((2, len(index), 1, 8))
    phase = np.where(index.sum(axis=1)[:, None], 1e-6, r.uniform(0, 6, 8))
    expansion = surrogate(index, [phase], [envelope], base, [HERMITE] * n)
    mean, std = (v[0, 0] for v in expansion.moments(np.zeros((1, 0))))
    coefficients = (base + envelope * np.cos(phase[0]))[:, 0]
    square = expansion.parts.norms[expansion.parts.j, None] * coefficients**2
    np.testing.assert_allclose(mean, coefficients[0], rtol=1e-4)
    np.testing.assert_allclose(std, np.sqrt(square[index.any(axis=1)].sum(axis=0)), rtol=1e-4)


def test_no_average_of_a_wave_is_larger_than_the_wave(monkeypatch):
    """Terms of order 3 and 4 let the integrand grow along a contour; |E cos| stays below 1."""
    monkeypatch.setattr(terms, "resolving_rule", lambda *_: None)
    r = np.random.default_rng(0)
    index = np.array([row for row in np.ndindex(2, 5, 5, 5) if sum(row) <= 4])
    phase = r.standard_normal((len(index), 60)) * 0.5 ** index.sum(axis=1)[:, None]
    zeros = np.zeros((len(index), 1, 60))
    envelope = zeros.copy()
    envelope[0] = 1.0
    mean, std = surrogate(index, [phase], [envelope], zeros, [HERMITE] * 3).moments(FINE[::4000])
    assert np.abs(mean).max() < 1.1
    assert std.max() < 1.1


@pytest.mark.parametrize("seed", range(6))
def test_smooth_moments_have_the_polynomials_that_they_need(seed):
    """Terms with intervals and random variables at once make them of any order."""
    r = np.random.default_rng(seed)
    index = np.array([row for row in np.ndindex(3, 3, 3, 3) if sum(row) <= 2])
    size = 0.3 ** index.sum(axis=1)[:, None] * r.uniform(0.1, 1.0, (len(index), 1))
    times = np.linspace(0.0, 1.0, 8)

    def part(scale):
        return (scale * size * r.standard_normal((len(index), len(times))))[:, None]

    phases = [part(2.0)[:, 0], part(1.0)[:, 0]]
    s = surrogate(index, phases, [part(1.0), part(0.5)], part(0.5), [HERMITE] * 2)
    part_terms = terms.PartTerms.from_expansion(s.parts, s.columns)
    own_polynomials = MomentPolynomials.from_index(*moment_orders([part_terms]))
    polynomials = own_polynomials.expansion
    smooth = own_polynomials.coefficients(part_terms)
    eta = r.uniform(-1, 1, (40, 2))
    true = part_terms.table(eta)
    values = polynomials.chebyshev(eta)[:, polynomials.i] @ smooth
    variation = np.ptp(true, axis=1, keepdims=True).max(axis=(0, 2))
    assert np.abs(values - true).max() < 1e-4 * variation
    assert len(polynomials.index) <= 160


def ten_inputs(times, seed=0):
    """Return a response of 5 η and 5 ξ: two carriers, two outputs, terms of order 2, few mixed."""
    r = np.random.default_rng(seed)
    single = [k * row for row in np.eye(10, dtype=int) for k in (1, 2)]
    products = [
        np.eye(10, dtype=int)[[a, b]].sum(axis=0) for a, b in ((0, 5), (1, 6), (0, 1), (5, 7))
    ]
    index = np.array([np.zeros(10, int), *single, *products])
    total = index.sum(axis=1)
    size = np.where(total == 0, 1.0, np.where(total == 1, 0.15, 0.02))

    def part(scale):
        terms = r.standard_normal((len(index), 2, 1)) * np.cos(
            times * r.uniform(1, 3, (len(index), 2, 1))
        )
        return scale * size[:, None, None] * terms

    def phase(rate, variables):
        pure = index @ np.array([v in variables for v in range(10)]) == total
        strength = np.where(total == 0, rate, np.where(total == 1, 5.0, 0.15) * pure)
        return strength[:, None] * times * np.where(total[:, None] > 0, r.uniform(0.3, 1), 1.0)

    phases = [phase(60.0, (0, 1, 5, 6)), phase(97.0, (0, 5, 7))]
    return surrogate(index, phases, [part(1.0), part(0.7)], part(0.5), [HERMITE] * 5)


def test_ten_inputs_against_brute_force():
    """At the places that are found the moments are right, and nowhere do samples go beyond."""
    s = ten_inputs(np.linspace(0.0, 1.0, 12))
    results = s.extremes(SIGMAS)
    width = results[2].values[1] - results[1].values[0]
    xi = ndtri(qmc.Sobol(5, rng=np.random.default_rng(1)).random(2**13))
    for c, result in zip(SIGMAS, results, strict=True):
        for side in (0, 1):
            for k in range(0, 24, 5):
                at = k // 12, k % 12
                eta = np.tile(result.places[side][at], (len(xi), 1))
                series = s.select(np.array([at[0]]), slice(at[1], at[1] + 1))
                F = series.evaluate(xi, eta).ravel()
                assert abs(F.mean() + c * F.std() - result.values[side][at]) < 0.004 * width[at]
    for eta in 2 * qmc.Sobol(5, rng=np.random.default_rng(2)).random(128) - 1:
        F = s.evaluate(xi[:1024], np.tile(eta, (1024, 1)))
        for c, result in zip(SIGMAS, results, strict=True):
            value = F.mean(axis=0) + c * F.std(axis=0)
            assert np.all(result.values[0] < value + 0.02 * width)
            assert np.all(result.values[1] > value - 0.02 * width)


def test_bounds_do_not_depend_on_the_number_of_threads(monkeypatch):
    """With three blocks of times for the threads to share."""
    options = terms.MOMENTS._replace(min_block_times=4)
    monkeypatch.setattr(terms, "MOMENTS", options)
    s = ten_inputs(np.linspace(0.0, 1.0, 12))
    by_cores = []
    for cores in (1, 3):
        monkeypatch.setattr("os.cpu_count", lambda cores=cores: cores)
        by_cores.append(s.extremes(SIGMAS))
    for first, second in zip(*by_cores, strict=True):
        np.testing.assert_array_equal(first.values, second.values)
        np.testing.assert_array_equal(first.places, second.places)


def test_runs_are_what_base_and_carriers_add_up_to():
    x, e = np.random.default_rng(0).standard_normal((2, 6, 1))
    F = np.stack([two_carriers(x, e, TIMES), 0.3 * wave(x, e, TIMES) + 1.0], axis=1)
    stages = list(decompose(F, 0.02))
    assert len(stages) > 2
    for stage in stages:
        np.testing.assert_allclose(stage.signal, F, atol=1e-12)


def test_windows_are_split_by_weighted_least_squares():
    """Also at the ends, where windows are one-sided and a ridge decides, and of a ninth run."""
    rng = np.random.default_rng(5)
    half = 13
    F = rng.standard_normal((9, 2, 90))
    psi = np.cumsum(0.3 + rng.random((9, 90)), axis=1)
    at = np.array([0, 4, 45, 89])
    window = np.linspace(-1, 1, 2 * half + 1)
    ridge = 1e-9 * np.sum((1 - window**2) ** 2 + 1e-3)
    envelope, share = split(F, psi, at, half, 2)
    for r, (k, t) in itertools.product((0, 8), enumerate(at)):
        times = np.arange(max(0, t - half), min(90, t + half + 1))
        tau = (times - t) / half
        wave = psi[r, times]
        weight = np.sqrt((1 - tau**2) ** 2 + 1e-3)[:, None]
        basis = weight * np.stack(
            [tau**p * g for g in (1, np.cos(wave), np.sin(wave)) for p in range(3)], axis=1
        )
        signal = weight * F[r][:, times].T
        damped = np.concatenate([basis, np.sqrt(ridge) * np.eye(9)])
        factors, rest, *_ = np.linalg.lstsq(damped, np.pad(signal, ((0, 9), (0, 0))))
        np.testing.assert_allclose(envelope[r, :, k], factors[3] - 1j * factors[6], rtol=1e-6)
        energy = (factors[3] ** 2 + factors[6] ** 2) / 2 * np.sum(weight**2)
        np.testing.assert_allclose(share[r, :, k], energy / (energy + rest), rtol=1e-6)


def test_a_carriers_phase_and_envelope_are_found():
    """F = slow + A(t) cos φ(t) with smooth A and φ, two outputs of opposite sign."""
    phase = TAU * (1.02 * TIMES + 0.002 * TIMES**2)
    amplitude = 1.0 - 0.02 * TIMES
    oscillation = amplitude * np.cos(phase)
    F = np.stack([0.1 * TIMES**2 / 20 + oscillation, 3.0 - 2.0 * oscillation])[None]
    ramp = (TAU * TIMES)[None]
    carrier = track(F, 0.02, 1.0, ramp, np.ones(2), 3)
    assert carrier is not None
    signal = carrier.envelope[0] * np.exp(1j * carrier.phase[0])
    analytic = amplitude * np.exp(1j * phase)
    inner = slice(100, -100)
    np.testing.assert_allclose(signal[0, inner], analytic[inner], atol=2e-3)
    np.testing.assert_allclose(signal[1, inner], -2 * analytic[inner], atol=4e-3)


@given(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_the_least_value_of_a_bowl_is_found_between_the_points(a, b):
    """Of (x − a)² + 2 (y − b)² + ½, from the best of 49 points of a scan."""
    index = np.array([[0, 0], [1, 0], [2, 0], [0, 1], [0, 2]])
    bowl = [a**2 + 2 * b**2 + 2.0, -2 * a, 0.5, -4 * b, 1.0]
    smooth = np.stack([bowl, np.zeros(5)], axis=1)[None]
    points, beside = scan_points(np.array([5, 5]), np.zeros(2))
    values = np.empty((1, 1, 1))
    places = np.empty((1, 1, 1, 2))
    targets = np.array([[0.0, 1.0]])
    turning = turning_parts(0)
    values_of = [chebyshev_values(2, x) for x in points.T]
    basis = np.ascontiguousarray(term_values(values_of, index, len(points)))
    columns = MomentColumns.from_outputs(1, 0)
    search(smooth, index, basis, points, beside, columns, turning, targets, 3, values, places)
    np.testing.assert_allclose(values, 0.5, atol=1e-8)
    np.testing.assert_allclose(places[0, 0, 0], (a, b), atol=1e-4)


@pytest.mark.parametrize("family", [HERMITE, LEGENDRE])
def test_a_rule_along_axes_has_exact_expectations_of_a_wave(family):
    families = (HERMITE, family, family)
    slope = np.array([2.0, 0.15, 0.1])
    xi, weights = axis_rule(PhaseChange(families, np.array([2, 2, 2]), slope, slope[None]))
    assert len(weights) < 600
    assert weights.sum() == pytest.approx(1.0)
    factors = np.exp(-(slope**2) / 2) if family == HERMITE else np.sinc(slope / np.pi)
    factors[0] = np.exp(-(slope[0] ** 2) / 2)
    assert weights @ np.cos(xi @ slope) == pytest.approx(factors.prod(), abs=2e-5)
    square = 1.0 if family == HERMITE else 1 / 3
    for moment, exact in (
        (xi[:, 1] ** 2 * xi[:, 2] ** 2, square**2),
        (xi[:, 0] ** 2 * xi[:, 1] ** 2, square),
        (xi[:, 0] * xi[:, 1], 0.0),
    ):
        assert weights @ moment == pytest.approx(exact, abs=5e-4)


@njit
def _turned(angles, start, cos, sin):
    cos_and_sin(angles, start, cos, sin)


@given(st.lists(st.floats(-1e9, 1e9), min_size=1, max_size=20), st.floats(-10, 10))
@example([np.pi / 2 * k for k in range(-8, 9)], 0.0)
@example([5e5 + k / 7 for k in range(20)], 0.0)
@example([np.inf, 1.0], 0.0)
@example([np.nan, 1.0], 0.0)
def test_cosines_and_sines_have_all_digits(angles, start):
    x = np.array(angles)
    cos = np.empty_like(x)
    sin = np.empty_like(x)
    _turned(x, start, cos, sin)
    with np.errstate(invalid="ignore"):
        np.testing.assert_allclose(cos, np.cos(x - start), rtol=0, atol=3e-16)
        np.testing.assert_allclose(sin, np.sin(x - start), rtol=0, atol=3e-16)
