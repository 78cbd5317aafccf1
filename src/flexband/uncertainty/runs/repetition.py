"""One run again, alone: it recognizes a response that mixes its samples, or is not reproducible.

A sample must not depend on the others of its batch, as by an average over them, a common step of a
solver, or what an earlier call has left. Rounding may differ with the place in a batch, and chaotic
responses amplify it, so values need not agree bit by bit. A batch of copies of the sample tells
apart which it is: in it all neighbours are others, but all places are the same.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import xarray as xr

from flexband.basics.warning import warn
from flexband.errors import InputError, StoreError
from flexband.execution.store import ALLOW_MISMATCH, OTHER_FOLDER, Store
from flexband.remarks.remark import Remark, RemarkKind
from flexband.uncertainty.surrogates.axes import axes_of, names_of_outputs, units_of
from flexband.uncertainty.surrogates.diagnostics import variation


class DifferenceLimits(NamedTuple):
    """How far a run may differ from the same run, as parts of the variation over all runs."""

    rounding: float = 1e-6  # differences up to it are rounding
    wrong: float = 0.01  # differences above it make results wrong


def middle(values: np.ndarray) -> int:
    """Return the run that is the median of all: an extreme one may stay if runs are normalized."""
    flat = values.reshape(len(values), -1)
    size = np.sqrt(np.einsum("rs,rs->s", flat, flat) / len(flat)) + np.finfo(float).tiny
    return int(np.argsort(np.einsum("rs,s->r", flat, 1 / size), kind="stable")[len(flat) // 2])


def check_repetition(
    values: np.ndarray,
    repeat_run: Callable[[int], np.ndarray],
    run: int,
    labels: xr.DataArray,
    *,
    noise_allowed: bool,
    limits: DifferenceLimits = DifferenceLimits(),
) -> None:
    """Run one of some runs again, and refuse or remark what makes a difference.

    Parameters
    ----------
    values : of all runs, which were made together, shape (runs, …).
    repeat_run : returns new values of the run, made in a batch of so many copies, (copies, …).
    run : its number.
    labels : of a response.
    noise_allowed : whether the method averages over samples and fits nothing.

    Raises
    ------
    InputError
        If samples of a batch change each other, or the same inputs give other values, by more than
        `limits.wrong`.
    """
    first_values = repeat_run(1)[0]
    off, name = _largest_difference(values, values[run], first_values, labels)
    if off <= limits.rounding:
        return
    part = f"{100 * off:.2g} % of its variation" if np.isfinite(off) else "more than it varies"
    second_values = repeat_run(1)[0]
    if _largest_difference(values, first_values, second_values, labels)[0] > limits.rounding:
        text = (
            f"the response returns other values if the same inputs are run again: {name} differs "
            f"by {part}. Is it noisy, or does it keep a state between calls?"
        )
        if not noise_allowed and off > limits.wrong:
            raise InputError(
                f"{text} An expansion would fit noise; fix the seed of random numbers, make them "
                "an input, or use a scanning method"
            )
    elif (
        _largest_difference(values, repeat_run(len(values))[run], values[run], labels)[0]
        <= limits.rounding
    ):
        text = (
            f"the place of a sample in its batch changes {name} by {part}. Does the response use "
            "the number of the sample, or is it chaotic, so that rounding matters?"
        )
        if not noise_allowed and off > limits.wrong:
            raise InputError(text)
    else:
        text = (
            f"a sample must not depend on the others of its batch; alone, {name} of one of the "
            f"samples differs by {part}. Does the response average or normalize over samples, or "
            "solve them with common steps?"
        )
        if off > limits.wrong:
            raise InputError(text)
    warn(text, remarks=[Remark(RemarkKind.NOISE, text, size=off, outputs=(name,), error=off)])


def check_stored(
    values: np.ndarray,
    old: np.ndarray,
    new: np.ndarray,
    labels: xr.DataArray,
    store: Store,
    limits: DifferenceLimits = DifferenceLimits(),
) -> None:
    """Compare `values` of all runs, (runs, …), of which `old` of a store were made again as `new`.

    If they differ by more than `limits.wrong`, raise a `StoreError`; a warning says if they differ
    by more than `limits.rounding`. `labels` are those of a response.
    """
    pairs = zip(old, new, strict=True)
    off, name = max(_largest_difference(values, *pair, labels) for pair in pairs)
    if off <= limits.rounding:
        return
    part = f"{100 * off:.2g} % of its variation" if np.isfinite(off) else "more than it varies"
    text = (
        f"runs in {store.folder} were made again and {name} differs by {part}: the response has "
        "changed in a way that its code does not show, or is noisy"
    )
    if off > limits.wrong and not store.allow_mismatch:
        raise StoreError(f"{text}. {OTHER_FOLDER}. To use them nevertheless, {ALLOW_MISMATCH}")
    warn(text, remarks=[Remark(RemarkKind.NOISE, text, size=off, outputs=(name,), error=off)])


def _largest_difference(
    values: np.ndarray, first_run: np.ndarray, second_run: np.ndarray, labels: xr.DataArray
) -> tuple[float, str]:
    """Return the largest difference of two runs, relative to a variation, and its output."""
    runs = values.reshape(len(values), -1, axes_of(labels).times)
    deviation = np.abs(first_run - second_run).reshape(runs.shape[1:])
    size = np.maximum(runs.max(axis=(0, 2)), -runs.min(axis=(0, 2)))
    smallest_variation = units_of(labels).least_variation(size)
    difference = np.sqrt(
        np.mean(np.where(deviation > smallest_variation[:, None], deviation, 0.0) ** 2, axis=1)
    )
    spread = variation(runs)
    parts = np.divide(
        difference, spread, out=np.where(difference > 0, np.inf, 0.0), where=spread > 0
    )
    worst = int(np.argmax(parts))
    return float(parts[worst]), names_of_outputs(labels)[worst]
