"""Events of force laws within a step, on lanes: zeros of the cubic of a gap over the step.

A law holds the mode m = ±1 of each of its gaps g, the sign that g has, until m g becomes negative.
Over a step, m g is the cubic with the values and rates at both ends.
"""

from __future__ import annotations

from flexband.mechanics.kernels.lanes import compiled, filled, less, load, sqrt, store, where


@compiled
def _cubic(start, slope, c2, c3, u):
    """Return the cubic at u."""
    return start + u * (slope + u * (c2 + u * c3))


@compiled
def crossing(state, before, z, step):
    """Return the part of the step at which the first gap changes its sign, or 1 if none does."""
    first = filled(1.0)
    count = (state.extreme - state.gap) // 3
    for k in range(count):
        mode = load(z, state.gap + 2 * count + k)
        start, end = mode * load(before, state.gap + k), mode * load(z, state.gap + k)
        slope = mode * step * load(before, state.gap + count + k)
        last = mode * step * load(z, state.gap + count + k)
        c2, c3 = 3.0 * (end - start) - 2.0 * slope - last, 2.0 * (start - end) + slope + last
        square = c2 * c2 - 3.0 * c3 * slope
        lowest = -slope / (c2 + sqrt(where(less(square, filled(0.0)), filled(0.0), square)))
        inside = where(less(filled(0.0), lowest), less(lowest, filled(1.0)), filled(0.0))
        inside = where(less(filled(0.0), square), inside, filled(0.0))
        lowest = where(inside, lowest, filled(1.0))
        below = where(less(end, filled(0.0)), filled(1.0), lowest)
        # `below` is 1 where the gap has closed at the end, or where it is nearest to closing
        closed = less(_cubic(start, slope, c2, c3, below), filled(0.0))
        closed = where(less(filled(0.0), start), closed, filled(0.0))
        low, high = filled(0.0), below
        for _ in range(40):
            middle = 0.5 * (low + high)
            open_ = less(filled(0.0), _cubic(start, slope, c2, c3, middle))
            low, high = where(open_, middle, low), where(open_, high, middle)
        root = where(closed, high, filled(1.0))
        first = where(less(root, first), root, first)
    return first


@compiled
def switch_modes(state, z, chosen):
    """Set the modes to the signs of the gaps; return where one changes."""
    count = (state.extreme - state.gap) // 3
    changed = filled(0.0)
    for k in range(count):
        row = state.gap + 2 * count + k
        opposite = less(load(z, row) * load(z, state.gap + k), filled(0.0))
        opposite = where(chosen, opposite, filled(0.0))
        changed = where(opposite, filled(1.0), changed)
        store(z, row, where(opposite, -load(z, row), load(z, row)))
    return changed
