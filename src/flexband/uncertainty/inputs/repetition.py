"""One run again, alone: it recognizes a response that mixes its samples, or is not reproducible.

A sample must not depend on the others of its batch, as by an average over them, a common step of a
solver, or what an earlier call has left. Rounding may differ with the place in a batch, and chaotic
responses amplify it, so values need not agree bit by bit. A batch of copies of the sample tells
apart which it is: in it all neighbours are others, but all places are the same.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from flexband.errors import InputError, StoreError, warn
from flexband.execution.store import INSIST, OTHER_FOLDER, Store

ROUNDING = 1e-6
"""Differences up to this part of the variation over all runs are rounding."""

DIGITS = 1e-13
"""Differences up to this part of the values are rounding."""

LARGE = 0.01
"""Differences above this part of the variation make results wrong."""


def middle(values: np.ndarray) -> int:
    """Return the run that is the median of all: an extreme one may stay if runs are normalized."""
    flat = values.reshape(len(values), -1)
    size = np.sqrt(np.mean(flat**2, axis=0)) + np.finfo(float).tiny
    return int(np.argsort((flat / size).mean(axis=1), kind="stable")[len(flat) // 2])


def check_repetition(
    values: np.ndarray, again: Callable[[int], np.ndarray], run: int, *, noise_allowed: bool
) -> None:
    """Run one of some runs again, and refuse or remark what makes a difference.

    Parameters
    ----------
    values : of all runs, which were made together, shape (runs, …).
    again : returns the values of the run again, made in a batch of so many copies, (copies, …).
    run : its number.
    noise_allowed : whether the method averages over samples and fits nothing.

    Raises
    ------
    InputError
        If samples of a batch change each other, or the same inputs give other values, by more than
        `LARGE`.
    """
    alone = again(1)[0]
    off = _apart(values, values[run], alone)
    if off <= ROUNDING:
        return
    part = f"{100 * off:.2g} % of its variation" if np.isfinite(off) else "more than it varies"
    repeated = again(1)[0]
    if _apart(values, alone, repeated) > ROUNDING:
        text = (
            "the response returns other values if the same inputs are run again: it differs by "
            f"{part}. Is it noisy, or does it keep a state between calls?"
        )
        if not noise_allowed and off > LARGE:
            raise InputError(
                f"{text} An expansion would fit noise; fix the seed of random numbers, make them "
                "an input, or use a scanning method"
            )
    elif _apart(values, again(len(values))[run], values[run]) <= ROUNDING:
        text = (
            f"the place of a sample in its batch changes the response by {part}. Does it use the "
            "number of the sample, or is it chaotic, so that rounding matters?"
        )
        if not noise_allowed and off > LARGE:
            raise InputError(text)
    else:
        text = (
            "a sample must not depend on the others of its batch; alone, one of the samples "
            f"differs by {part}. Does the response average or normalize over samples, or solve "
            "them with common steps?"
        )
        if off > LARGE:
            raise InputError(text)
    warn(text)


def check_stored(values: np.ndarray, old: np.ndarray, new: np.ndarray, store: Store) -> None:
    """Compare runs of a store, which were made again, with what it has.

    Parameters
    ----------
    values : of all runs, shape (runs, …).
    old, new : of those that were made again.

    Raises
    ------
    StoreError
        If they differ by more than `LARGE`; a warning says if they differ by more than `ROUNDING`.
    """
    off = max(_apart(values, *pair) for pair in zip(old, new, strict=True))
    if off <= ROUNDING:
        return
    part = f"{100 * off:.2g} % of the variation" if np.isfinite(off) else "more than runs vary"
    text = (
        f"runs in {store.folder} were made again and differ by {part}: the response has changed in "
        "a way that its code does not show, or is noisy"
    )
    if off > LARGE and not store.insist:
        raise StoreError(f"{text}. {OTHER_FOLDER}. To use them nevertheless, {INSIST}")
    warn(text)


def _apart(values: np.ndarray, one: np.ndarray, other: np.ndarray) -> float:
    """Return how far two runs differ, in parts of the variation of the output where it is most."""
    runs = values.reshape(len(values), -1, values.shape[-1] if values.ndim > 1 else 1)
    off = np.abs(one - other).reshape(runs.shape[1:])
    off = np.where(off > DIGITS * np.abs(runs).max(axis=(0, 2))[:, None], off, 0.0)
    variation = np.sqrt(np.mean((runs - runs.mean(axis=0)) ** 2, axis=(0, 2)))
    moved = np.sqrt(np.mean(off**2, axis=1))
    with np.errstate(divide="ignore"):
        return float(np.max(moved[moved > 0] / variation[moved > 0], initial=0.0))
