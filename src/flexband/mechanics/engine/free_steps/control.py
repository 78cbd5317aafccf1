"""How long steps are that are chosen freely, on lanes: error of a step, and length of the next one.

A step of generalized-α moves a coordinate wrong by C h² (a₁ − a₀), where a₀ and a₁ are the method's
accelerations before and after it, and C = |1/6 − β − (α_m − α_f)/2|. It is repeated with a shorter
step if that is more than the tolerance of the mechanism's size.
"""

from __future__ import annotations

from typing import NamedTuple

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


class StepControl(NamedTuple):
    """How the length of a step follows from the error of the one before."""

    safety: float = 0.9
    """Part of the length that the error asks for."""
    shortest: float = 0.2
    """Length of a step over that of the one before, at least."""
    longest: float = 2.0
    """The same at most."""
    unchanged: float = 1.2
    """Growth below which the length remains."""
    repeated: float = 0.25
    """Ratio of lengths where Newton's method has failed."""
    first: float = 0.05
    """First step of a run, in steps of the output."""
    overshoot: float = 2e-4
    """Part of a step beyond an event; half the tolerance past a contact."""
    event_interval: float = 1e-3
    """Part of a step in which an event is located at its end."""
    stuck: float = 1e-6
    """Both for sticking and sliding: forces jump, and no depth bounds the error."""
    difference: float = 1e-3
    """Part of a step over which the rates of gaps are differences."""
    least_speed: float = 1e-30
    """Size of a mode where its gap does not move."""
    in_flight: float = 0.1
    """Part of the tolerance with all contacts open: clearances are small."""
    in_contact: float = 0.01
    """The same with a contact closed: depths are smaller."""
    depths: float = 1.5
    """Ratio by which the depth of a contact changes at most in a step."""
    least_depth: float = 0.1
    """Change relative to the tolerance that is always allowed."""
    depths_in_size: float = 1e4
    """Depths of a contact in the size of a mechanism beyond which the tolerance refers to them."""
    durations: float = 1e-4
    """Part of the duration of an impact that its steps may have at least."""
    immovable: float = 1e-9
    """Mobility of a contact, relative to that without joints, that counts as none."""
    events_in_a_row: float = 20.0
    """More, without a long step between them, are without end."""
    remembered: float = 0.97
    """Part of the events in a row that a long step leaves."""
    long_step: float = 10.0
    """Such a step over the shortest one."""
    newton: float = 0.01
    """Newton's tolerance relative to that of the step, if less than its own."""
    newton_of_states: float = 1e-5
    """The same with states of laws, which may change over 1e-5 of the size."""


CONTROL = StepControl()


@compiled
def shift_accelerations(structure, z, a, ratio, mask):
    """Set a, an acceleration at a part of a step from its end, to that part of another step.

    `ratio` is the length of the new step over that of the one before.
    """
    for i in range(1, structure.state.coordinates + 1):
        old = load(a, i)
        present = load(z, structure.state.acceleration + i)
        store(a, i, where(mask, present + ratio * (old - present), old))


@compiled
def error_of_step(structure, method, values, work, ratio):
    """Return the largest error of a coordinate since `work.before`, relative to the size.

    `work.s` has the errors, and `work.counts` which coordinate it is.
    """
    state = structure.state
    C = 1.0 / 6.0 - method.beta - 0.5 * (method.alpha_m - method.alpha_f)
    factor = C * method.step * method.step
    largest = splat(0.0)
    worst = splat(0.0)
    store(work.s, 0, splat(0.0))
    for i in range(1, state.coordinates + 1):
        old = load(work.before, state.acceleration + i)
        old = old + ratio * (load(work.before, state.rows + i) - old)
        error = factor * (load(work.a, i) - old)
        store(work.s, i, error)
        change = magnitude(error) * load(values.inverse_scale, i)
        worst = where(less(largest, change), splat(float(i)), worst)
        largest = maximum(largest, change)
    store(work.counts, 3, worst)
    return largest


@compiled
def extrapolate_error(error, cubed, before, mask):
    """Return the error of the next step of the same length, that of this one outside of `mask`.

    `cubed` is the error over the third power of the step, and `before` the same of the step before,
    or 0. If lengths followed from the last error alone, they would lag behind the depth of a
    contact: other steps on its way in than on its way out do not keep the energy of an impact.
    """
    growth = cubed / where(less(splat(0.0), before), before, cubed)
    growth = maximum(splat(0.5), where(less(growth, splat(2.0)), growth, splat(2.0)))
    return where(mask, error * growth, error)


@compiled
def length_ratio(error):
    """Return the length of the next step over that of one with this error, over the tolerance."""
    ratio = maximum(CONTROL.safety * power(error, splat(-1.0 / 3.0)), splat(CONTROL.shortest))
    return minimum(ratio, splat(CONTROL.longest))
