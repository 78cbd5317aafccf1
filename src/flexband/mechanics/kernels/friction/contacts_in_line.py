"""Contacts of one rigid body with one straight line, on lanes: they stick and slide together.

Where two corners of a box rest on a floor, both slide at one speed, and what friction each of them
takes does not matter to the motion: a body that is rigid leaves it open. Their sliding speeds
differ by ω δ alone, where δ is how much deeper one is pressed in. Coulomb's law of each of them
would change its sense with that, at every vibration of the box on its contacts, and could not hold
the other.

So the first that is closed decides, with the sum of what all can hold, and has the constraint where
they stick. The others follow it. All take part in its force in proportion to what they can hold.
"""

from __future__ import annotations

from flexband.mechanics.kernels.friction.modes import sticks
from flexband.mechanics.kernels.lanes import compiled, less, load, maximum, splat, store, where
from flexband.mechanics.kernels.state import friction_rows, rows_of_gaps


@compiled
def is_closed(structure, z, k):
    """Return where the contact of friction k is closed."""
    mode = rows_of_gaps(structure.state).mode + structure.friction.gap[k]
    return less(load(z, mode), splat(0.0))


@compiled
def is_in_line(structure, k):
    """Return whether friction k has others on its line."""
    friction = structure.friction
    return friction.earlier[k] >= 0 or friction.later[k] >= 0


@compiled
def follows(structure, z, k):
    """Return where friction k follows an earlier one of its line that is closed as well."""
    friction = structure.friction
    leads = splat(0.0)
    n = structure.friction.earlier[k]
    while n >= 0:
        leads = maximum(leads, is_closed(structure, z, n))
        n = friction.earlier[n]
    if friction.earlier[k] >= 0:
        leads = where(is_closed(structure, z, k), leads, splat(0.0))
    return leads


@compiled
def holds(structure, z, k):
    """Return where friction k sticks by a constraint of its own."""
    hold_mask = sticks(structure.state, z, k)
    if structure.friction.earlier[k] >= 0:
        hold_mask = where(follows(structure, z, k), splat(0.0), hold_mask)
    return hold_mask


@compiled
def first_in_line(structure, k):
    """Return the first friction of the line of k, closed or not."""
    first = k
    while structure.friction.earlier[first] >= 0:
        first = structure.friction.earlier[first]
    return first


@compiled
def sum_up_line(structure, values, z, first):
    """Return λ, the normal force, and what they can hold, of the closed ones of a line."""
    friction = structure.friction
    rows = friction_rows(structure.state)
    none = splat(0.0)
    force = none
    N = none
    hold = none
    n = first
    while n >= 0:
        closed = is_closed(structure, z, n)
        normal = where(closed, load(z, rows.normal + n), none)
        N = N + normal
        hold = hold + load(values.friction.static, n) * normal
        force = force + where(closed, load(z, structure.state.friction + n), none)
        n = friction.later[n]
    return force, N, hold


@compiled
def sums_of_line(structure, values, z, k):
    """Return λ, the normal force, and what it can hold, of k or, where it is closed, its line."""
    force = load(z, structure.state.friction + k)
    N = load(z, friction_rows(structure.state).normal + k)
    hold = load(values.friction.static, k) * N
    if is_in_line(structure, k):
        closed = is_closed(structure, z, k)
        first = first_in_line(structure, k)
        of_line = sum_up_line(structure, values, z, first)
        force = where(closed, of_line[0], force)
        N = where(closed, of_line[1], N)
        hold = where(closed, of_line[2], hold)
    return force, N, hold


@compiled
def share_in_line(structure, values, z):
    """Let the contacts of each line that stick share their force by what they can hold."""
    state = structure.state
    rows = friction_rows(structure.state)
    for k in range(rows.frictions):
        if structure.friction.earlier[k] < 0 and is_in_line(structure, k):
            force, _, hold = sum_up_line(structure, values, z, k)
            shared = less(splat(0.0), hold)
            part = force / where(shared, hold, splat(1.0))
            n = k
            while n >= 0:
                limit = load(values.friction.static, n) * load(z, rows.normal + n)
                closed = where(is_closed(structure, z, n), sticks(state, z, n), splat(0.0))
                row = state.friction + n
                store(z, row, where(where(closed, shared, closed), part * limit, load(z, row)))
                n = structure.friction.later[n]
