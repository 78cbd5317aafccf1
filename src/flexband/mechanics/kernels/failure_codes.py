"""Why a sample failed: the codes that the engine sets."""

from __future__ import annotations

from typing import NamedTuple


class FailureCodes(NamedTuple):
    """The first number of a sample's failure, see `entries`; 0 for none.

    Attributes
    ----------
    not_assembled
        The constraints cannot be met at the start.
    singular_start
        They contradict each other, or their Jacobian loses rank.
    diverged
        Newton's method found no state at the end of a step.
    contradicted
        Constraints contradict each other during the motion.
    wrong_branch
        A joint holds its body the wrong way round.
    not_settled
        No rest was found.
    law_failed
        A force law raised an error, or gave a force that is not finite.
    out_of_reach
        A drive asks for a position that the mechanism cannot reach.
    snapped_through
        The mechanism snaps through before the loads act in full.
    undetermined
        Bodies without mass can move while all that has mass is at rest.
    too_small
        The smallest of the steps that are chosen freely is not short enough.
    overlapping
        Bodies overlap at the start.
    unstable
        The equilibrium to start from is not stable.
    not_periodic
        No periodic motion to start from was found.
    not_met
        A joint is open where a motion goes on.
    jammed
        Friction has no consistent motion.
    """

    not_assembled: float = 1.0
    singular_start: float = 2.0
    diverged: float = 3.0
    contradicted: float = 4.0
    wrong_branch: float = 5.0
    not_settled: float = 6.0
    law_failed: float = 7.0
    out_of_reach: float = 8.0
    snapped_through: float = 9.0
    undetermined: float = 10.0
    too_small: float = 11.0
    overlapping: float = 12.0
    unstable: float = 13.0
    not_periodic: float = 14.0
    not_met: float = 15.0
    jammed: float = 16.0


FAILURE = FailureCodes()
