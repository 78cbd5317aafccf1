"""Bounds of plain expansions: the search must find what many more starts find."""

from dataclasses import replace

import numpy as np
import pytest

from flexband.uncertainty.expansions.bounds import extremes as bounds
from flexband.uncertainty.expansions.bounds.extremes import extremes
from flexband.uncertainty.expansions.families import HERMITE
from flexband.uncertainty.expansions.hybrid import HybridExpansion

SIGMAS = (0.0, -1.0, 1.0)


def random_expansion(m, n, order, series, seed):
    """Return random polynomials of a total order whose terms decay with their order."""
    rng = np.random.default_rng(seed)
    index = np.array([k for k in np.ndindex(*[order + 1] * (m + n)) if sum(k) <= order])
    size = rng.uniform(0.3, 1.0, m + n) ** index
    terms = size.prod(axis=1)[:, None] * rng.standard_normal((len(index), series))
    return HybridExpansion((HERMITE,) * n, index, terms)


def widening(result, reference):
    """Return how much lower and higher the reference is, relative to the width, (series,)."""
    low = np.minimum(result.values[0], reference.values[0])
    high = np.maximum(result.values[1], reference.values[1])
    return np.maximum(result.values[0] - low, high - result.values[1]) / (high - low)


@pytest.mark.parametrize(
    ("m", "n", "order"), [(2, 1, 5), (3, 1, 4), (4, 1, 3), (6, 0, 2), (7, 1, 2)]
)
def test_extremes_are_not_missed(m, n, order, monkeypatch):
    """Searches from 300 random starts find nothing that is wider by 1e-4."""
    expansion = random_expansion(m, n, order, 20, seed=m)
    results = extremes(expansion, SIGMAS[: 1 + 2 * bool(n)])
    starts = np.random.default_rng(0).uniform(-1, 1, (300, m))
    starts[::2] = np.sign(starts[::2])
    no_options = np.zeros((len(starts), 0), dtype=int)
    for first in range(0, len(starts), 50):
        part = starts[first : first + 50], no_options[first : first + 50]
        monkeypatch.setattr(bounds, "scan", lambda orders, part=part: part)
        references = extremes(expansion, SIGMAS[: 1 + 2 * bool(n)])
        for result, reference in zip(results, references, strict=True):
            assert np.count_nonzero(widening(result, reference) > 1e-4) == 0


def test_the_lowest_of_many_equal_valleys():
    """T₄(x) + T₄(y) has four equal minima; a small slope decides which is the lowest."""
    index = np.array([[0, 0], [1, 0], [0, 1], [4, 0], [0, 4]])
    slopes = np.array([[0.01, 0.01], [0.01, -0.01], [-0.01, 0.01], [-0.01, -0.01]]).T
    terms = np.concatenate([np.zeros((1, 4)), slopes, np.ones((2, 4))])
    (result,) = extremes(HybridExpansion((), index, terms), (0.0,))
    np.testing.assert_array_equal(np.sign(result.places[0]), -np.sign(slopes.T))
    np.testing.assert_allclose(np.abs(result.places[0]), np.sqrt(0.5), atol=2e-3)


def test_signs_of_ten_variables_that_interact():
    """A quadratic form without squares is least at one of 1024 vertices."""
    rng = np.random.default_rng(5)
    index = np.array([row for row in np.ndindex(*[2] * 10) if sum(row) <= 2])
    terms = rng.standard_normal((len(index), 20))
    expansion = HybridExpansion((), index, terms)
    vertices = np.array(list(np.ndindex(*[2] * 10))) * 2.0 - 1
    values = expansion.evaluate(np.zeros((1024, 0)), vertices)
    (result,) = extremes(expansion, (0.0,))
    np.testing.assert_allclose(result.values[0], values.min(axis=0), rtol=1e-9)
    np.testing.assert_allclose(result.values[1], values.max(axis=0), rtol=1e-9)
    np.testing.assert_array_equal(np.abs(result.places), 1.0)


def test_results_do_not_depend_on_which_series_are_searched_together():
    expansion = random_expansion(3, 1, 3, 40, seed=1)
    all_results = extremes(expansion, SIGMAS)
    for columns in (slice(0, 1), slice(7, 30)):
        part = replace(expansion, coefficients=expansion.coefficients[:, columns])
        for result, all_of_them in zip(extremes(part, SIGMAS), all_results, strict=True):
            np.testing.assert_array_equal(result.values, all_of_them.values[:, columns])
            np.testing.assert_array_equal(result.places, all_of_them.places[:, columns])
