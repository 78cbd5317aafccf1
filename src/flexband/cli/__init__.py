"""The command line: studies run from a file, resumed, watched, exported and compared."""

from flexband.cli import answers, comparison, export, narrowing, points, runs, status  # noqa: F401  (commands)
from flexband.cli.application import app

__all__ = ["app"]
