"""Inputs that can be narrowed in the page: intervals, and the scatter of random inputs."""

from __future__ import annotations

from typing import Any

import numpy as np

from flexband.uncertainty.inputs.correlated import Correlated
from flexband.uncertainty.inputs.distributions.bounded import Uniform
from flexband.uncertainty.inputs.distributions.normal import LogNormal, Normal
from flexband.uncertainty.inputs.fields.random_field import RandomField
from flexband.uncertainty.inputs.inputs import Input, Interval
from flexband.uncertainty.inputs.pbox import PBox
from flexband.uncertainty.inputs.space import Space

RELATIVE = "coefficient of variation"
"""What is scaled of a LogNormal; it has no unit."""

LEAST_FIELD = 0.01
"""Least scatter of a field, which cannot be replaced by a number, in parts of that of the study."""


def intervals_of(space: Space) -> tuple[list[dict[str, Any]], list[str]]:
    """Return the intervals that can be narrowed, and why others cannot."""
    found, told, first = [], [], 0
    for name, one in space.of_kind(random=False).items():
        if not isinstance(one, Interval):
            told.append(f"{name} keeps its limits: it is {_kind(one)}.")
        elif one.lower < one.upper:
            found.append({"name": name, "lower": one.lower, "upper": one.upper, "variable": first})
        first += one.dimension
    return found, told


def scatters_of(
    space: Space, inputs: str, *, resolved: bool
) -> tuple[list[dict[str, Any]], list[str]]:
    """Return the random inputs whose scatter can be scaled, and why others cannot.

    Parameters
    ----------
    inputs : where Python finds the inputs of the surrogate.
    resolved : whether the page can compute all moments for less scatter.
    """
    found, told, first = [], [], 0
    groups = [one for one in space.given.values() if isinstance(one, Correlated)]
    for name, one in space.of_kind(random=True).items():
        scatter = _scatter(one, f"{inputs}[{name!r}]")
        if any(name in group.members for group in groups):
            told.append(f"{name} keeps its scatter: it is correlated with other inputs.")
        elif scatter is None:
            told.append(f"{name} keeps its scatter: it is {_kind(one)}.")
        elif not resolved:
            told.append(f"{name} keeps its scatter: a vibration has too many random inputs.")
        else:
            variables = list(range(first, first + one.dimension))
            found.append({"name": name, "variables": variables, **scatter})
        first += one.dimension
    return found, told


def _kind(one: Input) -> str:
    """Return what kind of input one is, with an article."""
    name = type(one.distribution if isinstance(one, PBox) else one).__name__
    if isinstance(one, RandomField):
        name = f"{one.distribution} {name}"
    if isinstance(one, PBox | RandomField) and one.intervals:
        name += " with intervals as parameters"
    elif isinstance(one, RandomField) and callable(one.std):
        name += " whose std is a function"
    return f"{'an' if name[0] in 'AEIOU' else 'a'} {name}"


def _scatter(one: Input, old: str) -> dict[str, Any] | None:
    """Return how the scatter of an input, in Python `old`, is scaled, or None if it cannot be.

    Returns
    -------
    `of`, what is scaled, and its `size`, of a LogNormal that of the logarithm; the `least` scale;
    `python`, in which {0} and {1} stand
    for the `ends` a + b s at the scale s, and `fixed` for s = 0.
    """
    if one.intervals:
        return None
    ends, least = [], 0.0
    match one:
        case Normal():
            of, size, fixed = "std", float(one.spread), float(one.mean)
            python = f"fb.Normal({fixed!r}, {{0}})"
        case LogNormal():
            of, (mean, size) = RELATIVE, map(float, one.logarithm)
            fixed, python = float(np.exp(mean)), f"fb.LogNormal.of_logarithm({mean!r}, {{0}})"
        case Uniform():
            of, size, fixed = "half width", (one.upper - one.lower) / 2, one.lower
            fixed, python = fixed + size, "fb.Uniform({0}, {1})"
            ends = [(fixed, -size), (fixed, size)]
        case RandomField(distribution="normal", std=float() | int() as std):
            of, size, fixed, least = "std", float(std), None, LEAST_FIELD
            python = f"dataclasses.replace({old}, std={{0}})"
        case _:
            return None
    found = {"of": of, "size": size, "fixed": fixed, "least": least, "python": python}
    return found | {"ends": ends or [(0.0, size)]}
