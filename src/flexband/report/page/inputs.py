"""The table of inputs: what is known of each, in words, and how much it matters."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr
from scipy.special import ndtri

from flexband.report.numbers import number, percent
from flexband.report.tables import Table, outputs_of, select
from flexband.uncertainty.inputs.choices import Choice, Compensator, Sizing, first_case
from flexband.uncertainty.inputs.constants import Constant, is_number
from flexband.uncertainty.inputs.correlated import Correlated
from flexband.uncertainty.inputs.fields.field import Field
from flexband.uncertainty.inputs.fields.random_field import RandomField
from flexband.uncertainty.inputs.inputs import Interval
from flexband.uncertainty.inputs.sampling import of_normals
from flexband.uncertainty.inputs.space import Space

MOST_OUTPUTS = 3
"""Of which a table tells how much an input matters for them."""

NODES = 32
"""Of the Gauss rule for the mean and the standard deviation of a distribution."""


def inputs_table(given: Mapping[str, Any], units: Mapping[str, str]) -> Table:
    """Return one row per input: its name, its kind, what is known of it, and its unit if any."""
    header = ["input", "kind", "what is known of it", *["unit"] * bool(units)]
    rows = [[name, *known_of(name, one)] for name, one in given.items()]
    if units:
        rows = [[*row, _unit(row[0], given[row[0]], units)] for row in rows]
    return header, rows


def _unit(name: str, one: Any, units: Mapping[str, str]) -> str:
    """Return the unit of an input, or those of the members of correlated ones."""
    if isinstance(one, Correlated):
        return "; ".join(f"{k}: {units[k]}" for k in one.members if units.get(k))
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
    own = contributions["mean_share"]
    names = [str(name) for name in own["name"].values]
    told = [_matters(own.isel(name=names.index(r[0]))) if r[0] in names else "" for r in rows]
    return [*header, f"matters{', mean over time' * over_time(contributions)}"], [
        [*row, one] for row, one in zip(rows, told, strict=True)
    ]


def over_time(contributions: xr.Dataset) -> bool:
    """Return whether the shares of inputs are means over time."""
    return contributions["mean_share"].ndim < contributions["contribution"].ndim


def _matters(share: xr.DataArray) -> str:
    """Return the shares of the outputs that the input matters for, the largest first."""
    shares = {name: float(select(share, name).max()) for name in outputs_of(share)}
    largest = sorted(shares, key=lambda k: -shares[k])[:MOST_OUTPUTS]
    told = [f"{percent(shares[k])} of {k}" if k else percent(shares[k]) for k in largest]
    return ", ".join(t for t, k in zip(told, largest, strict=True) if shares[k] > 5e-4) or "0 %"


def known_of(name: str, one: Any) -> tuple[str, str]:  # noqa: PLR0911
    """Return the kind of an input and what is known of it, in words."""
    if isinstance(one, Constant) or is_number(one):
        return "constant", number(getattr(one, "constant", one), 6)
    if isinstance(one, Interval):
        middle, half = (one.lower + one.upper) / 2, (one.upper - one.lower) / 2
        return "interval", f"{_range(one)} ({number(middle, 6, half)} ± {number(half)})"
    if isinstance(one, Sizing):
        return "size", f"free in {_range(one)}, tolerance ± {number(one.tolerance, 6)}"
    if isinstance(one, Compensator):
        return "compensator", f"adjusted in {_range(one)}"
    if isinstance(one, Choice):
        return "choice", " or ".join(map(str, one.options))
    if isinstance(one, Correlated):
        members = "; ".join(f"{k}: {known_of(k, own)[1]}" for k, own in one.members.items())
        return "correlated", members
    if isinstance(one, RandomField) and is_number(one.mean) and is_number(one.std):
        told = f"mean {number(one.mean, 6)}, standard deviation {number(one.std, 6)}"  # pyright: ignore
        return "random field", f"{told}, correlation length {one.correlation_length:g}"
    if isinstance(one, Field):
        return f"{'random' if one.random else 'interval'} field", one.summary
    return _of_distribution(name, one)


def _range(one: Any) -> str:
    """Return the ends of an interval."""
    return f"{number(one.lower, 6)} … {number(one.upper, 6)}"


def _of_distribution(name: str, one: Any) -> tuple[str, str]:
    """Return the kind of a distribution, and its mean, standard deviation and usual range."""
    kind = type(one).__name__
    found = statistics(name, one)
    if found is None:
        return kind, repr(one)
    low, high, mean, std = found
    ends = f"{number(low)} … {number(high)}"
    told = f"mean {number(mean)}, standard deviation {number(std, 3)}, 90 % in {ends}"
    intervals = [
        f"{k} in [{number(v.lower, 6)}, {number(v.upper, 6)}]" for k, v in one.intervals.items()
    ]
    return kind, "; ".join([told, *intervals])


def statistics(name: str, one: Any) -> tuple[float, float, float, float] | None:
    """Return the 5 % and 95 % quantiles, the mean and the standard deviation of a random number.

    None of what is not one random number. Parameters that are intervals are at their midpoints.
    """
    space = Space(first_case({name or "input": one}))
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
