"""The depth and the duration that a contact has by its own, on lanes: its steps follow these.

An impact of the speed v has the depth d and the duration d/v, with ½ m v² = K dⁿ⁺¹/(n + 1) and the
effective mass m. In a mechanism of 1 m these may be a nanometre and a microsecond.
"""

from __future__ import annotations

from flexband.mechanics.engine.free_steps.control import CONTROL
from flexband.mechanics.kernels.lanes import (
    compiled,
    less,
    load,
    magnitude,
    maximum,
    minimum,
    power,
    splat,
    store,
    where,
)
from flexband.mechanics.kernels.laws.forces import GAP
from flexband.mechanics.kernels.laws.states import MARK
from flexband.mechanics.kernels.state import rows_of_gaps


@compiled
def is_contact_gap(laws, gap):
    """Return whether a gap is that of a contact."""
    return laws.gap_kind[gap] in (GAP.length, GAP.angle)


@compiled
def size_of_unit(structure, values, gap):
    """Return the size of the mechanism, or 1 if a gap is an angle."""
    size = splat(1.0)
    if structure.laws.gap_kind[gap] == GAP.length:
        size = 1.0 / load(values.inverse_scale, 1)
    return size


@compiled
def depth_of_impact(structure, values, z, gap, speed):
    """Return the depth that a contact reaches from a speed by its own, or `MARK.bottomless`."""
    first = structure.laws.parameter_start[structure.laws.gap_law[gap]]
    K = load(values.laws, first)
    n = load(values.laws, first + 1)
    mass = magnitude(load(z, rows_of_gaps(structure.state).mass + gap))
    energy = 0.5 * (n + 1.0) * mass * speed * speed / K
    depth = power(maximum(energy, splat(1e-300)), 1.0 / (n + 1.0))
    return where(less(splat(2.0 * MARK.immovable), mass), depth, splat(MARK.bottomless))


@compiled
def approach_speed(structure, values, z, gap):
    """Return the speed at which a contact begins: as it has begun, or will where it is open."""
    rows = rows_of_gaps(structure.state)
    laws = structure.laws
    mode = load(z, rows.mode + gap)
    rate = magnitude(load(z, rows.rate + gap))
    min_speed = load(values.laws, laws.parameter_start[laws.gap_law[gap]] + 3)
    return maximum(where(less(mode, splat(0.0)), -mode, rate), min_speed)


@compiled
def own_depth(structure, values, z, gap):
    """Return the depth of a contact, as far as it is known: so far, or that of its impact."""
    rows = rows_of_gaps(structure.state)
    coming = depth_of_impact(structure, values, z, gap, approach_speed(structure, values, z, gap))
    closed = less(load(z, rows.mode + gap), splat(0.0))
    return where(closed, load(z, rows.depth + gap), coming)


@compiled
def scale_of_contact(structure, values, z, gap):
    """Return the length [m] or angle [rad] to which the tolerance of a contact's gap refers."""
    size = size_of_unit(structure, values, gap)
    return minimum(size, CONTROL.depths_in_size * own_depth(structure, values, z, gap))


@compiled
def follow_depths(structure, values, z, mask):
    """Let the depths of closed contacts grow where `mask` is true; begin those that are new."""
    state = structure.state
    rows = rows_of_gaps(state)
    for k in range(rows.number):
        if is_contact_gap(structure.laws, k):
            max_depth = load(z, rows.depth + k)
            depth = -load(z, rows.value + k)
            speed = approach_speed(structure, values, z, k)
            impact = depth_of_impact(structure, values, z, k, speed)
            max_depth = maximum(where(less(splat(0.0), max_depth), max_depth, impact), depth)
            closed = less(load(z, rows.mode + k), splat(0.0))
            max_depth = where(closed, max_depth, splat(0.0))
            store(z, rows.depth + k, where(mask, max_depth, load(z, rows.depth + k)))


@compiled
def settle_at_start(structure, values, z, mask):
    """Let contacts that are closed at the start be at rest, unless their speed presses deeper."""
    rows = rows_of_gaps(structure.state)
    none = splat(0.0)
    for k in range(rows.number):
        if is_contact_gap(structure.laws, k):
            speed = maximum(-load(z, rows.rate + k), none)
            impact = depth_of_impact(structure, values, z, k, speed)
            closed = where(mask, less(load(z, rows.mode + k), none), none)
            rests = where(closed, less(impact, -load(z, rows.value + k)), none)
            mass = load(z, rows.mass + k)
            store(z, rows.mass + k, where(rests, -magnitude(mass), mass))


@compiled
def limits_of_contacts(structure, values, limits, z):
    """Return the part of the tolerance that contacts have, and the shortest step [s].

    The part is less than 1 where a closed contact is shallower than the mechanism's size by more
    than `CONTROL.depths_in_size`. The shortest step is less than that of the run where a contact,
    open or closed, lasts for less than `CONTROL.durations` of it, unless a user has given it.
    """
    part = splat(1.0)
    shortest = splat(limits.smallest)
    rows = rows_of_gaps(structure.state)
    for k in range(rows.number):
        if is_contact_gap(structure.laws, k):
            closed = less(load(z, rows.mode + k), splat(0.0))
            share = scale_of_contact(structure, values, z, k)
            share = share / size_of_unit(structure, values, k)
            part = where(closed, minimum(part, share), part)
            speed = approach_speed(structure, values, z, k)
            depth = depth_of_impact(structure, values, z, k, speed)
            shortest = minimum(shortest, CONTROL.durations * depth / speed)
    if limits.is_given > 0.0:
        shortest = splat(limits.smallest)
    return part, shortest
