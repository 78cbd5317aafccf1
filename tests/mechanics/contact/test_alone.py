"""Samples have the bits that they have alone, whenever their neighbours converge."""

import numpy as np
import pytest

import flexband as fb
from benchmarks.honesty.contact_mechanisms import FAMILIES


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", ["worn pin", "guide with play"])
@pytest.mark.parametrize("tolerance", [1e-4])
def test_a_sample_is_the_same_alone_and_in_a_batch(name, tolerance):
    """With long steps, in which Newton's method needs several matrices for some of the samples."""
    family = FAMILIES[name]
    nominal = {k: np.sqrt(low * high) for k, (low, high, _) in family.ranges.items()}
    parameter, radius = next((k, 0.3 * numbers[2]) for k, numbers in family.ranges.items())
    values = nominal[parameter] * (1.0 + radius * np.linspace(-1.0, 1.0, 9))
    response = fb.dynamic_response(
        lambda **changes: family.builder(**{**nominal, **changes}),
        duration=family.duration[1], step=family.duration[1] / 40,
        integrator=fb.GeneralizedAlpha(step_tolerance=tolerance),
    )  # fmt: skip
    batch = response(**{parameter: values}).values
    single_runs = [response(**{parameter: values[k : k + 1]}).values[0] for k in range(9)]
    np.testing.assert_array_equal(batch, single_runs)
