"""The table of inputs: what is known of each, in words, and how much it matters."""

from __future__ import annotations

from collections.abc import Mapping
from functools import singledispatch
from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from scipy.special import ndtri

from flexband.report.text.band_tables import Table, outputs_of, select
from flexband.report.text.numbers import number, percent
from flexband.study.presentation.display import Display
from flexband.uncertainty.inputs.choices import Choice, Compensator, Sizing
from flexband.uncertainty.inputs.constants import Constant, is_number
from flexband.uncertainty.inputs.correlated import Correlated
from flexband.uncertainty.inputs.distributions.random_option import RandomOption
from flexband.uncertainty.inputs.fields.field import Field
from flexband.uncertainty.inputs.fields.random_field import RandomField
from flexband.uncertainty.inputs.inputs import Input, Interval
from flexband.uncertainty.inputs.sampling import of_normals
from flexband.uncertainty.inputs.space import Space


def inputs_table(inputs: Mapping[str, Any], display: Display) -> Table:
    """Return one row per input: its name, its kind, what is known of it, and its unit if any."""
    units = display.input_units()
    header = ["input", "kind", "what is known of it", *["unit"] * bool(units)]
    rows = [[name, *_known_in(display, name, input_)] for name, input_ in inputs.items()]
    if units:
        rows = [[*row, _unit(row[0], inputs[row[0]], units)] for row in rows]
    return header, rows


def _known_in(display: Display, name: str, input_: Any) -> tuple[str, str]:
    """Return the kind of an input and what is known of it, in its display unit."""
    if isinstance(input_, Correlated):
        members = input_.members.items()
        texts = (f"{k}: {known_of(member, display.scale(k))[1]}" for k, member in members)
        return "correlated", "; ".join(texts)
    return known_of(input_, display.scale(name))


def _unit(name: str, input_: Any, units: Mapping[str, str]) -> str:
    """Return the unit of an input, or those of the members of correlated ones."""
    if isinstance(input_, Correlated):
        return "; ".join(f"{k}: {units[k]}" for k in input_.members if units.get(k))
    return units.get(name, "")


def with_shares(table: Table, contributions: xr.Dataset | None) -> Table:
    """Return the table of inputs with the part of the error bar that each is worth.

    It is that of the outputs that it matters most for, mean over time. Without contributions, the
    table is as it was.
    """
    if contributions is None:
        return table
    header, rows = table
    shares = contributions["mean_share"]
    names = [str(name) for name in shares["name"].values]
    cells = [_matters(shares.isel(name=names.index(r[0]))) if r[0] in names else "" for r in rows]
    return [*header, f"matters{mean_share_text(contributions)}"], [
        [*row, cell] for row, cell in zip(rows, cells, strict=True)
    ]


def mean_share_text(contributions: xr.Dataset) -> str:
    """Return over what the shares of inputs are means, in words after a comma; "" if over none."""
    mean = contributions["mean_share"].dims
    all_dims = contributions["contribution"].dims
    return f", mean over {all_dims[-1]}" if len(mean) < len(all_dims) else ""


def _matters(share: xr.DataArray) -> str:
    """Return the shares of the outputs that the input matters for, the largest first."""
    max_outputs = 3  # of which a table tells how much an input matters for them
    shares = {name: float(select(share, name).max()) for name in outputs_of(share)}
    largest = sorted(shares, key=lambda k: -shares[k])[:max_outputs]
    texts = [f"{percent(shares[k])} of {k}" if k else percent(shares[k]) for k in largest]
    return ", ".join(t for t, k in zip(texts, largest, strict=True) if shares[k] > 5e-4) or "0 %"


@singledispatch
def known_of(input_: Any, scale: float) -> tuple[str, str]:
    """Return the kind of an input and what is known of it, in words; numbers times a scale."""
    if is_number(input_):
        return "constant", number(input_ * scale, 6)
    return _of_distribution(input_, scale)


