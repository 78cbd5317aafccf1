"""The command line: studies run from a file, resumed, watched, exported and compared."""

# The order of the help page.
from flexband.cli import runs, status, export, comparison, points, narrowing, answers  # noqa: F401, I001
from flexband.cli.application import app

__all__ = ["app"]
