"""Figures for papers: each function draws a result on axes, and returns the axes.

>>> with fb.plot.style():  # doctest: +SKIP
...     axes = fb.plot.bands(bands, "F_X")
...     axes.figure.savefig("bands.pdf")
"""

from flexband.report.plot.answers import contributions, probability, tolerances
from flexband.report.plot.bands import bands, bounds, deviations, p_box, response
from flexband.report.plot.comparisons import comparison, errors
from flexband.report.plot.fields import field, variance_error
from flexband.report.plot.margins import margins
from flexband.report.plot.places import mechanism, path
from flexband.report.plot.style import style

__all__ = [
    "bands", "bounds", "comparison", "contributions", "deviations", "errors", "field", "margins",
    "mechanism", "p_box", "path", "probability", "response", "style", "tolerances",
    "variance_error",
]  # fmt: skip
