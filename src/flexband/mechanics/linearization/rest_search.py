"""The search for a rest from a start that is far from it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexband.mechanics.engine.threads import stop_flag
from flexband.mechanics.linearization.balance import Balance
from flexband.mechanics.linearization.linearize import Equations
from flexband.mechanics.linearization.spin import Spin


class RestSearch(NamedTuple):
    """How an equilibrium is searched for. Lengths are relative to the size of the mechanism."""

    iterations: int = 100
    """Of Newton's method, at most."""
    max_step: float = 0.1
    """Longer steps are shortened. It grows by a fifth with every step that is."""
    rest_step: float = 1e-8
    """Steps at rest."""
    stuck_step: float = 1e-11
    """Steps without progress."""
    violation: float = 1e-9
    """Of the constraints, at most."""
    push: float = 1e-4
    """First displacement out of a place where Newton's method makes no progress."""
    max_pushes: int = 3
    """Such displacements, each ten times as large as the one before."""
    growth: float = 100.0
    """Of the weight of the stiffness against the inertia, with every step that succeeds."""
    state_step: float = 1e5
    """Step of the states of force laws [s], longer than any time constant."""
    state_steps: int = 20
    """The most of these steps."""
    state_change: float = 1e-9
    """Change of a state that rests, relative to its largest value so far."""


def find_rest(
    equations: Equations,
    z: np.ndarray,
    spin: Spin,
    start: np.ndarray,
    search: RestSearch = RestSearch(),
) -> tuple[Balance, bool]:
    """Move to an equilibrium; return the balance there, or where the search ended, and success.

    If none near z is stable, the search goes downhill from `start`, or from z. States of force laws
    take long steps, each to a rest, and modes of gaps become the signs of the gaps.
    """
    if equations.state.rule == equations.state.extreme:
        return _rest(equations, z, spin, start, search)
    size = np.abs(start[equations.y])
    settled = None
    z, start = (_hurry_law_states(equations, z, search.state_step) for z in (z, start))
    balance, success = _rest(equations, z, spin, start, search)
    for _ in range(search.state_steps):
        before = balance.z[equations.y0]
        y = balance.z[equations.y]
        size = np.maximum(size, np.maximum(np.abs(y), np.abs(before)))
        if not np.isfinite(balance.z).all():
            break
        switched = equations.update_law_modes(balance.z)
        same = np.array_equal(switched, balance.z)
        settled = balance if success else settled
        if same and settled and np.all(np.abs(y - before) <= search.state_change * size):
            return settled, True  # forces of states that fade may be too small to search with
        if same and not success:
            break
        if not success:  # the mechanism went away from where the other mode holds it
            switched[equations.q] = start[equations.q]
        settled = settled if same else None  # one of other modes is no rest of these
        z = _hurry_law_states(equations, switched, search.state_step)
        balance, success = _rest(equations, z, spin, z, search)
    return balance, False


def _hurry_law_states(equations: Equations, z: np.ndarray, step: float) -> np.ndarray:
    """Return a state from which states of force laws take such a step [s] of Euler's method."""
    z = equations.freeze_law_states(z)
    z[equations.state.rule : equations.state.gap][1:2] = step
    return z


def _rest(
    equations: Equations, z: np.ndarray, spin: Spin, start: np.ndarray, search: RestSearch
) -> tuple[Balance, bool]:
    """Perform `find_rest` for one step of the states of force laws."""
    balance, success = _search_rest(equations, z, spin, search, downhill=False)
    if not success:
        balance, success = _search_rest(equations, z, spin, search, downhill=True)
    elif not balance.stable:
        other, lower = _search_rest(equations, start, spin, search, downhill=True)
        if lower and other.stable:
            balance = other
    return balance, success and not balance.has_lost_stiffness


def _search_rest(
    equations: Equations, z: np.ndarray, spin: Spin, search: RestSearch, *, downhill: bool
) -> tuple[Balance, bool]:
    """Move to an equilibrium, a stable one if `downhill`.

    Inertia keeps the first steps short and loses weight as the forces become smaller, downhill only
    as far as the energy decreases.
    """
    rigidity = float(equations.values.rigidity[0, 0])
    pushes = 0
    before = np.inf
    weight = rigidity if downhill else 1e3 * rigidity
    balance = Balance(equations, z, spin)
    longest = search.max_step
    for _ in range(search.iterations):
        excess = balance.excess
        if not np.isfinite(excess) or stop_flag().any():
            break
        # Stop where forces are balanced, if Newton's step is short.
        violation = np.abs(balance.violation).max(initial=0.0)
        at_rest = excess <= 1.0 and violation < search.violation
        if at_rest and not balance.directionless:
            step = balance.step(np.inf)
            if np.abs(step).max() < search.rest_step:
                if excess < 0.01 and violation < 1e-13 and not spin.rate:
                    return balance, True
                last = balance.after_step(step)
                return last if last.excess <= 1.0 else balance, True
        # Take a step with inertia, or a push where Newton's method is stuck.
        if downhill:
            weight = min(weight, 0.5 / max(-balance.lowest(), 1e-250))
        step = balance.step(weight)
        largest = np.abs(step).max()
        if balance.directionless or (
            not at_rest
            and largest < search.stuck_step
            and np.abs(balance.step(np.inf)).max() < search.stuck_step
        ):
            if pushes == search.max_pushes:
                break
            step = 10.0**pushes * search.push * balance.push()
            largest = 0.0
            pushes = pushes + 1
            before = np.inf
            weight = rigidity
        # Let inertia lose weight as the forces become smaller.
        if excess <= before or downhill:
            weight = min(weight * (10.0 if downhill else search.growth), 1e250)
        else:
            weight = weight / 10.0
        before = excess
        balance = balance.after_step(min(1.0, longest / max(largest, 1e-300)) * step)
        longest = 1.2 * longest if largest > longest else search.max_step
    return balance, False
