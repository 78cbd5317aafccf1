"""Pictures in SVG: axes with numbers along their edges, which are a surface for shapes."""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Sequence
from dataclasses import dataclass, field
from html import escape
from unicodedata import east_asian_width

import numpy as np

from flexband.report.drawing.canvas import COLORS, Lettering
from flexband.report.shapes.shapes import Line, Mark

Attributes = dict[str, str | float]


@dataclass(frozen=True)
class SvgAxes:
    """Axes of a picture, a `Surface`: places are in their units, sizes in points."""

    box: np.ndarray  # their lower left and their upper right corner, shape (2, 2)
    size: np.ndarray  # width and height [pt]
    names: tuple[str, str]  # of the horizontal and the vertical axis
    # what has been drawn so far, each with its layer
    elements: list[tuple[float, str]] = field(default_factory=list)

    def line(self, points: np.ndarray, style: Line) -> None:
        self._add(style.layer, "path", {"d": self._path(points), "fill": "none"} | _pen(style))

    def area(self, points: np.ndarray, style: Line) -> None:
        look = _pen(style) | {"fill": COLORS[style.fill], "opacity": style.alpha}
        self._add(style.layer, "path", {"d": f"{self._path(points)}Z"} | look)

    def marks(self, points: np.ndarray, mark: Mark) -> None:
        half = mark.size / 2
        look: Attributes = {"fill": COLORS[mark.fill], "stroke": COLORS[mark.color]}
        look |= {"stroke-width": mark.width}
        for x, y in self._in_points(points).tolist():
            if mark.marker == "disc":
                self._add(mark.layer, "circle", {"cx": x, "cy": y, "r": half} | look)
            elif mark.marker == "f":
                lettering = Lettering(mark.color, italic=True, size=mark.size, layer=mark.layer)
                self._write(x, y, "f", lettering)
            else:
                rotation = f"rotate({45 * (mark.marker == 'diamond')} {x} {y})"
                square = _box(x - half, y - half, mark.size, mark.size)
                self._add(mark.layer, "rect", square | {"transform": rotation} | look)

    def text(self, place: np.ndarray, text: str, lettering: Lettering) -> None:
        x, y = self._in_points(place).tolist()
        self._write(x, y, text, lettering)

    def note(self, text: str) -> None:
        self._write(4.0, self.size[1] - 8.0, text, Lettering(), anchor="start")

    def above(self, text: str, height: float, *, is_key: bool = False) -> None:
        """Write a text above the axes: in the middle, or as the key of dark lines at the right."""
        lettering = Lettering(size=8.5 if is_key else 10.0)
        if not is_key:
            return self._write(self.size[0] / 2, -height, text, lettering)
        start = self.size[0] - self.extent(text, lettering)[0]
        self._write(self.size[0], -height, text, lettering, anchor="end")
        path = f"M{start - 24:.2f} {-height}h18"
        self._add(10.0, "path", {"d": path} | _pen(Line(width=0.9)))

    def extent(self, text: str, lettering: Lettering) -> np.ndarray:
        """Return about the width and the height of a text [pt]: browsers differ in their fonts."""
        ems = sum(1.0 if east_asian_width(letter) in "WF" else 0.58 for letter in text)
        return lettering.size * np.array([ems, 1.0])

    def picture(self, x: float, y: float) -> str:
        """Return all that was drawn, in layers; the frame's upper left corner is (x, y) [pt]."""
        self._frame()
        drawn = "\n".join(text for _, text in sorted(self.elements, key=lambda drawn: drawn[0]))
        return f'<g transform="translate({x:.2f} {y:.2f})">\n{drawn}\n</g>'

    def _frame(self) -> None:
        """Draw the edges, with numbers and names along the lower and the left one."""
        (width, height), (low, high) = self.size, self.box
        look = _pen(Line(color="muted", width=0.8))
        self._add(2.6, "rect", _box(0.0, 0.0, width, height) | {"fill": "none"} | look)
        across, up = (
            ticks(a, b, max(2, int(size / space)))
            for a, b, size, space in zip(low, high, self.size, (60.0, 26.0), strict=True)
        )
        numbers = Lettering(size=8.0)
        columns = self._in_points(np.column_stack([across, 0.0 * across]))[:, 0].tolist()
        rows = self._in_points(np.column_stack([0.0 * up, up]))[:, 1].tolist()
        for x, text in zip(columns, tick_labels(across), strict=True):
            self._add(2.6, "path", {"d": f"M{x} {height:.2f}v3.5"} | look)
            self._write(x, height + 11.0, text, numbers)
        for y, text in zip(rows, tick_labels(up), strict=True):
            self._add(2.6, "path", {"d": f"M0 {y}h-3.5"} | look)
            self._write(-6.0, y, text, numbers, anchor="end")
        names = Lettering(size=10.0)
        self._write(width / 2, height + 26.0, self.names[0], names)
        self._write(-48.0, height / 2, self.names[1], names._replace(angle=90.0))

    def _in_points(self, places: np.ndarray) -> np.ndarray:
        """Return places as points (1/72 inch) to the right and below the upper left corner."""
        shares = (places - self.box[0]) / (self.box[1] - self.box[0])
        return np.round(([0.0, 1.0] + shares * [1.0, -1.0]) * self.size, 2)

    def _path(self, points: np.ndarray) -> str:
        pieces = np.split(points, np.flatnonzero(np.isnan(points[:, 0])))
        runs = (self._in_points(piece[~np.isnan(piece[:, 0])]) for piece in pieces)
        return "".join("M" + " ".join(f"{x:g} {y:g}" for x, y in run) for run in runs if len(run))

    def _write(
        self, x: float, y: float, text: str, lettering: Lettering, *, anchor: str = "middle"
    ) -> None:
        place = f"translate({x:.2f} {y:.2f}) rotate({-lettering.angle:.2f})"
        if lettering.backed:
            width, height = self.extent(text, lettering) + 2.0
            behind = _box(-width / 2, -height / 2, width, height)
            look = {"fill": COLORS["paper"], "transform": place}
            self._add(lettering.layer, "rect", behind | look)
        look = {
            "transform": place,
            "y": 0.35 * lettering.size,
            "font-size": lettering.size,
            "fill": COLORS[lettering.color],
            "text-anchor": anchor,
            "font-style": "italic" if lettering.italic else "normal",
        }
        self._add(lettering.layer, "text", look, text)

    def _add(self, layer: float, name: str, attributes: Attributes, text: str = "") -> None:
        pairs = (f'{k}="{v}"' for k, v in attributes.items())
        self.elements.append((layer, f"<{name} {' '.join(pairs)}>{escape(text)}</{name}>"))


