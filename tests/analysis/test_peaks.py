"""How low sampled curves are between their points, against the curves themselves."""

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

import flexband as fb
from flexband.analysis.peaks import TimeAxis, least_between, lowest_of_impacts

TIMES = np.linspace(0.0, 1.0, 11)
AXIS = TimeAxis(TIMES)


@given(st.floats(0.2, 0.8), st.floats(0.1, 5.0), st.floats(0.1, 5.0))
def test_corners_after_impacts_are_reached(place, fall, rise):
    """A curve falls, turns at once and rises."""
    curve = np.maximum(fall * (place - TIMES), rise * (TIMES - place))
    assert least_between(curve, AXIS, impacts=True).lowest.min() <= 1e-12


def test_a_corner_is_deeper_than_a_cubic():
    curve = np.abs(TIMES - 0.45)
    np.testing.assert_allclose(least_between(curve, AXIS, impacts=True).lowest.min(), 0, atol=1e-15)
    assert least_between(curve, AXIS).lowest.min() > 0.03


def test_what_half_of_the_points_does_not_tell_may_be_missed_between_all():
    """A spike at one time may be as deep again between two; a corner is known from each second."""
    spike = np.where(np.arange(11) == 4, 1.0, 2.0)[None]
    np.testing.assert_allclose(lowest_of_impacts(spike, AXIS), 0.0, atol=1e-12)
    corner = np.abs(TIMES - 0.45)[None]
    np.testing.assert_allclose(lowest_of_impacts(corner, AXIS), 0.0, atol=1e-12)


def test_where_spikes_are_met_by_chance_any_curve_may_have_one():
    """Of 40 curves with a spike at any instant, a fifth has it at an output time."""
    centers = np.linspace(0.2, 0.8, 40)[:, None]
    margins = 1.0 - 2.0 * (np.abs(TIMES - centers) < 0.01)
    assert 0 < (margins.min(axis=1) < 0).mean() < 0.3
    assert (lowest_of_impacts(margins, AXIS) < 0).all()
    wide = 1.0 - 2.0 * np.exp(-0.5 * ((TIMES - centers) / 0.15) ** 2)
    assert np.isfinite(lowest_of_impacts(wide, AXIS)).all()


def polynomial(extremes):
    """Return a cubic or parabola with these extremes."""
    return np.polynomial.Polynomial.fromroots(extremes).integ()


times_of_any_steps = st.lists(st.floats(0.02, 1.0), min_size=3, max_size=9).map(np.cumsum)
ends_of_a_window = st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0)).map(sorted)


@given(times_of_any_steps, st.lists(st.floats(0.0, 1.0), min_size=1, max_size=2), ends_of_a_window)
def test_cubics_are_exact_in_any_window(times, extremes, ends):
    """Also in the first and the last step, and from and to any place in a step."""
    times = np.concatenate([[0.0], times])
    curve = polynomial(np.array(extremes) * times[-1])
    first, last = np.array(ends) * times[-1]
    minima = least_between(curve(times), TimeAxis(times, (first, last)))
    smallest = curve(np.linspace(first, last, 2001)).min()
    size = np.ptp(curve(np.linspace(0, times[-1], 101))) + 1e-12
    assert smallest - 1e-5 * size < minima.estimate.min() < smallest + 1e-9 * size
    step = int(minima.estimate.argmin())
    assert curve(minima.place[step]) == pytest.approx(minima.estimate[step], abs=1e-9 * size)
    assert minima.lowest.min() <= minima.estimate.min() <= minima.highest.min()


@given(st.floats(0.0, 1.0), st.floats(0.1, 5.0))
def test_three_times_have_a_parabola(place, size):
    times = np.array([0.0, 0.3, 1.0])
    minima = least_between(size * (times - place) ** 2, TimeAxis(times))
    np.testing.assert_allclose(minima.lowest.min(), 0.0, atol=1e-12)


T = np.linspace(0, 1, 21)
PEAK = 0.52
LIMIT = 0.97


def parabolas(a):
    """Return curves that are highest, with the value a, between two output times."""
    curves = a[:, None] - 100 * (T - PEAK) ** 2
    return xr.DataArray(curves[:, None], {"output": ["u"], "time": T}, ("sample", "output", "time"))


def top(first, last):
    """Return by how much the highest of these curves is below `a` within a window."""
    return 100 * (PEAK - np.clip(PEAK, first, last)) ** 2


@pytest.mark.parametrize("ends", [(0.5, 0.8), (0.51, 0.8), (0.2, 0.51), (0.525, 0.8), (0.2, 0.5)])
def test_every_answer_looks_at_the_ends_of_a_window(ends):
    """Worst case, probability and yield, where the peak is beside, at, or outside of an end."""
    surrogate = fb.expand(parabolas, {"a": fb.Interval(0, 1)}, fb.AdaptivePCCI(0.01))
    requirement = fb.Requirement("q", "u", below=LIMIT, during=ends)
    margins = fb.analysis.check_requirements(surrogate, requirement)
    margin = LIMIT - (1 - top(*ends))
    np.testing.assert_allclose(margins["margin_between"], margin, atol=1e-9)
    assert margins["verdict"].values.item() == ("kept" if margin > 0 else "not kept")
    uniform = fb.Uniform(0, 1)
    share = max(0.0, -margin)
    part = fb.production_yield(surrogate, requirement, {"a": uniform})
    assert float(part["failing_low"][0]) <= share <= float(part["failing_high"][0]) < share + 0.02
    random = fb.expand(parabolas, {"a": uniform}, fb.AdaptivePCCI(0.01))
    probability = fb.analysis.failure_probability(random, requirement).isel(bound=1)
    ends_of_interval = (float(probability[f"between_times_{end}"][0]) for end in ("low", "high"))
    assert next(ends_of_interval) <= share <= next(ends_of_interval)
    requirements = [requirement, fb.Requirement("r", "u", below=2.0, during=(0.1, 0.3))]
    of_any = fb.analysis.failure_probability(random, requirements).sel(
        limit="any limit", bound="upper"
    )
    assert float(of_any["between_times"]) == pytest.approx(
        float(probability["between_times"][0]), rel=0.2
    )


def test_allocated_tolerances_know_what_is_between_the_times_of_a_window():
    surrogate = fb.expand(parabolas, {"a": fb.Interval(0, 1)}, fb.AdaptivePCCI(0.01))
    requirement = fb.Requirement("q", "u", below=LIMIT, during=(0.5, 0.8))
    allocation = fb.analysis.allocate(surrogate, requirement, {"a": 1.0})
    np.testing.assert_allclose(allocation["grid_error"], top(0.5, 0.5), atol=1e-6)
    assert "between them it is violated by up to 0.03" in allocation.attrs["verdict"]


def test_peaks_of_quantities_are_found_at_the_ends_of_the_motion_and_of_turns():
    curves = parabolas(np.array([0.3, 0.5])).isel(output=0, drop=True)
    first_step = curves.isel(time=slice(10, None))  # from 0.5: the peak is in the first step
    np.testing.assert_allclose(fb.analysis.Peak()(first_step), [0.3, 0.5], atol=1e-12)
    np.testing.assert_allclose(fb.analysis.PeakTime()(first_step), PEAK, atol=1e-12)
    turns = fb.analysis.Peak(period=0.51)(curves)  # the only whole turn ends before the peak
    np.testing.assert_allclose(turns[:, 0], np.array([0.3, 0.5]) - top(0, 0.51), atol=1e-9)
    np.testing.assert_allclose(fb.analysis.Trough()(-first_step), [-0.3, -0.5], atol=1e-12)
