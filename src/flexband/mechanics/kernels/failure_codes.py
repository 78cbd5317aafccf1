"""Why a sample failed: the codes that the engine sets."""

from __future__ import annotations

from typing import NamedTuple

from flexband.mechanics.kernels.lanes import compiled, load, splat, store, where


class FailureCodes(NamedTuple):
    """The first number of a sample's failure, see `entries`: 1, 2, …, or 0 for none."""

    not_assembled: float  # the constraints cannot be met at the start
    singular_start: float  # they contradict each other, or their Jacobian loses rank
    diverged: float  # Newton's method found no state at the end of a step
    contradicted: float  # constraints contradict each other during the motion
    wrong_branch: float  # a joint holds its body the wrong way round
    not_settled: float  # no rest was found
    law_failed: float  # a force law raised an error, or gave a force that is not finite
    out_of_reach: float  # a drive asks for a position that the mechanism cannot reach
    snapped_through: float  # it snaps through before the loads act in full
    undetermined: float  # massless bodies can move while all that has mass is at rest
    too_small: float  # the smallest of the steps that are chosen freely is not short enough
    overlapping: float  # bodies overlap at the start
    unstable: float  # the equilibrium to start from is not stable
    not_periodic: float  # no periodic motion to start from was found
    not_met: float  # a joint is open where a motion goes on
    jammed: float  # friction jams, as in the paradox of Painlevé
    unsettled: float  # nothing that sticks or slides, or becomes active, agrees with the rest


FAILURE = FailureCodes(*(1.0 + k for k in range(len(FailureCodes._fields))))


@compiled
def note_failure(failure, code, lanes):
    """Note a code in the `lanes` that have not failed so far; return which these are."""
    old_code = load(failure, 0)
    new = where(old_code, splat(0.0), lanes)
    store(failure, 0, where(new, splat(code), old_code))
    return new
