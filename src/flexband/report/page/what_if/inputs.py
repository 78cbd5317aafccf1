"""Inputs that can be narrowed in the page: intervals, plays, and the scatter of random inputs."""

from __future__ import annotations

import numpy as np

from flexband.basics.words import with_article
from flexband.report.page.arrays import JsonRecord
from flexband.uncertainty.inputs.distributions.bounded import Uniform
from flexband.uncertainty.inputs.distributions.normal import LogNormal, Normal
from flexband.uncertainty.inputs.fields.random_field import RandomField
from flexband.uncertainty.inputs.inputs import Input, Interval
from flexband.uncertainty.inputs.pbox import PBox
from flexband.uncertainty.inputs.play import FreePair
from flexband.uncertainty.inputs.space import Space

RELATIVE = "coefficient of variation"
"""What is scaled of a LogNormal; it has no unit."""


def intervals_of(space: Space) -> tuple[list[JsonRecord], list[str]]:
    """Return the intervals that can be narrowed, and why others cannot."""
    intervals = []
    remarks = []
    columns = space.columns(random=False)
    for name, input_ in space.of_kind(random=False).items():
        if name in space.plays:
            continue
        if not isinstance(input_, Interval):
            remarks.append(f"{name} keeps its bounds: it is {_kind(input_)}.")
        elif input_.lower < input_.upper:
            ends = {"lower": input_.lower, "upper": input_.upper}
            intervals.append({"name": name, **ends, "variable": columns[name]})
    return intervals, remarks


def sizes_of(space: Space, inputs: str, *, resolved: bool) -> tuple[list[JsonRecord], list[str]]:
    """Return plays and random inputs to be scaled, by Python, and why others cannot be."""
    sizes = []
    remarks = []
    columns = space.columns(random=False) | space.columns(random=True)
    for name, input_ in (space.plays | space.of_kind(random=True)).items():
        scatter = _scatter(input_, f"{inputs}[{name!r}]")
        if name in space.dependent_names:
            remarks.append(f"{name} keeps its scatter: it is correlated with other inputs.")
        elif scatter is None:
            remarks.append(f"{name} keeps its scatter: it is {_kind(input_)}.")
        elif not resolved:
            remarks.append(f"{name} keeps its scatter: a vibration has too many random inputs.")
        else:
            variables = list(range(columns[name], columns[name] + input_.dimension))
            word = "scatter" if input_.random else scatter["of"]
            shared = {"name": name, "word": word, "variables": variables, "random": input_.random}
            sizes.append(shared | scatter)
    return sizes, remarks


def _kind(input_: Input) -> str:
    """Return what kind of input one is, with an article."""
    name = type(input_.distribution if isinstance(input_, PBox) else input_).__name__
    if isinstance(input_, RandomField):
        name = f"{input_.distribution} {name}"
    if isinstance(input_, PBox | RandomField) and input_.intervals:
        name += " with intervals as parameters"
    elif isinstance(input_, RandomField) and callable(input_.std):
        name += " whose std is a function"
    return with_article(name)


def _scatter(input_: Input, old: str) -> JsonRecord | None:
    """Return how an input, in Python `old`, is scaled, or None if it cannot be.

    `size` belongs to `of`, for a LogNormal to the logarithm; `least` is a scale; {0} and {1} in
    `python` stand for the `ends` a + b s; `fixed` is for s = 0.
    """
    # Least size of a play and scatter of a field, which cannot be replaced by a number, in parts
    # of those of the study
    min_size = 0.01
    if input_.intervals:
        return None
    ends = []
    min_scale = 0.0
    match input_:
        case Normal():
            of = "std"
            size = float(input_.spread)
            fixed = float(input_.mean)
            python = f"fb.Normal({fixed!r}, {{0}})"
        case LogNormal():
            of, (mean, size) = RELATIVE, map(float, input_.logarithm)
            fixed = float(np.exp(mean))
            python = f"fb.LogNormal.of_logarithm({mean!r}, {{0}})"
        case Uniform():
            of = "half width"
            size = (input_.upper - input_.lower) / 2
            fixed = input_.lower
            fixed = fixed + size
            python = "fb.Uniform({0}, {1})"
            ends = [(fixed, -size), (fixed, size)]
        case FreePair():
            of = input_.size_name
            size = input_.size
            fixed = None
            min_scale = min_size
            python = f"dataclasses.replace({old}, {of}={{0}})"
        case RandomField(distribution="normal", std=float() | int() as std):
            of = "std"
            size = float(std)
            fixed = None
            min_scale = min_size
            python = f"dataclasses.replace({old}, std={{0}})"
        case _:
            return None
    scaling = {"of": of, "size": size, "fixed": fixed, "least": min_scale, "python": python}
    return scaling | {"ends": ends or [(0.0, size)]}
