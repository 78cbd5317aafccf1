"""One look of all figures: colours that are told apart without colour vision, and in grey."""

from __future__ import annotations

from contextlib import AbstractContextManager
from typing import Any

import numpy as np
from matplotlib import colormaps, rc_context
from matplotlib.axes import Axes

from flexband.basics.checks import check_instance, check_integer, check_positive

LIGHT = "#d3e4f3"
MIDDLE = "#5b9bd0"
DARK = "#10416f"
"""Of the error bar, the mean, and its edges: their lightness falls in this order."""

LINES: list[dict[str, Any]] = [
    {"color": "0.1", "linewidth": 0.9},
    {"color": "#d55e00", "linewidth": 0.9, "linestyle": "--"},
    {"color": "#0072b2", "linewidth": 0.9, "linestyle": "-."},
    {"color": "#e69f00", "linewidth": 0.9, "linestyle": ":"},
    {"color": "#009e73", "linewidth": 0.9, "linestyle": (0, (5, 1, 1, 1, 1, 1))},
    {"color": "#cc79a7", "linewidth": 0.9, "linestyle": (0, (7, 2))},
    {"color": "#56b4e9", "linewidth": 0.9, "linestyle": (0, (3, 1, 1, 1))},
]
"""Of several series (Okabe and Ito, 2008), each with its own dashes."""


def style(columns: int = 1, *, height: float | None = None) -> AbstractContextManager[None]:
    """Return a context in which Matplotlib's figures have a size and letters for print.

    Parameters
    ----------
    columns : 1 for a figure as wide as a column of a journal's page, 3.4 in; 2 for 7 in.
    height : of the figure [in]; 0.62 times 3.4 in by default.

    Raises
    ------
    InputError
        If there are neither one nor two columns, or the height is not positive.
    """
    for_print: dict[Any, Any] = {
        "font.family": "STIXGeneral",
        "mathtext.fontset": "stix",
        "font.size": 8.0,
        "axes.titlesize": 8.0,
        "axes.formatter.limits": (-3, 4),
        "axes.formatter.use_mathtext": True,
        "axes.linewidth": 0.6,
        "xtick.major.width": 0.6,
        "ytick.major.width": 0.6,
        "xtick.direction": "in",
        "ytick.direction": "in",
        "lines.linewidth": 0.9,
        "lines.markersize": 3.0,
        "legend.fontsize": 7.0,
        "legend.frameon": False,
        "hatch.linewidth": 0.4,
        "figure.constrained_layout.use": True,
        "figure.dpi": 150.0,
        "savefig.dpi": 300.0,
        "pdf.fonttype": 42,  # letters stay letters
    }
    # Of a figure of so many columns of a journal's page [in]
    widths = {1: 3.4, 2: 7.0}
    check_integer("columns", columns, 1, 2)
    tall = 0.62 * widths[1] if height is None else float(check_positive("height", height, rank=0))
    return rc_context({**for_print, "figure.figsize": (widths[columns], tall)})


def axes_of(ax: Axes | None) -> Axes:
    """Return the axes to draw on, those of a new figure if there are none."""
    if ax is None:
        from matplotlib import pyplot  # noqa: PLC0415 (takes a second, and chooses a window system)

        return pyplot.figure(layout="constrained").add_subplot()
    check_instance("ax", ax, Axes, "axes of Matplotlib")
    return ax


def shades(count: int) -> list[Any]:
    """Return colours whose lightness rises evenly."""
    return list(colormaps["cividis"](np.linspace(0.15, 0.9, count)))