@known_of.register
def _(constant: Constant, scale: float) -> tuple[str, str]:
    return "constant", number(float(constant.constant) * scale, 6)


@known_of.register
def _(option: str, _scale: float) -> tuple[str, str]:
    return "option", option


@known_of.register
def _(interval: Interval, scale: float) -> tuple[str, str]:
    lower = interval.lower * scale
    upper = interval.upper * scale
    middle = (lower + upper) / 2
    half = (upper - lower) / 2
    return "interval", f"{_range(interval, scale)} ({number(middle, 6, half)} ± {number(half)})"


@known_of.register
def _(sizing: Sizing, scale: float) -> tuple[str, str]:
    tolerance = number(sizing.tolerance * scale, 6)
    return "size", f"free in {_range(sizing, scale)}, tolerance ± {tolerance}"


@known_of.register
def _(compensator: Compensator, scale: float) -> tuple[str, str]:
    return "compensator", f"adjusted in {_range(compensator, scale)}"


@known_of.register
def _(choice: Choice, scale: float) -> tuple[str, str]:
    options = [
        number(float(o) * scale, 6) if scale != 1 and is_number(o) else o for o in choice.options
    ]
    if choice.probabilities is None:
        return "choice", " or ".join(map(str, options))
    likely = zip(options, choice.probabilities, strict=True)
    return "choice", ", ".join(f"{option} ({percent(p)})" for option, p in likely)


@known_of.register
def _(option: RandomOption, scale: float) -> tuple[str, str]:
    return known_of(option.choice, scale)


@known_of.register
def _(field: Field, _scale: float) -> tuple[str, str]:
    return f"{'random' if field.random else 'interval'} field", field.summary


@known_of.register
def _(field: RandomField, scale: float) -> tuple[str, str]:
    if not (is_number(field.mean) and is_number(field.std)):
        return "random field", field.summary
    mean, std = (number(moment * scale, 6) for moment in (field.mean, field.std))
    moments = f"mean {mean}, standard deviation {std}"
    return "random field", f"{moments}, correlation length {field.correlation_length:g}"


def _range(interval: Interval | Sizing | Compensator, scale: float) -> str:
    return f"{number(interval.lower * scale, 6)} … {number(interval.upper * scale, 6)}"


def _of_distribution(distribution: Input, scale: float) -> tuple[str, str]:
    """Return the kind of a distribution, and its mean, standard deviation and usual range."""
    kind = type(distribution).__name__
    numbers = statistics(distribution)
    if numbers is None:
        return kind, repr(distribution) + (" before conversion" if scale != 1 else "")
    low, high, mean, std = (value * scale for value in numbers)
    ends = f"{number(low)} … {number(high)}"
    summary = f"mean {number(mean)}, standard deviation {number(std, 3)}, 90 % in {ends}"
    in_units = "mean", "std", "lower", "mode", "upper"  # other parameters are numbers
    intervals = [
        f"{k} in [{number(v.lower * s, 6)}, {number(v.upper * s, 6)}]"
        for k, v in distribution.intervals.items()
        for s in [scale if k in in_units else 1.0]
    ]
    return kind, "; ".join([summary, *intervals])


class Statistics(NamedTuple):
    """A random number in four."""

    low: float  # 5 % quantile
    high: float  # 95 % quantile
    mean: float
    std: float


def statistics(input_: Input) -> Statistics | None:
    """Return the statistics of a random number; None of anything else."""
    space = Space({"input": input_})
    if space.random_dimension != 1 or not space.inputs["input"].numeric:
        return None

    def at(xi: np.ndarray) -> np.ndarray:
        eta = np.zeros((len(xi), space.interval_dimension))
        return np.asarray(space.values(xi, eta)["input"])

    low, high = sorted(at(of_normals(ndtri([[0.05], [0.95]]), space.families)).tolist())
    nodes, weights = space.families[0].gauss(32)
    values = at(nodes[:, None])
    mean = float(weights @ values)
    return Statistics(low, high, mean, float(np.sqrt(weights @ (values - mean) ** 2)))