def svg_address(width: float, height: float, parts: Sequence[str]) -> str:
    """Return a picture of a size [pt], made of `SvgAxes.picture`, as an image's address."""
    size = f'width="{width:.2f}pt" height="{height:.2f}pt" viewBox="0 0 {width:.2f} {height:.2f}"'
    fonts = "system-ui, -apple-system, Segoe UI, Roboto, sans-serif"
    start = f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="{fonts}">'
    paper = '<rect width="100%" height="100%" fill="#ffffff"/>'
    text = "\n".join([start, paper, *parts, "</svg>"])
    return f"data:image/svg+xml;base64,{b64encode(text.encode()).decode()}"


def ticks(low: float, high: float, count: int) -> np.ndarray:
    """Return about `count` round numbers from `low` to `high`, multiples of their distance."""
    min_step = (high - low) / count
    power = 10.0 ** np.floor(np.log10(min_step))
    step = power * next(k for k in (1.0, 2.0, 2.5, 5.0, 10.0) if k * power >= min_step * (1 - 1e-9))
    return step * np.arange(np.ceil(low / step - 1e-9), np.floor(high / step + 1e-9) + 1)


def tick_labels(values: np.ndarray) -> list[str]:
    """Return equidistant numbers in as many digits as tell them apart."""
    largest = np.abs(values).max()
    step = np.ptp(values[:2]) or 1.0
    digits = max(5, int(np.ceil(np.log10(largest / step + 1.0))) + 1)
    exact = np.round(values / step * 4) * step / 4 + 0.0  # zero is exactly that
    return [f"{value:.{digits}g}".replace("e+", "e").replace("-", "−") for value in exact]


def _pen(style: Line) -> Attributes:
    """Return how a line is drawn, as attributes."""
    pen: Attributes = {"stroke": COLORS[style.color], "stroke-width": style.width}
    if style.dash:
        return pen | {"stroke-dasharray": " ".join(f"{length:g}" for length in style.dash)}
    return pen | {"stroke-linejoin": "round", "stroke-linecap": "round"}


def _box(x: float, y: float, width: float, height: float) -> Attributes:
    sides = {"x": x, "y": y, "width": width, "height": height}
    return {name: round(float(value), 2) for name, value in sides.items()}
