"""The reference problems of docs/validation.md."""

import pytest
from table import PROBLEMS


@pytest.mark.parametrize("problem", PROBLEMS, ids=lambda p: p.__name__)
def test_published_problem(problem):
    checks = problem()
    assert checks
    off = [f"{c.name}: {c.ours} instead of {c.reference}" for c in checks if not c.holds]
    assert not off, "\n".join(off)
