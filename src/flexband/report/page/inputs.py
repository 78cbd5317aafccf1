"""The table of inputs: what is known of each, in words, and how much it matters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from scipy.special import ndtri

from flexband.report.text.numbers import number, percent
from flexband.report.text.tables import Table, outputs_of, select
from flexband.uncertainty.inputs.choices import Choice, Compensator, Sizing
from flexband.uncertainty.inputs.constants import Constant, is_number
from flexband.uncertainty.inputs.correlated import Correlated
from flexband.uncertainty.inputs.fields.field import Field
from flexband.uncertainty.inputs.fields.random_field import RandomField
from flexband.uncertainty.inputs.inputs import Interval
from flexband.uncertainty.inputs.sampling import of_normals
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.inputs.unfolding import first_case

NODES = 32
"""Of the Gauss rule for the mean and the standard deviation of a distribution."""


def inputs_table(given: Mapping[str, Any], units: Mapping[str, str]) -> Table:
    """Return one row per input: its name, its kind, what is known of it, and its unit if any."""
    header = ["input", "kind", "what is known of it", *["unit"] * bool(units)]
    rows = [[name, *known_of(name, input_)] for name, input_ in given.items()]
    if units:
        rows = [[*row, _unit(row[0], given[row[0]], units)] for row in rows]
    return header, rows


def _unit(name: str, input_: Any, units: Mapping[str, str]) -> str:
    """Return the unit of an input, or those of the members of correlated ones."""
    if isinstance(input_, Correlated):
        return "; ".join(f"{k}: {units[k]}" for k in input_.members if units.get(k))
    return units.get(name, "")


def with_shares(table: Table, contributions: xr.Dataset | None) -> Table:
    """Return the table of inputs with a column that tells how much each matters.

    It is the part of the error bar's width that the input is worth, both as means over time, of the
    outputs that it matters most for.

    Parameters
    ----------
    contributions : result of `contributions`; without it, the table is as it was.
    """
    if contributions is None:
        return table
    header, rows = table
    shares = contributions["mean_share"]
    names = [str(name) for name in shares["name"].values]
    cells = [_matters(shares.isel(name=names.index(r[0]))) if r[0] in names else "" for r in rows]
    return [*header, f"matters{', mean over time' * over_time(contributions)}"], [
        [*row, cell] for row, cell in zip(rows, cells, strict=True)
    ]


def over_time(contributions: xr.Dataset) -> bool:
    """Return whether the shares of inputs are means over time."""
    return contributions["mean_share"].ndim < contributions["contribution"].ndim


def _matters(share: xr.DataArray) -> str:
    """Return the shares of the outputs that the input matters for, the largest first."""
    # Of which a table tells how much an input matters for them
    max_outputs = 3
    shares = {name: float(select(share, name).max()) for name in outputs_of(share)}
    largest = sorted(shares, key=lambda k: -shares[k])[:max_outputs]
    texts = [f"{percent(shares[k])} of {k}" if k else percent(shares[k]) for k in largest]
    return ", ".join(t for t, k in zip(texts, largest, strict=True) if shares[k] > 5e-4) or "0 %"


def known_of(name: str, input_: Any) -> tuple[str, str]:  # noqa: PLR0911
    """Return the kind of an input and what is known of it, in words."""
    if isinstance(input_, Constant) or is_number(input_):
        return "constant", number(getattr(input_, "constant", input_), 6)
    if isinstance(input_, Interval):
        middle, half = (input_.lower + input_.upper) / 2, (input_.upper - input_.lower) / 2
        return "interval", f"{_range(input_)} ({number(middle, 6, half)} ± {number(half)})"
    if isinstance(input_, Sizing):
        return "size", f"free in {_range(input_)}, tolerance ± {number(input_.tolerance, 6)}"
    if isinstance(input_, Compensator):
        return "compensator", f"adjusted in {_range(input_)}"
    if isinstance(input_, Choice):
        return "choice", " or ".join(map(str, input_.options))
    if isinstance(input_, Correlated):
        members = "; ".join(
            f"{k}: {known_of(k, member)[1]}" for k, member in input_.members.items()
        )
        return "correlated", members
    if isinstance(input_, RandomField) and is_number(input_.mean) and is_number(input_.std):
        moments = f"mean {number(input_.mean, 6)}, standard deviation {number(input_.std, 6)}"  # pyright: ignore
        return "random field", f"{moments}, correlation length {input_.correlation_length:g}"
    if isinstance(input_, Field):
        return f"{'random' if input_.random else 'interval'} field", input_.summary
    return _of_distribution(name, input_)


def _range(interval: Any) -> str:
    """Return the ends of an interval."""
    return f"{number(interval.lower, 6)} … {number(interval.upper, 6)}"


def _of_distribution(name: str, distribution: Any) -> tuple[str, str]:
    """Return the kind of a distribution, and its mean, standard deviation and usual range."""
    kind = type(distribution).__name__
    numbers = statistics(name, distribution)
    if numbers is None:
        return kind, repr(distribution)
    low, high, mean, std = numbers
    ends = f"{number(low)} … {number(high)}"
    summary = f"mean {number(mean)}, standard deviation {number(std, 3)}, 90 % in {ends}"
    intervals = [
        f"{k} in [{number(v.lower, 6)}, {number(v.upper, 6)}]"
        for k, v in distribution.intervals.items()
    ]
    return kind, "; ".join([summary, *intervals])


def statistics(name: str, input_: Any) -> tuple[float, float, float, float] | None:
    """Return the 5 % and 95 % quantiles, the mean and the standard deviation of a random number.

    None of what is not one random number. Parameters that are intervals are at their midpoints.
    """
    space = Space(first_case({name or "input": input_}))
    if space.random_dimension != 1:
        return None

    def at(xi: np.ndarray) -> np.ndarray:
        eta = np.zeros((len(xi), space.interval_dimension))
        return np.asarray(space.values(xi, eta)[name or "input"])

    low, high = sorted(at(of_normals(ndtri([[0.05], [0.95]]), space.families)).tolist())
    nodes, weights = space.families[0].gauss(NODES)
    values = at(nodes[:, None])
    mean = float(weights @ values)
    return low, high, mean, float(np.sqrt(weights @ (values - mean) ** 2))
