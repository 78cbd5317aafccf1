"""Sensors of energy and work: of the whole mechanism, and of one of its parts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexband.arguments import frozen
from flexband.mechanics.kernels.forms import Form, during_impulse
from flexband.mechanics.sensors.motion import Sensor, SensorModel


class _Energy(Sensor):
    """A sensor with one output in joules."""

    units = (("", "J"),)


@frozen()
class KineticEnergy(_Energy):
    """The kinetic energy ½ vᵀ M v of all bodies [J]."""

    def rows(self, model: SensorModel) -> Sequence[Form]:
        row, mass = model.state.velocity, model.mass
        return [
            Form({(row + i, row + j, None): (0.5 if i == j else 1.0) * m
                  for (i, j), m in mass.items()})
        ]  # fmt: skip


@frozen()
class ElasticEnergy(_Energy):
    """The elastic energy of all beams, cables, springs and torsion springs [J]."""

    def rows(self, model: SensorModel) -> Sequence[Form]:
        return [Form.variable(model.state.energy)]


@frozen()
class PotentialEnergy(_Energy):
    """The potential energy of all loads that have one [J]; for gravity it is 0 at the origin."""

    def rows(self, model: SensorModel) -> Sequence[Form]:
        return [sum((entries.potential for entries in model.entries.values()), Form({}))]


@frozen()
class Work(_Energy):
    """The work ∫ Q dq that a load, joint or drive has done on the mechanism since the start [J].

    It is integrated by the trapezoidal rule over the steps. An impulse, where the speed of a
    prescribed motion jumps, does its work with the mean of the velocities before and after. If a
    joint and a load have the same name, the joint is meant.
    """

    part: str

    def rows(self, model: SensorModel) -> Sequence[Form]:
        pairs = model.generalized_force(self.part)
        rates = [Form({})] * len(pairs)
        if self.part in model.joints:
            rates = [_rate_in_impulse(variable, model) for _, variable in pairs]
        return [force for force, _ in pairs] + [variable for _, variable in pairs] + rates

    def derive(self, rows: np.ndarray, model: SensorModel) -> np.ndarray:
        force, moved, rate = np.split(rows, 3)
        steps = 0.5 * (force[:, 1:] + force[:, :-1]) * np.diff(moved, axis=1)
        steps += force[:, 1:] * rate[:, 1:]
        work = np.zeros((1, *rows.shape[1:]))
        np.cumsum(steps.sum(axis=0), axis=0, out=work[0, 1:])
        return work


def _rate_in_impulse(variable: Form, model: SensorModel) -> Form:
    """Return the rate of a coordinate while an impulse acts; joints of angles do no work then."""
    _, row, _ = next(iter(variable.terms))
    if row > model.state.coordinates:
        return Form({})
    return variable.shifted(model.state.velocity) * Form.function(during_impulse)
