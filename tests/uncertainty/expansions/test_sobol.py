"""Samples that are made without scipy.stats are those of scipy.stats."""

import numpy as np
import pytest
from scipy.special import ndtri
from scipy.stats import qmc

from flexband.uncertainty.expansions.points.sobol import JOE_KUO, MAX_DIMENSION, scrambled_sobol
from flexband.uncertainty.inputs.sampling import latin_hypercube_normals


@pytest.mark.parametrize("dimension", range(1, len(JOE_KUO) + 4))
def test_sobol_sequences_are_those_of_scipy(dimension):
    for seed, count in ((0, 1), (0, 2), (1, 37), (2, 4096)):
        engine = qmc.Sobol(dimension, rng=np.random.default_rng(seed))
        reference = engine.random_base2(12)[:count]
        assert np.array_equal(scrambled_sobol(count, dimension, seed), reference)
    assert qmc.Sobol.MAXDIM == MAX_DIMENSION


@pytest.mark.parametrize(("samples", "dimension"), [(1, 1), (7, 3), (100, 12)])
def test_latin_hypercubes_are_those_of_scipy(samples, dimension):
    engine = qmc.LatinHypercube(dimension, rng=np.random.default_rng(5))
    values = latin_hypercube_normals(samples, dimension, 5)
    assert np.array_equal(values, ndtri(engine.random(samples)))
