"""Derivatives of tabulated functions of time."""

import numpy as np
import pytest

from flexband.mechanics.time_functions.derivatives import derivatives


@pytest.mark.parametrize("samples", [2, 3, 8, 9])
def test_a_sample_alone_has_the_rates_that_it_has_among_others(samples):
    """Bit for bit: a rounding error of f″ moves reactions next to a singular position."""
    rng = np.random.default_rng(samples)
    values = np.sin(np.linspace(0.0, 3.0, 81)[:, None] * rng.uniform(1.0, 2.0, samples))
    batch, *_ = derivatives(values, 0.5e-3)
    for k in range(samples):
        single_run, *_ = derivatives(values[:, [k]].copy(), 0.5e-3)
        np.testing.assert_array_equal(single_run[..., 0], batch[..., k])
