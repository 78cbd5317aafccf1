"""How low a sampled curve may be between its points: parabolas, and corners after impacts."""

from __future__ import annotations

import numpy as np
import xarray as xr

from flexband.uncertainty.surrogates.axes import axes_of


def spacing(labels: xr.DataArray) -> np.ndarray | None:
    """Return the steps of time of a response; None where it has no order or few values."""
    axes = axes_of(labels)
    last = axes.time
    if last is None or axes.times < 3:
        return None
    if last not in labels.coords:
        return np.ones(axes.times - 1)
    if labels[last].dtype.kind not in "iuf":
        return None
    steps = np.diff(labels[last].values.astype(float))
    return steps if (steps > 0).all() or (steps < 0).all() else None


def drops(values: np.ndarray, steps: np.ndarray | None, *, impacts: bool = False) -> np.ndarray:
    """Return by how much a curve is lower beside each of its points, zero where it is not.

    A parabola goes through a minimum and its two neighbours, at steps a and b. With its slope d
    at the minimum and half its second derivative c, its own minimum is lower by d²/4c. Curves with
    `impacts` turn at once: between two points, as low as where the lines before and after meet.

    Curves `values`, (…, times), are not continued to where they are infinite. Of curves that are
    known at points only, `steps`, (times − 1,), is None.
    """
    depths = np.zeros(values.shape)
    if steps is None:
        return depths
    a, b = np.abs(steps[:-1]), np.abs(steps[1:])
    with np.errstate(invalid="ignore"):
        rise = np.diff(values, axis=-1) / np.abs(steps)
        before, after = rise[..., :-1], rise[..., 1:]
        c, d = (after - before) / (a + b), (before * b + after * a) / (a + b)
        least = (before <= 0) & (after >= 0) & np.isfinite(c) & (c > 0)
    depths[..., 1:-1] = np.divide(d**2, 4 * c, out=np.zeros(c.shape), where=least)
    if impacts:
        depths[..., 1:-2] = np.maximum(depths[..., 1:-2], _corners(values, rise, np.abs(steps)))
    return depths


def lowest_between(margins: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Return how low margins of curves with impacts, (curves, …, times), may be between times.

    Every second time should tell of the others: what corners and parabolas between these miss of
    the least margin, those between all times may miss of what is there. If most of the curves that
    leave their bounds do so as no second time tells, any may leave them; the shape is (curves, …).
    """
    least = margins.min(axis=-1)
    lowest = (margins - drops(margins, steps, impacts=True)).min(axis=-1)
    times, missed = np.concatenate([[0.0], np.cumsum(np.abs(steps))]), np.zeros(least.shape)
    for first in (0, 1):
        half = margins[..., first::2]
        depth = drops(half, np.diff(times[first::2]), impacts=True)
        estimate = (half - depth).min(axis=-1, initial=np.inf)
        known = np.isfinite(estimate)
        missed[known] = np.maximum(missed, estimate - np.where(known, least, 0.0))[known]
    out = least < 0
    unforeseen = np.count_nonzero(out & (least + missed > 0), axis=0)
    hidden = 2 * unforeseen > np.count_nonzero(out, axis=0)
    return np.where(hidden, -np.inf, lowest - missed)


def _corners(values: np.ndarray, rise: np.ndarray, steps: np.ndarray) -> np.ndarray:
    """Return how deep corners are below the point before them, (…, times − 3), from the second."""
    before, after, step = rise[..., :-2], rise[..., 2:], steps[1:-1]
    with np.errstate(invalid="ignore", divide="ignore"):
        place = (np.diff(values, axis=-1)[..., 1:-1] - after * step) / (before - after)
        falls = (before < 0) & (after > 0) & (place > 0) & (place < step)
        return np.where(falls, -before * place, 0.0)
