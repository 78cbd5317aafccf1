"""How long steps are that are chosen freely, on lanes: error of a step, and length of the next one.

A step of generalized-α moves a coordinate wrong by C h² (a₁ − a₀), where a₀ and a₁ are the method's
accelerations before and after it, and C = |1/6 − β − (α_m − α_f)/2|. It is repeated with a shorter
step if that is more than the tolerance of the mechanism's size.
"""

from __future__ import annotations

from typing import NamedTuple

from flexband.mechanics.kernels.extremes import minimum
from flexband.mechanics.kernels.lanes import (
    compiled,
    filled,
    less,
    load,
    magnitude,
    maximum,
    power,
    store,
    where,
)


class StepControl(NamedTuple):
    """How the length of a step follows from the error of the one before.

    Attributes
    ----------
    safety
        Of the length that the error asks for, the part that is taken.
    shortest, longest
        Length of a step over that of the one before.
    unchanged
        Growth below which the length remains.
    repeated
        The same length ratio where Newton's method has failed.
    first
        First step of a run, in steps of the output.
    overshoot
        Part of a step by which it passes an event. It passes a contact by at most half of the
        tolerance.
    located
        Part of a step in which an event is located at its end.
    stuck
        Both parts for sticking and sliding: forces jump, and no depth bounds the error.
    difference
        Part of a step over which the rates of gaps are differences.
    least_speed
        Size of a mode where its gap does not move.
    in_flight, in_contact
        Parts of the tolerance of steps in which all contacts are open, or one is closed: clearances
        are small, and depths are smaller.
    depths, least_depth
        Ratio by which the depth of a contact changes at most in a step, and the change in parts of
        the tolerance that is always allowed.
    events_in_a_row, long_step
        More events than that are without end if no step between them is longer than the shortest
        one times `long_step`.
    newton
        Tolerance of Newton's method in parts of that of the step, if that is less than its own.
    """

    safety: float = 0.9
    shortest: float = 0.2
    longest: float = 2.0
    unchanged: float = 1.2
    repeated: float = 0.25
    first: float = 0.05
    overshoot: float = 2e-4
    located: float = 1e-3
    stuck: float = 1e-6
    difference: float = 1e-3
    least_speed: float = 1e-30
    in_flight: float = 0.1
    in_contact: float = 0.01
    depths: float = 1.5
    least_depth: float = 0.1
    events_in_a_row: float = 20.0
    long_step: float = 10.0
    newton: float = 0.01


CONTROL = StepControl()


@compiled
def shift_accelerations(structure, z, a, ratio, chosen):
    """Set a, an acceleration at a part of a step from its end, to that part of another step.

    `ratio` is the length of the new step over that of the one before.
    """
    for i in range(1, structure.state.coordinates + 1):
        old, present = load(a, i), load(z, structure.state.acceleration + i)
        store(a, i, where(chosen, present + ratio * (old - present), old))


@compiled
def error_of_step(structure, method, values, work, ratio):
    """Return the largest error of a coordinate in a step, relative to the mechanism's size.

    `work.before` has the state before the step, and `ratio` is that of `shift_accelerations`.
    """
    state = structure.state
    C = 1.0 / 6.0 - method.beta - 0.5 * (method.alpha_m - method.alpha_f)
    largest = filled(0.0)
    for i in range(1, state.coordinates + 1):
        old = load(work.before, state.acceleration + i)
        old = old + ratio * (load(work.before, state.rows + i) - old)
        change = magnitude(load(work.a, i) - old) * load(values.inverse_scale, i)
        largest = maximum(largest, change)
    return magnitude(C * method.step * method.step) * largest


@compiled
def extrapolated(error, cubed, before, chosen):
    """Return the error of the next step of the same length, that of this one unless `chosen`.

    `cubed` is the error over the third power of the step, and `before` the same of the step before,
    or 0. If lengths followed from the last error alone, they would lag behind the depth of a
    contact: other steps on its way in than on its way out do not keep the energy of an impact.
    """
    growth = cubed / where(less(filled(0.0), before), before, cubed)
    growth = maximum(filled(0.5), where(less(growth, filled(2.0)), growth, filled(2.0)))
    return where(chosen, error * growth, error)


@compiled
def length_ratio(error):
    """Return the length of the next step over that of one with this error, over the tolerance.

    It is the third root of 1/error times the safety factor, within its bounds.
    """
    ratio = maximum(CONTROL.safety * power(error, filled(-1.0 / 3.0)), filled(CONTROL.shortest))
    return minimum(ratio, filled(CONTROL.longest))
