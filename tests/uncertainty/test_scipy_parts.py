"""Parts of SciPy that are made here, since their packages take long to import."""

import numpy as np
import pytest
import scipy

from flexband.uncertainty.expansions.polynomials import cubic_spline
from flexband.uncertainty.surrogates.diagnostics import _averages

RNG = np.random.default_rng(7)


@pytest.mark.parametrize("places", [2, 3, 4, 5, 60])
@pytest.mark.parametrize("kind", [float, complex])
def test_splines_are_those_of_scipy(places, kind):
    x = np.cumsum(RNG.integers(1, 4, places))
    y = RNG.standard_normal((3, places)) * kind(1 + 1j if kind is complex else 1)
    at = np.arange(x[0], x[-1] + 1)
    exact = scipy.interpolate.CubicSpline(x, y, axis=-1)(at)
    np.testing.assert_array_equal(cubic_spline(x, y, at), exact)


@pytest.mark.parametrize("times", [1, 5, 80])
@pytest.mark.parametrize("half", [0, 2, 30])
def test_averages_are_those_of_scipy(times, half):
    values = RNG.standard_normal((3, times))
    exact = scipy.ndimage.uniform_filter1d(values, 2 * half + 1, mode="constant")
    np.testing.assert_array_equal(_averages(values, half), exact)
