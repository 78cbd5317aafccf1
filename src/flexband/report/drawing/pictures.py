"""The pictures of a page, in SVG: the mechanism, and realizations of fields."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from flexband.mechanics.model.mechanism import Mechanism
from flexband.report.drawing.canvas import Canvas
from flexband.report.drawing.sheet import AFTER, BEFORE, Drawing, Sheet, sheet_for, space_around
from flexband.report.drawing.svg import SvgAxes, svg_address
from flexband.report.shapes.shapes import Line
from flexband.uncertainty.inputs.fields.field import Field
from flexband.uncertainty.inputs.fields.interval_field import IntervalField
from flexband.uncertainty.inputs.fields.random_field import RandomField

ALONG = {"position": "position [m]", "time": "time [s]", "": "position [m] or time [s]"}
"""What a field is a function of -> name of the axis."""


def mechanism_picture(mechanism: Mechanism) -> str:
    """Return a drawing of a mechanism at its start, as `draw` makes it, as an image's address.

    It is as large as a page shows it, and the mechanism fills it up to its names and symbols. Wide
    mechanisms are as wide as a page, others as wide as a column of it.
    """
    column, page = np.array([430.0, 320.0]), np.array([870.0, 300.0])  # [pt]
    for_field = np.array([[0.0, 0.0], [54.0, 0.0]])  # space at the right for an arrow [pt]
    drawing = Drawing.at_start(mechanism)
    extremes = drawing.extremes
    fills_page = sheet_for(extremes, largest=page).space[0] > 0.9 * (page - BEFORE - AFTER)[0]
    largest = page if fills_page else column

    def drawn_on(sheet: Sheet, *, fields: bool = True) -> tuple[SvgAxes, Canvas]:
        axes = SvgAxes(sheet.box, sheet.space, ("X [m]", "Y [m]"))
        return axes, drawing.draw_on(axes, sheet, fields=fields)

    _, canvas = drawn_on(sheet_for(extremes, largest=largest), fields=False)
    around = space_around(canvas, extremes)
    axes, canvas = drawn_on(sheet_for(extremes, largest=largest, around=around))
    if canvas.is_crowded:
        axes, _ = drawn_on(sheet_for(extremes, largest=largest, around=around + for_field))
    width, height = BEFORE + axes.size + AFTER
    return svg_address(width, height, [axes.picture(BEFORE[0], AFTER[1])])


class FieldSeries(NamedTuple):
    """A field along its domain."""

    x: np.ndarray  # (points,)
    realizations: np.ndarray  # (realizations, points)
    lines: list[np.ndarray]  # μ ± σ or limits, (points,) each
    lines_name: str


def field_series(field: Field, points: int) -> FieldSeries:
    """Return realizations and bounds of a field at points of its domain."""
    count = 8
    x = np.linspace(*field.extent, points)
    realizations = field.realizations(x, count)
    if isinstance(field, RandomField):
        middle = field.nominal(x)
        deviation = field.deviation(x)
        return FieldSeries(x, realizations, [middle - deviation, middle + deviation], "μ ± σ")
    lines = list(field.limits(x)) if isinstance(field, IntervalField) else []
    return FieldSeries(x, realizations, lines, "limits")


def fields_picture(fields: Mapping[str, Field], along: Mapping[str, str]) -> str:
    """Return realizations of fields along "position" or "time" as an image's address."""
    size = np.array([330.0, 110.0])
    top = 8.0
    below = 44.0  # [pt]
    margins = 60.0, 14.0  # [pt]: left, right
    parts: list[str] = []
    for name, field in fields.items():
        # Axes that all lines fit into, with some space above and below.
        x, realizations, lines, key = field_series(field, 201)
        low = np.min([*realizations, *lines])
        high = np.max([*realizations, *lines])
        margin = 0.05 * (high - low) or 0.05 * abs(high) or 1.0
        box = np.array([[x[0], low - margin], [x[-1], high + margin]])
        axes = SvgAxes(box, size, (ALONG[along.get(name, "")], name))
        for values in realizations:
            axes.line(np.stack([x, values], 1), Line(color="realization", width=0.6))
        for values in lines:
            axes.line(np.stack([x, values], 1), Line(width=0.9))
        if lines:
            axes.above(key, 8.0, is_key=True)
        # The field in words, and the picture below those of the fields before.
        title = textwrap.wrap(field.summary, 60)
        for k, text in enumerate(reversed(title)):
            axes.above(text, 8.0 + 14.0 * (k + bool(lines)))
        top += 8.0 + 14.0 * (len(title) + bool(lines))
        parts.append(axes.picture(margins[0], top))
        top += size[1] + below
    return svg_address(size[0] + sum(margins), top, parts)
