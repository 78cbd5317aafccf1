"""Numbers of samples and values of drives are checked when arrays are made of them."""

import numpy as np
import pytest

import flexband as fb
from tests.mechanics.models import pendulum_driven, rigid_slider_crank, slider_crank


def test_numbers_of_samples_must_fit():
    with pytest.raises(fb.errors.InputError, match=r"different numbers of samples: \[3, 4\]"):
        fb.simulate(
            slider_crank(crank_length=np.full(3, 0.2), spring_stiffness=np.full(4, 1e3)),
            duration=0.01,
            step=1e-3,
        )
    two_samples = rigid_slider_crank(np.full(2, 0.2), angle=lambda t: np.zeros(5))
    with pytest.raises(fb.errors.InputError, match=r"different numbers of samples: \[2, 5\]"):
        fb.simulate(two_samples, duration=0.01, step=1e-3)
    mechanism = pendulum_driven(lambda t: np.zeros(5) if t else 0.0)
    with pytest.raises(fb.errors.InputError, match="returned 5 values; the mechanism has 1 sample"):
        fb.simulate(mechanism, duration=0.01, step=1e-3)


def test_a_drive_that_returns_nan_is_refused():
    with pytest.raises(fb.errors.InputError, match=r"must be finite; it is not at t = 0\.0045 s"):
        fb.simulate(
            pendulum_driven(lambda t: np.nan if t > 0.004 else 0.0), duration=0.01, step=1e-3
        )
