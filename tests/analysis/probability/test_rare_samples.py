"""Rare samples: subset simulation and scouts, against exact probabilities."""

import numpy as np
import pytest
from scipy.special import ndtr
from scipy.stats import norm

from flexband.analysis.probability.estimates import ImportanceOptions, mixture_around
from flexband.analysis.probability.subset import rare


def test_regions_that_levels_lead_away_from_are_found():
    """Counterexamples of Breitung, The geometry of limit state function graphs and subset
    simulation, Reliability Engineering & System Safety 182 (2019): the likeliest region is not
    where margins decrease first."""

    def piecewise(u):
        first = np.where(u[:, 0] > 3.5, 4 - u[:, 0], 0.85 - 0.1 * u[:, 0])
        second = np.where(u[:, 1] > 2.0, 0.5 - 0.1 * u[:, 1], 2.3 - u[:, 1])
        return np.minimum(first, second)

    exact = 1 - ndtr(4.0) * ndtr(5.0)
    factor = ImportanceOptions().rough_factor
    for seed in range(5):
        rng = np.random.default_rng(seed)
        region = rare(piecewise, 2, rng)
        mixture = mixture_around(piecewise, region.u, rng)
        u = mixture.sample(4000, rng)
        probability = np.mean(mixture.weights(u) * (piecewise(u) < 0))
        assert probability == pytest.approx(exact, rel=0.1)
        assert exact / factor < region.probability < exact * factor


def test_narrow_regions_of_a_vibration_are_found():
    """Phases of a vibration leave a limit in bands of the random input, on both sides."""

    # cos(9 u) > 0.95 and |u| > 3.3
    def margin(u):
        return np.maximum(0.95 - np.cos(9 * u[:, 0]), 3.3 - np.abs(u[:, 0]))

    grid = np.linspace(-8, 8, 400_001)
    exact = np.trapezoid(np.where(margin(grid[:, None]) < 0, norm.pdf(grid), 0.0), grid)
    for seed in range(5):
        rng = np.random.default_rng(seed)
        mixture = mixture_around(margin, rare(margin, 1, rng).u, rng)
        u = mixture.sample(16_000, rng)
        assert np.mean(mixture.weights(u) * (margin(u) < 0)) == pytest.approx(exact, rel=0.15)
