"""Fields: their realizations, and what their discretization leaves out."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import cycle

import numpy as np
from matplotlib.axes import Axes

from flexband.basics.checks import check_instance, check_option
from flexband.basics.words import value_text
from flexband.errors import InputError
from flexband.report.drawing.pictures import ALONG, field_series
from flexband.report.plot.series import legend_above, literal
from flexband.report.plot.style import LINES, MIDDLE, axes_of
from flexband.uncertainty.inputs.fields.field import Field
from flexband.uncertainty.inputs.fields.random_field import RandomField


def field(field: Field, name: str = "", *, along: str = "", ax: Axes | None = None) -> Axes:
    """Draw some realizations of a field, with its limits, or its mean ± standard deviation.

    Parameters
    ----------
    field : a field with a domain; `Study.fields` returns those of a study.
    name : of the input, for the axis.
    along : "position" or "time", what the field is a function of, for the axis.
    ax : axes to draw on, those of a new figure by default.

    Raises
    ------
    InputError
        If `field` is not a field, or has no domain, or `along` is neither.
    """
    check_instance("field", field, Field, "a field")
    check_option("along", along, ALONG)
    check_instance("name", name, str, "a text")
    x, drawn, lines, key = field_series(field, 501)
    ax = axes_of(ax)
    ax.plot(x, drawn.T, color=MIDDLE, linewidth=0.6)
    for k, line in enumerate(lines):
        ax.plot(x, line, **LINES[0], label=None if k else key)
    ax.set(xlabel=ALONG[along], ylabel=literal(name))
    ax.margins(x=0)
    if lines:
        legend_above(ax)
    return ax


def variance_error(
    fields: Mapping[str, RandomField], *, along: str = "", ax: Axes | None = None
) -> Axes:
    """Draw which part of the variance of random fields their series leave out, Eq. (31).

    Parameters
    ----------
    fields : name in the legend -> random field with a domain.
    along : "position" or "time", what all of them are functions of, for the axis.
    ax : axes to draw on, those of a new figure by default.

    Raises
    ------
    InputError
        If `fields` has none or others than random fields, or one without a domain, or `along` is
        neither.
    """
    check_option("along", along, ALONG)
    if (
        not isinstance(fields, Mapping)
        or not fields
        or not all(isinstance(random_field, RandomField) for random_field in fields.values())
    ):
        raise InputError(f"fields must map names to random fields; got {value_text(fields)}")
    drawn = {}
    for name, random_field in fields.items():
        x = np.linspace(*random_field.extent, 501)
        text = f"{literal(str(name))}, terms: {random_field.dimension}"
        text += f", largest: {random_field.largest_variance_error():.4f}"
        drawn[text] = x, random_field.variance_error(x)
    ax = axes_of(ax)
    for (text, (x, values)), look in zip(drawn.items(), cycle(LINES), strict=False):
        ax.plot(x, values, label=text, **look)
    ax.set(xlabel=ALONG[along], ylabel="variance error / variance")
    ax.margins(x=0)
    ax.legend()
    return ax
