"""The error of bounds whose moments are integrated numerically, by a second, finer rule.

Check runs judge the values of an expansion. They cannot tell whether a rule resolves its phases,
nor whether the polynomials in η for smooth moments have enough terms. So μ and σ are integrated
anew where bounds are reached, and at places between, straight from the response: by a product rule
that is wider and denser than any rule in use, or by samples if that has too many points.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from flexband.uncertainty.expansions.expansion import Extremes
from flexband.uncertainty.expansions.points.sobol import scrambled_sobol
from flexband.uncertainty.inputs.sampling import of_normals
from flexband.uncertainty.phases.integration.rules import Rule, resolving_rule, sobol_normal
from flexband.uncertainty.phases.phase_options import SECOND_RULE
from flexband.uncertainty.phases.terms import PartTerms


def integration_error(
    terms: PartTerms, bounds: Sequence[Extremes], sigmas: Sequence[float]
) -> np.ndarray:
    """Return how far bounds of each μ + c σ are from those of a second rule, (sigmas, 2, …).

    The shape is that of the bounds, (sigmas, 2, outputs, times). Times in between those that are
    integrated anew have the larger error of their neighbours.

    Parameters
    ----------
    terms : of the expansion.
    bounds : lower and upper bound of each μ + c σ, and where they are reached.
    sigmas : c of each.
    """
    outputs, times = bounds[0].values.shape[1:]
    m = terms.interval_dimension
    interior_places = 2 * scrambled_sobol(SECOND_RULE.places * (m > 0), m, seed=1) - 1
    places = np.concatenate([e.places for e in bounds])  # (2 sigmas, outputs, times, m)
    tasks = outputs * (len(places) + len(interior_places))
    points, noisy = _second_rule(terms, tasks)
    rules = [(terms.expansion.orthogonal(xi), weights) for xi, weights in points]
    affordable = SECOND_RULE.evaluations // (tasks * sum(len(w) for _, w in rules))
    time_numbers = np.unique(np.linspace(0, times - 1, min(times, max(affordable, 2))).astype(int))
    moments = np.empty(
        (len(rules), 2, len(places) + len(interior_places), outputs, len(time_numbers))
    )
    # Integrate anew at the places of the bounds and between them.
    for k, t in enumerate(time_numbers):
        for o in range(outputs):
            eta = np.concatenate([places[:, o, t], interior_places])
            for r, rule in enumerate(rules):
                moments[r, :, :, o, k] = _moments(terms, int(t), o, eta, rule)
    errors = np.zeros((len(sigmas), 2, outputs, len(time_numbers)))
    # Compare the bounds with the second rule, and look for values beyond them elsewhere.
    for s, (c, e) in enumerate(zip(sigmas, bounds, strict=True)):
        values = moments[:, 0] + c * moments[:, 1]
        mean = values.mean(axis=0)
        noise = np.zeros(values.shape[1:])
        if noisy:
            noise = values.std(axis=0, ddof=1) / math.sqrt(len(rules))
        for bound, sign in enumerate((-1.0, 1.0)):
            bound_values = e.values[bound][:, time_numbers]
            deviation = _beyond(np.abs(mean[2 * s + bound] - bound_values), noise[2 * s + bound])
            excess = sign * (mean[len(places) :] - bound_values) - 3 * noise[len(places) :]
            errors[s, bound] = np.maximum(deviation, excess.max(axis=0, initial=0.0))
    return _at_all_times(errors, time_numbers, times)


def _beyond(deviation: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """Return the differences that noise does not explain, at least the noise."""
    return np.maximum(np.sqrt(np.maximum(deviation**2 - noise**2, 0.0)), noise)


def _second_rule(terms: PartTerms, tasks: int) -> tuple[list[Rule], bool]:
    """Return a finer rule, or several of samples whose differences tell their noise."""
    change = terms.over_random
    affordable = SECOND_RULE.evaluations // (tasks * SECOND_RULE.least_times)
    max_points = max(affordable, SECOND_RULE.least_points)
    if (rule := resolving_rule(change, max_points, SECOND_RULE.fineness)) is not None:
        return [rule], False
    count = SECOND_RULE.samples
    n = len(change.families)
    while count > SECOND_RULE.least_samples and count * SECOND_RULE.repetitions > affordable:
        count //= 2
    weights = np.full(count, 1 / count)
    return [
        (of_normals(sobol_normal(n, count, seed), change.families), weights)
        for seed in range(1, 1 + SECOND_RULE.repetitions)
    ], True


def _moments(
    terms: PartTerms, time: int, output: int, eta: np.ndarray, rule: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Return μ and σ of an output at a time and η of shape (places, m), each (places,).

    The rule has Ψ at its points, (points, N), and their weights.
    """
    expansion = terms.expansion
    columns = terms.columns
    psi, weights = rule
    parts = columns.of_outputs(np.array([output]))
    coefficients = (
        expansion.chebyshev(eta)[:, expansion.i, None] * terms.coefficients[time][:, parts]
    )
    of_random = expansion.j[:, None] == np.arange(len(expansion.random_index))
    rows = np.einsum("pkc,kj->pjc", coefficients, of_random.astype(float))
    mean = np.empty(len(eta))
    std = np.empty(len(eta))
    for p, row in enumerate(rows):
        series = (psi @ row).T
        values = series[0].copy()
        for phase, re, im in series[1:].reshape(-1, 3, len(weights)):
            values += re * np.cos(phase) - im * np.sin(phase)
        mean[p] = weights @ values
        std[p] = np.sqrt(weights @ (values - mean[p]) ** 2)
    return mean, std


def _at_all_times(errors: np.ndarray, time_numbers: np.ndarray, times: int) -> np.ndarray:
    """Return the larger error of both neighbours where none is known."""
    k = np.arange(times)
    before = np.searchsorted(time_numbers, k, side="right") - 1
    after = np.minimum(np.searchsorted(time_numbers, k), len(time_numbers) - 1)
    return np.maximum(errors[..., before], errors[..., after])
