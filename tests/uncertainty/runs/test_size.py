"""Outputs whose squares vanish are refused, unless they are rounding errors of others in their unit."""

import numpy as np
import pytest
import xarray as xr

import flexband as fb


def guided(units):
    def velocities(speed):
        values = np.stack([speed, 1e-310 * speed], axis=1)
        coords = {"output": ["v_X", "v_Y"], "unit": ("output", units)}
        return xr.DataArray(values, coords, ("sample", "output"))

    return fb.propagate(velocities, {"speed": fb.Interval(1.0, 2.0)}, fb.PCCI(0, 1))


def test_what_a_guide_keeps_at_zero_is_taken():
    bands = guided(["m/s", "m/s"])
    assert bands["mean"].sel(output="v_X").values.tolist() == [1.0, 2.0]
    assert not bands["mean"].sel(output="v_Y").values.round(9).any()


def test_a_response_in_a_unit_that_is_far_too_large_is_refused():
    with pytest.raises(fb.errors.InputError, match="v_Y is at most"):
        guided(["m/s", "m"])
