"""Bounds of phase-resolved surrogates against closed forms and brute force."""

import numpy as np
import pytest
from scipy.special import ndtri
from scipy.stats import qmc

from flexband.uncertainty import phase_bounds
from flexband.uncertainty.expansions.bounds import extremes
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.phases.bounds import phase_extremes
from flexband.uncertainty.phases.expansion import Layout, PhaseExpansion

SIGMAS = (0.0, -1.0, 1.0)
FINE = np.linspace(-1, 1, 20001)[:, None]


def surrogate(index, phases, envelopes, base, m):
    """Return F of terms: phases (terms, times), real envelopes and base (terms, outputs, times)."""
    layout = Layout(base.shape[1], base.shape[2], len(phases))
    series = [base.reshape(len(index), -1)]
    for phase, envelope in zip(phases, envelopes, strict=True):
        flat = envelope.reshape(len(index), -1)
        series += [phase, flat, 0 * flat]
    parts = HybridExpansion.of_terms(np.array(index), np.concatenate(series, axis=1), m)
    return PhaseExpansion(parts, layout, (np.zeros(1),) * m)


def one_wave(slopes, times, interval=0.3, bend=0.0):
    """Return cos((10 + interval η + slopes ξ) t + bend t (ξ₁² − 1)) as terms of η and the ξ."""
    n = len(slopes)
    index = np.concatenate([np.eye(n + 2, n + 1, -1), np.eye(1, n + 1, 1) * 2]).astype(int)
    phase = np.outer([10.0, interval, *slopes, bend], times)
    one = np.zeros((len(index), 1, len(times)))
    envelope = one.copy()
    envelope[0] = 1.0
    return surrogate(index, [phase], [envelope], one, 1)


def moments_of_a_wave(size, times, interval=0.3, bend=0.0, first=0.0):
    """Return μ and σ of `one_wave` at `FINE`, with |slopes| = size, of which the first bends.

    E e^{i(aξ + b(ξ² − 1))} = e^{−ib} e^{−a²/2(1 − 2ib)}/√(1 − 2ib).
    """

    def average(k):
        a, rest, b = k * first * times, k**2 * (size**2 - first**2) * times**2, k * bend * times
        bent = np.exp(-1j * b - a**2 / (2 * (1 - 2j * b))) / np.sqrt(1 - 2j * b)
        return bent * np.exp(-rest / 2) * np.exp(1j * k * (10.0 + interval * FINE) * times)

    mean = average(1).real
    return mean, np.sqrt(np.maximum(0.5 * (1 + average(2).real) - mean**2, 0.0))


def check(found, mean, std, limit):
    for c, own in zip(SIGMAS, found, strict=True):
        values = mean + c * std
        np.testing.assert_allclose(own.values[0], values.min(axis=0), atol=limit)
        np.testing.assert_allclose(own.values[1], values.max(axis=0), atol=limit)


def test_a_wave_until_its_phase_is_lost():
    """E cos = e^{−s²t²/2} cos ω₀t, from no scatter of the phase to 60 rad."""
    times = np.linspace(0.0, 200.0, 400)
    found = phase_extremes(one_wave([0.3], times), SIGMAS)
    check(found, *moments_of_a_wave(0.3, times), 3e-5)


def test_where_the_phase_is_lost_few_points_are_enough(monkeypatch):
    def none(*_):
        pytest.fail("there is nothing to resolve")

    monkeypatch.setattr(phase_bounds, "by_points", none)
    times = np.linspace(30.0, 200.0, 100)
    found = phase_extremes(one_wave([0.3], times), SIGMAS)
    check(found, *moments_of_a_wave(0.3, times), 1e-7)


@pytest.mark.parametrize("bend", [0.0, 0.05])
def test_a_wave_whose_phase_moves_with_six_random_variables(bend, monkeypatch):
    """Along the saddle the integrals are exact, phases that are bent included."""
    used = []
    saddles = phase_bounds.by_saddles
    monkeypatch.setattr(phase_bounds, "by_saddles", lambda *a: (used.append(1), saddles(*a)))
    monkeypatch.setattr(phase_bounds, "resolving_rule", lambda *_: None)
    slopes = np.array([0.3, 0.2, -0.2, 0.1, 0.1, 0.05])
    times = np.linspace(0.0, 12.0, 60)
    found = phase_extremes(one_wave(slopes, times, bend=bend), SIGMAS)
    size = np.linalg.norm(slopes)
    check(found, *moments_of_a_wave(size, times, bend=bend, first=slopes[0]), 3e-5)
    assert used


