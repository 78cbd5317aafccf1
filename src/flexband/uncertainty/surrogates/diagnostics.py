"""What methods that resolve phases say of their bands, and what they compute it from."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import xarray as xr

from flexband.basics.rounding import Units, largest_of
from flexband.errors import InputError
from flexband.uncertainty.expansions.expansion import Extremes
from flexband.uncertainty.surrogates.axes import axes_of, names_of_outputs

SMALLEST = 2e-5
"""Errors below this part of the error bar's width, or of the variation, are not told from none."""

CONFIDENCE = 0.95
"""Of what runs say of the whole space."""

DOUBT = 0.5
"""Where more than this part of the variation is missed, the expansion is not trusted."""

SMALL = 1e-4
"""Variation of a component of a vector or tensor, as a part of that of the largest component, below
which errors are relative to this. What is zero in theory is rounding and vibrations of the mesh,
which converge to nothing."""


class Quantities(NamedTuple):
    """The vectors and tensors of outputs: `of` numbers that of each, `tensor` tells its kind."""

    of: np.ndarray
    tensor: np.ndarray

    @staticmethod
    def alone(outputs: int) -> Quantities:
        return Quantities(np.arange(outputs), np.zeros(outputs, bool))

    def at_least(self, sizes: np.ndarray, tensors: float = SMALL) -> np.ndarray:
        """Return the sizes of outputs, at least `SMALL` (vectors) or `tensors` of their largest."""
        part = np.where(self.tensor, tensors, SMALL)
        return np.maximum(sizes, part * largest_of(sizes, self.of))


def step(values: xr.DataArray) -> float:
    """Return the step of time, equidistant, or 1 where there is none or no coordinate."""
    axes = axes_of(values)
    if axes.times < 2 or axes.time not in values.coords:
        return 1.0
    times = values[axes.time].values
    if not np.issubdtype(times.dtype, np.number):
        return 1.0
    steps = np.diff(times)
    if np.ptp(steps) > 1e-6 * np.abs(steps).max():
        raise InputError(
            f"a phase-resolved expansion needs equidistant values of {axes.time!r}; got steps from "
            f"{steps.min():g} to {steps.max():g} (AdaptivePCCI(phase_resolved=False) takes any)"
        )
    return float(np.mean(steps))


def rms(v: np.ndarray) -> np.ndarray:
    """Return the root mean square over runs and times, (outputs,)."""
    return np.sqrt(np.einsum("rot,rot->o", v, v) / (v.shape[0] * v.shape[2]))


def variation(F: np.ndarray) -> np.ndarray:
    """Return the root mean square of the deviations of runs from their mean, (outputs,)."""
    return np.array([rms((runs - runs.mean(axis=0))[:, None])[0] for runs in np.moveaxis(F, 1, 0)])


def share(m: int) -> float:
    """Return the error of bands over m intervals as a part of what is missed of generic runs.

    A bound averages over random variables, but is attained at ends of intervals.
    """
    # with more intervals than this, m of them, the part is √(m / 3) times larger: what is
    # missed in every one alike adds up at a corner, but hardly at generic points
    alone = 3
    return 0.5 * math.sqrt(max(1.0, m / alone))


def unseen_share(runs: int) -> float:
    """Return the largest part of the space in which so many runs may all not lie, by 5 % chance."""
    return 1 - (1 - CONFIDENCE) ** (1 / runs)


def unnoticed_text(runs: int) -> str:
    """Return how large an effect is that so many runs may all miss, as a sentence without its stop.

    Its share of the space is rounded up.
    """
    shares = {
        "a hundredth": 0.01, "a fiftieth": 0.02, "a twentieth": 0.05, "a tenth": 0.1,
        "a fifth": 0.2, "a quarter": 0.25, "a third": 1 / 3, "half": 0.5, "two thirds": 2 / 3,
    }  # fmt: skip
    unseen = unseen_share(runs)
    words = (f"less than {words}" for words, share in shares.items() if unseen <= share)
    return f"An effect confined to {next(words, 'a part')} of the input space can go unnoticed"


def varying_outputs(F: np.ndarray, units: Units) -> np.ndarray:
    """Return which outputs of runs F, shape (runs, outputs, times), vary beyond rounding."""
    return units.varies(variation(F), rms(F))


def least_error(F: np.ndarray, units: Units) -> np.ndarray:
    """Return the errors that runs F do not tell from none, (outputs,)."""
    spread = np.where(varying_outputs(F, units), variation(F), 0.0)
    return np.maximum(SMALLEST * spread, np.finfo(float).eps * rms(F))


