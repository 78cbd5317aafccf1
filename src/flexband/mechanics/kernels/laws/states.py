"""First-order states of force laws, ẏ = g(t, x, v, y), and the rule that integrates them, on lanes.

A step from y₀ is that of Jansen, Whiting and Hulbert's generalized-α method with ρ∞ = 0,

    y₁ = y₀ + h c w₀ + h (1 − c) ẏ₁,   w₁ = (y₁ − y₀)/h,   c = 1/3,

or one of Euler's implicit method, c = 0, where there is no w₀ yet. Laws solve for y₁, see
`loads.solved_states`.

The rows of the states in z are y, y₀, w, ẏ and the sizes of all laws' states, which steps that are
chosen know, then those of the rule, which all states share: h c, h (1 − c) and c.
"""

from __future__ import annotations

from typing import NamedTuple

from flexband.mechanics.kernels.lanes import compiled, load, splat, store, where
from flexband.mechanics.kernels.state import STATE_ROWS

FIRST_SHARE = 1.0 / 3.0
"""c, but for Euler's method."""


class Marks(NamedTuple):
    """Numbers that stand for something else."""

    steady: float = 1e300
    """For a state at the start that is to have no rate."""
    solved: float = -1.0
    """For h (1 − c) where a law solves for a state that has no rate."""
    at_rest: float = 1e30
    """For the speed of a contact that never closed: it damps no vibration."""
    immovable: float = 1e-300
    """For the effective mass of a contact that cannot move."""
    bottomless: float = 1e300
    """For the depth of its impact."""
    unit: float = 1e60
    """For the speed of a contact whose force is to be 1."""


MARK = Marks()


class StateRows(NamedTuple):
    """How many states there are, and the first row of y, y₀, w, ẏ, their sizes, and the rule."""

    states: int
    y: int
    y0: int
    w: int
    rate: int
    size: int
    rule: int


@compiled
def rows_of_states(state):
    """Return the `StateRows`."""
    n = (state.rule - state.law_state) // STATE_ROWS
    y = state.law_state
    return StateRows(n, y, y + n, y + 2 * n, y + 3 * n, y + 4 * n, state.rule)


@compiled
def _hold(rows, z, mask):
    """Set y₀ to y where `mask` is true."""
    for k in range(rows.states):
        store(z, rows.y0 + k, where(mask, load(z, rows.y + k), load(z, rows.y0 + k)))


@compiled
def hold_states(state, z, mask):
    """Hold y where `mask` is true, until a first step, of Euler's method, begins."""
    rows = rows_of_states(state)
    if rows.states > 0:
        for row in range(rows.rule, rows.rule + 3):
            store(z, row, where(mask, splat(0.0), load(z, row)))
        _hold(rows, z, mask)


@compiled
def begin_states(state, z, h, mask):
    """Begin a step of length h from y where `mask` is true."""
    rows = rows_of_states(state)
    rule = rows.rule
    if rows.states > 0:
        share = load(z, rule + 2)
        store(z, rule, where(mask, h * share, load(z, rule)))
        store(z, rule + 1, where(mask, h * (1.0 - share), load(z, rule + 1)))
        _hold(rows, z, mask)


@compiled
def end_states(state, z, h, mask):
    """End a step of length h: set w₁ = (y₁ − y₀)/h and hold y₁ where `mask` is true."""
    rows = rows_of_states(state)
    for k in range(rows.states):
        w = (load(z, rows.y + k) - load(z, rows.y0 + k)) / h
        store(z, rows.w + k, where(mask, w, load(z, rows.w + k)))
    hold_states(state, z, mask)
    if rows.states > 0:
        store(z, rows.rule + 2, where(mask, splat(FIRST_SHARE), load(z, rows.rule + 2)))


@compiled
def shift_states(state, z, ratio, mask):
    """Set w, the rate half a step earlier, to that half of another step earlier.

    `ratio` is the length of the new step over that of the one before.
    """
    rows = rows_of_states(state)
    for k in range(rows.states):
        w = load(z, rows.w + k)
        present = load(z, rows.rate + k)
        store(z, rows.w + k, where(mask, present + ratio * (w - present), w))
