"""Studies read from Python files."""

from __future__ import annotations

import runpy
import sys
from pathlib import Path

from flexband.errors import InputError
from flexband.study.study import Study


def load_study(file: Path) -> Study:
    """Run a Python file and return its `study`.

    Raises
    ------
    InputError
        If the file does not exist or does not define a `Study` of that name.
    """
    if not file.is_file():
        raise InputError(f"file must be a Python file that exists; got {str(file)!r}")
    sys.path.insert(0, str(file.resolve().parent))
    study = runpy.run_path(str(file)).get("study")
    if not isinstance(study, Study):
        raise InputError(f"{file} must define `study`, a flexband.Study; got {study!r}")
    return study
