"""The figures of the paper, drawn again."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.figure import Figure

import flexband as fb
from benchmarks.paper.studies import Result
from flexband.report.plot.figures import (
    bands_figure,
    errors_figure,
    response_figure,
    variance_error_figure,
)
from flexband.study.study import Study
from flexband.uncertainty.expansions.families import HERMITE
from flexband.uncertainty.expansions.hybrid import tensor_points
from flexband.uncertainty.expansions.polynomials import chebyshev_zeros, scaled_chebyshev_zeros

METHODS = {"PCCI": fb.PCCI, "improved PCCI": fb.ImprovedPCCI}
STYLES = {"PCCI": "--", "improved PCCI": "-."}


def drawings(stiff: Result, soft: Result) -> Iterator[tuple[str, Figure]]:
    """Yield name and figure of all pictures of the page."""
    yield "chebyshev", chebyshev()
    yield "points", points()
    study = Study(stiff.case.response, stiff.case.inputs, fb.AdaptivePCCI(correct=False))
    yield "field", variance_error_figure(study.fields())
    yield "reactions", wide(response_figure(study.nominal(), ["F_X", "F_Y"]))
    for name, result in {"": stiff, "soft_": soft}.items():
        for output in result.truth.output.values.tolist():
            for order in (1, 3):
                yield f"{name}{output}_{order}", wide(bands(result, output, order))
            comparisons = [
                comparison
                for comparison in result.comparisons
                if comparison.method.name in METHODS or not comparison.errors
            ]
            yield f"{name}{output}_errors", wide(errors_figure(comparisons, output))


def wide(figure: Figure) -> Figure:
    """Return a figure of the report as wide as a page of text, where letters take less of it."""
    figure.set_size_inches(10, 3.75 * len(figure.axes))
    return figure


def bands(result: Result, output: str, order: int) -> Figure:
    """Draw the bands of one output by LHS–Scanning, PCCI and improved PCCI, k = q = order."""
    methods = result.comparisons[0].method, *(kind(order, order) for kind in METHODS.values())
    bands_by_label = {
        comparison.method.label: comparison.bands
        for comparison in result.comparisons
        if comparison.method in methods
    }
    return bands_figure(bands_by_label, output)


def chebyshev() -> Figure:
    """Draw cos πη and its expansions of order 2, and their errors: Fig. 1."""
    x = np.linspace(-1, 1, 401)
    figure = Figure(figsize=(10, 3.6), layout="constrained")
    expansion_axes, error_axes = figure.subplots(1, 2)
    expansion_axes.plot(x, np.cos(np.pi * x), "0.1", label="cos πη")
    for name, method in METHODS.items():
        model = fb.expand(lambda x: np.cos(np.pi * x), {"x": fb.Interval(-1, 1)}, method(0, 2))
        values = model.evaluate(x=x).values
        label = name.replace("PCCI", "Chebyshev")
        expansion_axes.plot(x, values, STYLES[name], label=label)
        error_axes.plot(x, values - np.cos(np.pi * x), STYLES[name], label=label)
    expansion_axes.set(title="Expansions of order 2", xlabel="η")
    error_axes.set(title="Errors", xlabel="η")
    for axes in (expansion_axes, error_axes):
        axes.legend(fontsize=8)
        axes.grid(alpha=0.3)
    return figure


def points() -> Figure:
    """Draw the points of PCCI and improved PCCI for n = m = 1 and k = q = 3: Fig. 2."""
    figure = Figure(figsize=(5, 4), layout="constrained")
    axes = figure.subplots()
    nodes = {"PCCI": chebyshev_zeros(3), "improved PCCI": scaled_chebyshev_zeros(3)}
    for (name, eta), mark in zip(nodes.items(), "ox", strict=True):
        xi, eta_grid = tensor_points([HERMITE.gauss(4)[0], eta]).T
        axes.plot(xi, eta_grid, mark, label=name)
    axes.set(xlabel="ξ", ylabel="η", ylim=(-1.15, 1.35))
    axes.legend(fontsize=8, ncols=2, loc="upper center")
    axes.grid(alpha=0.3)
    return figure
