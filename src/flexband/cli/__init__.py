"""The command line: studies run from a file, resumed, watched, exported and compared."""

from flexband.cli.application import app

__all__ = ["app"]