def unseen_steps(F: np.ndarray) -> np.ndarray:
    """Return the error of bands of counts that are alike in all runs F, (outputs, times).

    A count is a whole number at all times. Where it changes, a share p of the parts may count
    earlier or later, as long as no run is likely to be one of them (`unseen_share`): their standard
    deviation is √(p(1 − p)) times the step. It is zero for other outputs.
    """
    heights = np.zeros(F.shape[1:])
    share = unseen_share(len(F))
    counts = (F[0] == np.round(F[0])).all(axis=-1) & (F[:1] == F).all(axis=(0, 2))
    steps = np.abs(np.diff(F[0, counts]))
    heights[counts, :-1] = steps
    heights[counts, 1:] = np.maximum(heights[counts, 1:], steps)
    return math.sqrt(share * (1 - share)) * heights


def missed_part(
    missed: np.ndarray, F: np.ndarray, units: Units, quantities: Quantities | None = None
) -> np.ndarray:
    """Return which part of the variation of runs F is missed, (outputs,); 0 where F is constant."""
    variations = np.where(varying_outputs(F, units), variation(F), np.inf)
    return rms(missed) / (variations if quantities is None else quantities.at_least(variations))


def trust(
    labels: xr.DataArray, missed: np.ndarray, of: str = "its variation in check runs"
) -> xr.Dataset:
    """Return `trusted`, labelled like a response, and why outputs are not: `of` what is missed."""
    axes = axes_of(labels)
    doubts = [
        f"{name} ({100 * part:.0f} % of {of} is missed)"
        for name, part in zip(names_of_outputs(labels), missed, strict=True)
        if not part < DOUBT
    ]
    trusted = xr.Dataset({"trusted": (axes.dims, (missed < DOUBT).reshape(axes.shape))})
    return trusted.assign_attrs({"not_trusted": "; ".join(doubts)} if doubts else {})


def running_rms(v: np.ndarray, half: int) -> np.ndarray:
    """Return the root mean square over ±half times."""
    top, count = (_averages(square, half) for square in (v**2, np.ones(v.shape[-1])))
    return np.sqrt(np.maximum(top, 0.0) / count)


def _averages(values: np.ndarray, half: int) -> np.ndarray:
    """Return averages over ±half times, zero outside, as `scipy.ndimage.uniform_filter1d`."""
    size = 2 * half + 1
    padded = np.pad(values, [(0, 0)] * (values.ndim - 1) + [(half, half)])
    first = np.cumsum(padded[..., :size], axis=-1)[..., -1:]
    changes = padded[..., size:] - padded[..., : values.shape[-1] - 1]
    return np.cumsum(np.concatenate([first, changes], axis=-1), axis=-1) / size


def stack_extremes(extremes: list[Extremes]) -> np.ndarray:
    """Return the values of bounds, shape (sigmas, 2, outputs, times)."""
    return np.stack([e.values for e in extremes])


def mean_difference(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the difference of interval means and error bars, mean of both bounds, (2, …)."""
    return of_bands(np.abs(a - b))


def of_bands(errors: np.ndarray) -> np.ndarray:
    """Return errors of mean and error bar, (2, …), from those of bounds of μ, μ − σ and μ + σ."""
    return np.stack([errors[0, 0] + errors[0, 1], errors[1, 0] + errors[2, 1]]) / 2


def at_all_times(v: np.ndarray, thin: slice, times: int) -> np.ndarray:
    """Return values at thinned times repeated up to the next, shape (…, times)."""
    return np.repeat(v, thin.step, axis=-1)[..., :times]


def diagnostics(
    labels: xr.DataArray,
    error: np.ndarray,
    relative: np.ndarray,
    carriers: np.ndarray,
    trusted: xr.Dataset,
    frequencies: Sequence[float],
) -> xr.Dataset:
    """Return what a phase-resolved method says of its bands, labelled like (runs, …).

    The error of mean and error bar, (2, outputs, times), is `relative` to mean widths, (outputs,).
    """
    dims = labels.dims[1:]
    shape = labels.shape[1:]
    axes = axes_of(labels)
    return xr.Dataset(
        {
            "mean_expected_error": (dims, error[0].reshape(shape)),
            "error_bar_expected_error": (dims, error[1].reshape(shape)),
            "relative_expected_error": (axes.dims, relative.reshape(axes.shape)),
            "carriers": (axes.dims, carriers.reshape(axes.shape)),
            "trusted": trusted["trusted"],
        },
        attrs={"carrier_frequencies": list(frequencies), **trusted.attrs},
    )
