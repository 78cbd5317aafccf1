"""Sensors of energy and work: of the whole mechanism, and of one of its parts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexband.arguments import frozen
from flexband.errors import check_instance
from flexband.mechanics.kernels.extremes import KINDS
from flexband.mechanics.kernels.forms import Form, during_impulse
from flexband.mechanics.sensors.extremes import OverSteps
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
class Work(OverSteps):
    """The work ∫ Q dq that a load, joint or drive has done on the mechanism since the start [J].

    It is integrated by the trapezoidal rule over all steps, in an equilibrium over those on the way
    to it. An impulse, where the speed of a prescribed motion jumps, does its work with the mean of
    the velocities before and after. If a joint and a load have the same name, the joint is meant.
    """

    part: str
    units = (("", "J"),)
    in_equilibrium = True

    def __post_init__(self) -> None:
        check_instance("Work part", self.part, str, "the name of a load or joint")

    @property
    def fixed(self) -> None:
        return None

    def outputs(self) -> list[tuple[str, str]]:
        return list(self.units)

    def watched(self, model: SensorModel) -> list[tuple[Form, int]]:
        kinds = (KINDS.work, KINDS.coordinate)
        pairs = model.generalized_force(self.part)
        return [(form, kind) for pair in pairs for form, kind in zip(pair, kinds, strict=True)]

    def rows(self, model: SensorModel) -> Sequence[Form]:
        pairs = model.generalized_force(self.part) if self.part in model.joints else []
        forces = [force for force, _ in pairs]
        rates = [_rate_in_impulse(coordinate, model) for _, coordinate in pairs]
        return [*model.over_steps(self)[::2], *forces, *rates]

    def derive(self, rows: np.ndarray, model: SensorModel) -> np.ndarray:
        works, impulses = np.split(rows, [len(model.over_steps(self)) // 2])
        force, rate = np.split(impulses, 2)
        return (works.sum(axis=0) + np.cumsum((force * rate).sum(axis=0), axis=0))[None]


def _rate_in_impulse(variable: Form, model: SensorModel) -> Form:
    """Return the rate of a coordinate while an impulse acts; joints of angles do no work then."""
    _, row, _ = next(iter(variable.terms))
    if row > model.state.coordinates:
        return Form({})
    return variable.shifted(model.state.velocity) * Form.function(during_impulse)
