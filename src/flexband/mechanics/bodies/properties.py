"""Properties that vary along the axis of a beam or cable, or between samples."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.user_functions import evaluate_function
from flexband.basics.words import number_of
from flexband.errors import InputError

Property = ArrayLike | Callable[[np.ndarray], ArrayLike]
"""A number, an array of shape (n,), or a function of the position along the axis [m]. The function
takes positions of shape (points,) or (n, points) and returns values of shape (points,) or
(n, points)."""

Along = Callable[[str, Property, Callable], np.ndarray]
"""Evaluates a property at some positions, given its name, the property and the check of its values.
The result has shape (n or 1, …)."""


def evaluate_property(x: np.ndarray, name: str, value: Property, check: Callable) -> np.ndarray:
    """Evaluate a property at positions x [m] of one or all samples, (n or 1, positions)."""
    values = (
        evaluate_function(value, x, name)
        if callable(value)
        else np.asarray(value, float)[..., None]
    )
    try:
        shape = np.broadcast_shapes(np.shape(values), x.shape)
        values = np.atleast_2d(np.broadcast_to(values, shape))
    except ValueError:
        if not callable(value):
            raise InputError(
                f"{name} must have {number_of(len(x), 'sample')}, as the length; got "
                f"{np.size(value)}"
            ) from None
        raise InputError(
            f"{name} as a function of positions of shape {x.shape} must return values of that "
            f"shape or (n, {x.shape[-1]}); got shape {np.shape(values)}"
        ) from None
    check(name, values, rank=2)
    return values
