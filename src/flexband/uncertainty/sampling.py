"""Points for the reference methods: samples of ξ and a scan of η."""

from __future__ import annotations

import numpy as np
from scipy.special import ndtri
from scipy.stats import qmc

from flexband.uncertainty.expansion import tensor_points


def latin_hypercube_normals(samples: int, dimension: int, seed: int) -> np.ndarray:
    """Return a Latin hypercube of standard normal variables, shape (samples, dimension)."""
    if dimension == 0:
        return np.zeros((1, 0))
    return ndtri(qmc.LatinHypercube(dimension, rng=np.random.default_rng(seed)).random(samples))


def random_normals(samples: int, dimension: int, seed: int) -> np.ndarray:
    """Return independent standard normal variables, shape (samples, dimension)."""
    if dimension == 0:
        return np.zeros((1, 0))
    return np.random.default_rng(seed).standard_normal((samples, dimension))


def scan(points: int, dimension: int) -> np.ndarray:
    """Return the uniform grid of Eq. (7), ends included, shape (points**dimension, dimension)."""
    return tensor_points([np.linspace(-1, 1, points)] * dimension)
