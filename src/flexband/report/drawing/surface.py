"""What mechanisms are drawn on: surfaces of Matplotlib or SVG that take the same shapes."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from flexband.report.shapes.shapes import Line, Mark

COLORS = {
    "": "none", "ink": "#262626", "paper": "#ffffff", "hole": "#ffffff", "pale": "#e6e6e6",
    "muted": "#999999", "flexible": "#1f78b4", "filled": "#c6dbef", "load": "#d95f02",
    "drive": "#1b7837", "length": "#666666", "realization": "#5b9bd0",
}  # fmt: skip
"""Colours by their names in shapes."""


class Lettering(NamedTuple):
    """How a text is written, centred at its place."""

    color: str = "ink"  # name of a colour
    italic: bool = False
    size: float = 9.0
    """Of the letters [pt]."""
    angle: float = 0.0
    """Of the line [degrees]."""
    backed: bool = False  # whether what is behind the text is hidden
    layer: float = 10.0


class Surface(Protocol):
    """Where shapes are drawn: places are in metres, sizes in points."""

    def line(self, points: np.ndarray, style: Line) -> None:
        """Draw a line through points; NaN interrupts the line."""

    def area(self, points: np.ndarray, style: Line) -> None:
        """Fill a polygon."""

    def marks(self, points: np.ndarray, mark: Mark) -> None:
        """Draw a marker at each point."""

    def text(self, place: np.ndarray, text: str, lettering: Lettering) -> None:
        """Write a text."""

    def note(self, text: str) -> None:
        """Write a text into the lower left corner."""

    def extent(self, text: str, lettering: Lettering) -> np.ndarray:
        """Return the width and the height of a text [pt]."""
        ...
