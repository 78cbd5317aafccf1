"""Studies from Python files."""

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
        Where the file is not there or defines no `Study` of that name.
    """
    if not file.is_file():
        raise InputError(f"there is no file {file}")
    sys.path.insert(0, str(file.resolve().parent))
    study = runpy.run_path(str(file)).get("study")
    if not isinstance(study, Study):
        raise InputError(f"{file} must define `study`, a flexband.Study; got {study!r}")
    return study
