"""The reference problems of docs/validation.md."""

import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1] / "validation"
sys.path.insert(0, str(FOLDER))

import flexible  # noqa: E402
import rigid  # noqa: E402


@pytest.mark.parametrize("problem", [*rigid.PROBLEMS, *flexible.PROBLEMS], ids=lambda p: p.__name__)
def test_published_problem(problem):
    checks = problem()
    assert checks
    off = [f"{c.name}: {c.ours} instead of {c.reference}" for c in checks if not c.holds]
    assert not off, "\n".join(off)
