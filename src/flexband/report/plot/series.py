"""One output as x and values, and how axes name them."""

from __future__ import annotations

import textwrap
from typing import Any

import numpy as np
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.typing import ColorType

from flexband.basics.checks import check_instance
from flexband.basics.rounding import unit_of_variable
from flexband.basics.words import value_text
from flexband.errors import InputError
from flexband.report.text.band_tables import deviations, outputs_of, select

SYMBOLS = {"time": "$t$"}
"""Of dimensions."""

TITLE = 68
"""Letters of a line of a title."""


def variable_of(name: str, result: Any, variable: str, of: str) -> xr.DataArray:
    """Return a variable of a dataset; raise `InputError` if it is no result of `of`."""
    if not isinstance(result, xr.Dataset) or variable not in result:
        raise InputError(f"{name} must be a result of {of}; got {value_text(result)}")
    return result[variable]


def with_bounds(name: str, result: Any, variable: str, of: str = "an analysis") -> xr.DataArray:
    """Return a variable of a result with a lower and an upper bound, along the first dim."""
    check_instance("variable", variable, str, "the name of a variable")
    data = variable_of(name, result, variable, of)
    if data.sizes.get("bound") != 2:
        having = [str(k) for k, array in result.items() if array.sizes.get("bound") == 2]
        raise InputError(f"variable must be one of {', '.join(having)}; got {variable!r}")
    return data.transpose("bound", ...)


def deviation(bands: Any) -> str:
    """Return the error bar's multiple of σ as a formula."""
    return rf"{deviations(bands)[:-1]}\sigma" if isinstance(bands, xr.Dataset) else ""


def output_of(data: xr.DataArray, output: str | None) -> str:
    """Return the name of one output, which may be left out if there is only one."""
    names = outputs_of(data)
    if output is None and len(names) == 1:
        return names[0]
    if not isinstance(output, str) or output not in names:
        allowed = ", ".join(map(repr, names))
        raise InputError(f"output must be one of {allowed}; got {value_text(output)}")
    return output


def label(axes: Axes, data: xr.DataArray, output: str, quantity: str = "{}") -> None:
    """Name the axes after an output, {} in the quantity that is drawn, and what it depends on."""
    output_data = select(data, output)
    last = str(output_data.dims[-1]) if output_data.dims else "bound"
    unit = unit_of_variable(output_data)
    if "unit" in output_data.coords:
        unit = str(output_data["unit"].values)
    quantity_name = quantity.format(literal(output)) if output else quantity.removesuffix(" of {}")
    axes.set(ylabel=with_unit(quantity_name.replace("{}", ""), unit))
    if last == "bound":
        axes.set(xticks=[])
    else:
        axes.set(
            xlabel=with_unit(SYMBOLS.get(last, literal(last)), unit_of_variable(output_data[last]))
        )
        axes.margins(x=0)


def fill(
    axes: Axes, x: np.ndarray, bounds: np.ndarray, color: ColorType, edge: ColorType, name: str = ""
) -> None:
    """Fill between a lower and an upper bound; a single pair is a bar, `name` its legend."""
    lower, upper = bounds
    if len(x) == 1:
        axes.bar(x, upper - lower, 0.4, lower, color=color, edgecolor=edge, label=name)
        axes.set(xlim=(x[0] - 1, x[0] + 1))
    else:  # with an edge, since bounds may be equal
        axes.fill_between(x, lower, upper, fc=color, ec=edge, linewidth=0.5, label=name)


def literal(text: str) -> str:
    """Return a text in which Matplotlib finds no formula."""
    return text.replace("$", r"\$")


def with_unit(name: str, unit: Any) -> str:
    return f"{name} [{literal(str(unit))}]".strip() if unit else name


def legend_above(axes: Axes) -> None:
    """Put the legend above the axes, where it hides nothing, before `title_above` is called."""
    names = [str(text) for text in axes.get_legend_handles_labels()[1]]
    long = 28  # letters of a name that has a row of its own
    columns = 1 if any(len(name) > long and "$" not in name for name in names) else 2
    place = {"loc": "lower right", "bbox_to_anchor": (1, 1), "borderaxespad": 0.2}
    axes.legend(**place, ncols=columns, handlelength=1.5, columnspacing=1.2, fontsize="small")


def title_above(axes: Axes, text: str) -> None:
    """Write a title, in lines as wide as a figure of a report, above the axes and their legend."""
    legend = axes.get_legend()
    rows = 0
    if legend is not None:
        count = len(legend.get_texts())
        columns = getattr(legend, "_ncols", 1)
        rows = -(-count // columns) + sum(
            entry.get_text().count("\n") for entry in legend.get_texts()
        )
    axes.set_title(
        textwrap.fill(text, TITLE), fontsize=10.0, pad=6.0 + (5.0 + 12.5 * rows) * (rows > 0)
    )