def ten_inputs(times, seed=0):
    """Return a response of 5 η and 5 ξ: two carriers, two outputs, terms of order 2, few mixed."""
    r = np.random.default_rng(seed)
    single = [k * row for row in np.eye(10, dtype=int) for k in (1, 2)]
    mixed = [np.eye(10, dtype=int)[[a, b]].sum(axis=0) for a, b in ((0, 5), (1, 6), (0, 1), (5, 7))]
    index = np.array([np.zeros(10, int), *single, *mixed])
    total = index.sum(axis=1)
    size = np.where(total == 0, 1.0, np.where(total == 1, 0.15, 0.02))

    def part(scale):
        terms = r.standard_normal((len(index), 2, 1)) * np.cos(
            times * r.uniform(1, 3, (len(index), 2, 1))
        )
        return scale * size[:, None, None] * terms

    def phase(rate, moved):
        alone = index @ np.array([v in moved for v in range(10)]) == total
        strength = np.where(total == 0, rate, np.where(total == 1, 5.0, 0.15) * alone)
        return strength[:, None] * times * np.where(total[:, None] > 0, r.uniform(0.3, 1), 1.0)

    phases = [phase(60.0, (0, 1, 5, 6)), phase(97.0, (0, 5, 7))]
    return surrogate(index, phases, [part(1.0), part(0.7)], part(0.5), 5)


def test_ten_inputs_against_brute_force():
    """At the places that are found the moments are right, and nowhere do samples go beyond."""
    s = ten_inputs(np.linspace(0.0, 1.0, 12))
    found = phase_extremes(s, SIGMAS)
    width = found[2].values[1] - found[1].values[0]
    xi = ndtri(qmc.Sobol(5, rng=np.random.default_rng(1)).random(2**13))
    for c, own in zip(SIGMAS, found, strict=True):
        for side in (0, 1):
            for k in range(0, 24, 5):
                eta = np.tile(own.places[side, k], (len(xi), 1))
                one = s.of(np.array([k // 12]), slice(k % 12, k % 12 + 1))
                F = one.evaluate(xi, eta).ravel()
                assert abs(F.mean() + c * F.std() - own.values[side, k]) < 0.004 * width[k]
    for eta in 2 * qmc.Sobol(5, rng=np.random.default_rng(2)).random(128) - 1:
        F = s.evaluate(xi[:1024], np.tile(eta, (1024, 1))).reshape(1024, -1)
        for c, own in zip(SIGMAS, found, strict=True):
            value = F.mean(axis=0) + c * F.std(axis=0)
            assert np.all(own.values[0] < value + 0.02 * width)
            assert np.all(own.values[1] > value - 0.02 * width)


def test_bounds_do_not_depend_on_the_number_of_threads(monkeypatch):
    s = ten_inputs(np.linspace(0.0, 1.0, 48))
    found = []
    for cores in (1, 3):
        monkeypatch.setattr(phase_bounds.os, "cpu_count", lambda cores=cores: cores)
        found.append(phase_extremes(s, SIGMAS))
    for one, other in zip(*found, strict=True):
        np.testing.assert_array_equal(one.values, other.values)
        np.testing.assert_array_equal(one.places, other.places)


def test_next_terms_become_terms_like_the_others():
    r = np.random.default_rng(0)
    nodes = (np.array([-1.0, 0.0, 1.0]), np.zeros(1), np.array([-0.7, 0.7]))
    parts = HybridExpansion.fit(r.standard_normal((18, 4)), [2, 0], nodes)
    s = PhaseExpansion(parts, Layout(2, 2, 0), nodes, r.standard_normal((3, 4)))
    xi, eta = r.standard_normal((9, 2)), r.uniform(-1, 1, (9, 3))
    np.testing.assert_allclose(s.complete().evaluate(xi, eta), s.evaluate_parts(xi, eta))


def test_twenty_intervals_without_a_scan_of_all_vertices():
    """Σ_v a_v η_v + b_v η_v², bent up in every other variable and down, where vertices compete."""
    r = np.random.default_rng(0)
    a, b = r.uniform(-1, 1, (2, 20, 50))
    index = np.concatenate([np.zeros((1, 20)), np.eye(20), 2 * np.eye(20)]).astype(int)
    terms = np.concatenate([b.sum(axis=0, keepdims=True) / 2, a, b / 2])
    (found,) = extremes(HybridExpansion.of_terms(index, terms, 20), (0.0,))
    fine = np.linspace(-1, 1, 4001)[:, None, None]
    values = a * fine + b * fine**2
    np.testing.assert_allclose(found.values[0], values.min(axis=0).sum(axis=0), atol=1e-5)
    np.testing.assert_allclose(found.values[1], values.max(axis=0).sum(axis=0), atol=1e-5)
