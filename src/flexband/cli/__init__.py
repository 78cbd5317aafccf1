"""The command line: studies run from a file, resumed, watched, exported and compared."""

# The order of the help page.
from flexband.cli import runs, status, report, export, comparison, points  # noqa: F401, I001
from flexband.cli.answers import narrowing, limits, ranges, allocation, derived, paths  # noqa: F401
from flexband.cli.application import app

__all__ = ["app"]
