"""Why a sample failed: the codes that the engine sets."""

from __future__ import annotations

from typing import NamedTuple


class FailureCodes(NamedTuple):
    """The first number of a sample's failure, see `entries`; 0 for none."""

    not_assembled: float = 1.0  # the constraints cannot be met at the start
    singular_start: float = 2.0  # they contradict each other, or their Jacobian loses rank
    diverged: float = 3.0  # Newton's method found no state at the end of a step
    contradicted: float = 4.0  # constraints contradict each other during the motion
    wrong_branch: float = 5.0  # a joint holds its body the wrong way round
    not_settled: float = 6.0  # no rest was found
    law_failed: float = 7.0  # a force law raised an error, or gave a force that is not finite
    out_of_reach: float = 8.0  # a drive asks for a position that the mechanism cannot reach
    snapped_through: float = 9.0  # it snaps through before the loads act in full
    undetermined: float = 10.0  # massless bodies can move while all that has mass is at rest
    too_small: float = 11.0  # the smallest of the steps that are chosen freely is not short enough
    overlapping: float = 12.0  # bodies overlap at the start
    unstable: float = 13.0  # the equilibrium to start from is not stable
    not_periodic: float = 14.0  # no periodic motion to start from was found
    not_met: float = 15.0  # a joint is open where a motion goes on
    jammed: float = 16.0  # friction has no consistent motion


FAILURE = FailureCodes()
