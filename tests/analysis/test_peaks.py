"""How low sampled curves are between their points, against the curves themselves."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from flexband.analysis.peaks import drops, lowest_between

TIMES = np.linspace(0.0, 1.0, 11)


@given(st.floats(0.2, 0.8), st.floats(0.1, 5.0), st.floats(0.1, 5.0))
def test_corners_after_impacts_are_reached(place, before, after):
    """A curve falls, turns at once and rises."""
    curve = np.maximum(before * (place - TIMES), after * (TIMES - place))
    assert (curve - drops(curve, np.diff(TIMES), impacts=True)).min() <= 1e-12


def test_a_corner_is_deeper_than_a_parabola():
    curve = np.abs(TIMES - 0.45)
    depth = drops(curve, np.diff(TIMES), impacts=True).max()
    np.testing.assert_allclose(depth, 0.05, rtol=1e-12)
    assert drops(curve, np.diff(TIMES)).max() < 0.3 * depth


def test_what_half_of_the_points_does_not_tell_may_be_missed_between_all():
    """A spike at one time may be as deep again between two; a corner is known from each second."""
    spike = np.where(np.arange(11) == 4, 1.0, 2.0)[None]
    np.testing.assert_allclose(lowest_between(spike, np.diff(TIMES)), 0.0, atol=1e-12)
    corner = np.abs(TIMES - 0.45)[None]
    np.testing.assert_allclose(lowest_between(corner, np.diff(TIMES)), 0.0, atol=1e-12)


def test_where_spikes_are_met_by_chance_any_curve_may_have_one():
    """Of 40 curves with a spike at any instant, a fifth has it at an output time."""
    centers = np.linspace(0.2, 0.8, 40)[:, None]
    margins = 1.0 - 2.0 * (np.abs(TIMES - centers) < 0.01)
    assert 0 < (margins.min(axis=1) < 0).mean() < 0.3
    assert (lowest_between(margins, np.diff(TIMES)) < 0).all()
    wide = 1.0 - 2.0 * np.exp(-0.5 * ((TIMES - centers) / 0.15) ** 2)
    assert np.isfinite(lowest_between(wide, np.diff(TIMES))).all()


@given(st.floats(0.2, 0.8), st.floats(0.1, 5.0))
def test_parabolas_are_exact(place, size):
    curve = size * (TIMES - place) ** 2
    np.testing.assert_allclose((curve - drops(curve, np.diff(TIMES))).min(), 0.0, atol=1e-12)
