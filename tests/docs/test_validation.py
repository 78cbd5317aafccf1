"""The reference problems of docs/evidence/validation.md."""

import pytest
from flexible import escalona
from table import PROBLEMS

import flexband as fb


@pytest.mark.parametrize("problem", PROBLEMS, ids=lambda p: p.__name__)
def test_published_problem(problem):
    checks = problem()
    assert checks
    mismatches = [f"{c.name}: {c.result} instead of {c.reference}" for c in checks if not c.holds]
    assert not mismatches, "\n".join(mismatches)


def test_a_mesh_too_coarse_for_the_whip_of_a_pendulum_is_refused():
    with pytest.raises(fb.errors.SimulationError, match="diverged"):
        fb.simulate(escalona(8), duration=0.8, step=1e-3)
