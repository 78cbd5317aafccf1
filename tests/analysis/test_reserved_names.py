"""Names of results that a response must not have: they follow from the variables of each answer."""

import numpy as np
import pytest
import xarray as xr

import flexband as fb
from flexband.analysis.limits import margins
from flexband.analysis.probability import texts
from flexband.analysis.sensitivity import contributions
from flexband.uncertainty.inputs.evaluation import OF_BANDS, RESERVED
from flexband.uncertainty.surrogates import bands

INPUTS = {"a": fb.Interval(0.0, 1.0), "x": fb.Normal(0.0, 1.0)}
TIMES = np.linspace(0.0, 1.0, 5)
NAMES = sorted(
    {*bands.LONG_NAMES, *margins.LONG_NAMES, *texts.LONG_NAMES, *contributions.LONG_NAMES}
)


def response_with(name, *, dim):
    def response(a, x):
        last = name if dim else "time"
        values = xr.DataArray((a + 0.1 * x)[:, None] * (1 + TIMES), dims=("sample", last))
        return values.assign_coords({name: (last, TIMES)})

    return response


def test_all_variables_of_bands_are_reserved():
    assert set(bands.LONG_NAMES) <= OF_BANDS | set(RESERVED)
    surrogate = fb.expand(response_with("when", dim=True), INPUTS, fb.AdaptivePCCI())
    everything = surrogate.bands().data_vars
    assert set(map(str, everything)) - OF_BANDS == set()


def least_margin(response):
    """Return the least margin of the response below 1.5; everything else is asked for, too.

    The probability is asked for last, as it takes the longest where nothing has been refused.
    """
    surrogate = fb.expand(response, INPUTS, fb.PCCI(1, 1))
    limit = fb.Requirement("response", below=1.5)
    margin = float(fb.analysis.check_requirements(surrogate, limit)["least_margin"][0])
    fb.analysis.contributions(surrogate)
    fb.analysis.failure_probability(surrogate, limit, accuracy=0.2)
    return margin


@pytest.mark.parametrize("dim", [False, True])
@pytest.mark.parametrize("name", NAMES)
def test_a_response_with_the_name_of_a_variable_is_refused(name, dim):
    with pytest.raises(fb.errors.InputError, match=repr(name)):
        least_margin(response_with(name, dim=dim))


def test_a_response_with_another_name_is_judged():
    """It reaches 2 + 3 (0.1 · 2), which is 1.1 beyond the limit."""
    assert least_margin(response_with("when", dim=True)) == pytest.approx(-1.1)
