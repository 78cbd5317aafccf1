"""Several methods: their bounds, and their errors against runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import cycle
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.ticker import FormatStrFormatter, LogLocator

from flexband.basics.checks import check_option
from flexband.basics.words import value_text
from flexband.errors import InputError
from flexband.report.plot.series import label, literal, output_of, with_bounds
from flexband.report.plot.style import LINES, axes_of
from flexband.report.text.band_tables import select
from flexband.report.text.drawable import series
from flexband.study.comparison import Comparison

NAMES = {"mean": "interval mean", "error_bar": "interval error bar"}


def comparison(
    results: Mapping[str, xr.Dataset],
    output: str | None = None,
    *,
    variable: str = "error_bar",
    ax: Axes | None = None,
) -> Axes:
    """Draw the bounds of one output that several methods or studies found.

    Parameters
    ----------
    results : name in the legend -> result of `propagate`.
    output : name of the output; it may be left out if there is only one.
    variable : "error_bar" or "mean".
    ax : axes to draw on, those of a new figure by default.

    Raises
    ------
    InputError
        If `results` has none or others than results of `propagate`, or no such output.
    """
    if not isinstance(results, Mapping) or not results:
        raise InputError(
            f"results must map names to results of propagate; got {value_text(results)}"
        )
    all_bounds = {
        str(k): with_bounds(f"results[{k!r}]", bands, variable, "propagate")
        for k, bands in results.items()
    }
    drawn = {k: series(bounds, output_of(bounds, output)) for k, bounds in all_bounds.items()}
    first = next(iter(all_bounds.values()))
    ax = axes_of(ax)
    for (name, (x, values)), look in zip(drawn.items(), cycle(LINES), strict=False):
        for bound, text in zip(values, (literal(name), None), strict=True):
            ax.plot(x, bound, **look, label=text, marker=("." if len(x) == 1 else ""))
    label(ax, first, output_of(first, output), NAMES.get(variable, "") + " of {}")
    ax.legend()
    return ax


def errors(
    results: Sequence[Comparison],
    output: str | None = None,
    *,
    variable: str = "error_bar",
    ax: Axes | None = None,
) -> Axes:
    """Draw relative errors of one output against runs, one line per class of methods.

    Errors that are exactly zero are left out, since the axes are logarithmic.

    Parameters
    ----------
    results : of `compare`.
    output : name of the output; it may be left out if there is only one.
    variable : "error_bar" or "mean".
    ax : axes to draw on, those of a new figure by default.

    Raises
    ------
    InputError
        If `results` are not those of `compare`, or have no such output or variable.
    """
    markers = "osD^v<>"
    if not isinstance(results, list | tuple) or not all(isinstance(r, Comparison) for r in results):
        raise InputError(f"results must be those of compare; got {value_text(results)}")
    compared: list[Any] = [result for result in results if result.errors]
    check_option("variable", variable, NAMES)
    if not compared:
        raise InputError("results must have a method besides the reference")
    output = output_of(compared[0].bands["mean"], output)
    ax = axes_of(ax)
    # Numbers of runs that are written at the axis.
    labelled = []
    for count in sorted({result.runs for result in compared}):
        if not labelled or count > 1.25 * labelled[-1]:  # labels must not overlap
            labelled.append(count)
    # A line for each class of methods.
    names = dict.fromkeys(result.method.name for result in compared)
    looks = zip(names, cycle(LINES[1:] + LINES[:1]), cycle(markers), strict=False)
    for name, look, marker in looks:
        group = [result for result in compared if result.method.name == name]
        error = np.array([float(select(result.errors[variable], output)) for result in group])
        error[error == 0.0] = np.nan
        ax.loglog([result.runs for result in group], 100 * error, label=name, marker=marker, **look)
    of = f" of {literal(output)}" if output else ""
    ax.set(xlabel="runs", ylabel="relative error [%]", title=f"{NAMES[variable]}{of}")
    ax.set_xticks(labelled, [str(count) for count in labelled])
    ax.minorticks_off()
    ax.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    ax.yaxis.set_major_formatter(FormatStrFormatter("%g"))
    ax.grid(alpha=0.3)
    ax.legend()
    return ax
