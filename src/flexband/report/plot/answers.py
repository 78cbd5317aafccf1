"""Answers over time: what widens the error bar, and probabilities; tolerances as bars."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from flexband.basics.checks import check_option
from flexband.errors import InputError
from flexband.report.plot.margins import each_limit
from flexband.report.plot.series import label, legend_above, literal, output_of, variable_of
from flexband.report.plot.style import LINES, MIDDLE, axes_of, shades
from flexband.report.text.drawable import series

LEAST = 1e-9
"""Probabilities below this are drawn next to zero."""


def contributions(
    found: xr.Dataset,
    output: str | None = None,
    *,
    variable: str = "contribution",
    ax: Axes | None = None,
) -> Axes:
    """Draw what each input contributes to the width of the error bar, above each other.

    Where they add up to less than the width, inputs act together; what is negative is not drawn.

    Parameters
    ----------
    found : result of `contributions`.
    output : name of the output; it may be left out if there is only one.
    variable : "contribution" or "shapley", which adds up to the width.
    ax : axes to draw on, those of a new figure by default.

    Raises
    ------
    InputError
        If `found` is no result of `contributions`, has no such output or variable, or does not
        depend on time.
    """
    check_option("variable", variable, ("contribution", "shapley"))
    of = "contributions" if variable == "contribution" else "contributions with shapley=True"
    shares = variable_of("found", found, variable, of).transpose("name", ...)
    width = variable_of("found", found, "width", "contributions")
    output = output_of(width, output)
    x, total = series(width, output)
    stacked = [np.maximum(series(contribution, output)[1], 0.0) for contribution in shares]
    names = [literal(str(name)) for name in shares["name"].values]
    ax = axes_of(ax)
    if len(x) == 1:
        raise InputError("found must depend on time, or on another variable")
    ax.stackplot(
        x, stacked, labels=names, colors=shades(len(names)), edgecolor="white", linewidth=0.4
    )
    ax.plot(x, total, **LINES[0], label="width of the error bar")
    label(ax, width, output, "width of {}")
    legend_above(ax)
    return ax


def probability(found: xr.Dataset, *, ax: Axes | None = None) -> Axes:
    """Draw the largest probability of being outside each limit, at each time.

    Parameters
    ----------
    found : result of `failure_probability`.
    ax : axes to draw on, those of a new figure by default.

    Returns
    -------
    The axes: logarithmic from the power of ten below the least probability above zero, or from
    `LEAST`, up to one, and linear from there down to zero.

    Raises
    ------
    InputError
        If `found` is no result of `failure_probability`.
    """
    probabilities = variable_of("found", found, "at_each_time", "failure_probability")
    if "bound" not in probabilities.dims:
        raise InputError("found must be a result of failure_probability; got one of allocate")
    probabilities = probabilities.sel(bound="upper").transpose("limit", ...)
    others = list(probabilities.dims[1:-1])
    largest = probabilities.max(others) if others else probabilities
    positive = largest.values[largest.values > 0]
    smallest_positive = max(LEAST, float(positive.min())) if positive.size else LEAST
    ax = axes_of(ax)
    each_limit(ax, largest, largest.values)
    ax.set_yscale(
        "symlog", linthresh=10 ** np.floor(np.log10(min(smallest_positive, 0.1))), linscale=0.4
    )
    ax.set(ylim=(0, 1), ylabel="probability of being outside")
    for line in ax.lines:
        line.set_clip_on(False)  # lines at 0 and 1 are as thick as others
    return ax


def tolerances(found: xr.Dataset, *, ax: Axes | None = None) -> Axes:
    """Draw tolerances as parts of the largest ones, with their values beside.

    Parameters
    ----------
    found : result of `allocate`.
    ax : axes to draw on, those of a new figure by default.

    Raises
    ------
    InputError
        If `found` is no result of `allocate`.
    """
    tolerance = variable_of("found", found, "tolerance", "allocate")
    part = (tolerance / variable_of("found", found, "largest", "allocate")).values
    ax = axes_of(ax)
    drawn = ax.barh([literal(str(name)) for name in tolerance["name"].values], part, color=MIDDLE)
    ax.bar_label(drawn, [f"{value:.3g}" for value in tolerance.values], padding=3)
    ax.invert_yaxis()
    ax.set(xlim=(0, 1.2), xlabel="tolerance / largest tolerance")
    return ax
