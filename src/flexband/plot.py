"""Figures for papers: the functions of `flexband.report.plot`, which say what they draw."""

from flexband.report.plot import *  # noqa: F403
from flexband.report.plot import __all__ as __all__
