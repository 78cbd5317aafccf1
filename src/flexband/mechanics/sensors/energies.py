"""Sensors of energy and work: of the whole mechanism, and of one of its parts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_instance
from flexband.mechanics.kernels.forms import Form, Polar, during_impulse
from flexband.mechanics.kernels.running_extremes import KINDS
from flexband.mechanics.sensors.motion import Sensor, SensorModel
from flexband.mechanics.sensors.sensor_extremes import OverSteps


class _Energy(Sensor):
    """A sensor with one output in joules."""

    units = (("", "J"),)


@frozen()
class KineticEnergy(_Energy):
    """The kinetic energy ½ vᵀ M v of all bodies [J]."""

    def rows(self, model: SensorModel) -> Sequence[Form]:
        row = model.state.velocity
        mass = model.mass
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

    It is integrated by the trapezoidal rule over all steps. An impulse, where speeds change at
    once, does its work with the mean of the velocities before and after, and that of a drive which
    becomes active with those after. If a joint and a load have the same name, the joint is meant.
    """

    part: str
    units = (("", "J"),)

    def __post_init__(self) -> None:
        check_instance("Work part", self.part, str, "the name of a load or joint")

    @property
    def fixed_window(self) -> None:
        return None

    def outputs(self, model: SensorModel) -> list[tuple[str, str]]:
        return list(self.units)

    def step_forms(self, model: SensorModel) -> list[tuple[Form, int]]:
        kinds = (KINDS.work, KINDS.coordinate)
        pairs = model.generalized_force(self.part)
        return [(form, kind) for pair in pairs for form, kind in zip(pair, kinds, strict=True)]

    def rows(self, model: SensorModel) -> Sequence[Form]:
        if impulses := model.works_of_impulses(self.part):
            return [*model.over_steps(self)[::2], *impulses]
        springs = self.part in model.entries and model.entries[self.part].springs
        in_impulses = self.part in model.joints and not springs
        pairs = model.generalized_force(self.part) if in_impulses else []
        forces = [force for force, _ in pairs]
        rates = [_rate_in_impulse(coordinate, model) for _, coordinate in pairs]
        return [*model.over_steps(self)[::2], *forces, *rates]

    def derive(self, rows: np.ndarray, model: SensorModel) -> np.ndarray:
        works, impulses = np.split(rows, [len(model.over_steps(self)) // 2])
        if model.works_of_impulses(self.part):
            return rows.sum(axis=0)[None]
        force, rate = np.split(impulses, 2)
        return (works.sum(axis=0) + np.cumsum((force * rate).sum(axis=0), axis=0))[None]


@frozen()
class Power(Sensor):
    """The power that a load, joint or drive gives to the mechanism [W].

    It is Q q̇, whose integral over time is `Work`; it is positive for a motor that drives.

    Examples
    --------
    >>> wheel = fb.Mechanism(
    ...     bodies={"wheel": fb.RigidBody(mass=1.0, inertia=2.0)},
    ...     joints={
    ...         "axle": fb.Revolute("wheel", (0.0, 0.0)),
    ...         "motor": fb.PrescribedRotation("wheel", lambda t: 0.15 * t**2),
    ...     },
    ...     sensors={"P": fb.sensors.Power("motor")},
    ... )
    >>> fb.simulate(wheel, duration=1.0, step=0.5).values[0, 1:].round(3)  # [W], J ω̇ ω
    array([0.09, 0.18])
    """

    part: str
    units = (("", "W"),)
    in_equilibrium = False
    in_place = "Work, which is its integral,"

    def rows(self, model: SensorModel) -> Sequence[Form]:
        rows = []
        for force, displacement in model.generalized_force(self.part):
            rows.append(force)
            terms = _polars(displacement, model)
            for polar in terms:
                rows += polar.vector
            vectors = [form for polar in terms for form in polar.vector] or [displacement]
            rows += [form.shift(model.state.velocity) for form in vectors]
        return rows

    def derive(self, rows: np.ndarray, model: SensorModel) -> np.ndarray:
        row_iterator = iter(rows)
        power = np.zeros((1, *rows.shape[1:]))
        for _, displacement in model.generalized_force(self.part):
            force = next(row_iterator)
            terms = _polars(displacement, model)
            vectors = [(next(row_iterator), next(row_iterator)) for _ in terms]
            if not terms:
                power += force * next(row_iterator)
            for polar, (x, y) in zip(terms, vectors, strict=True):
                u = next(row_iterator)
                v = next(row_iterator)
                size = np.hypot(x, y) + 1e-100
                rate = (x * u + y * v) / size if polar.length else (x * v - y * u) / size**2
                power += force * polar.c * rate
        return power


@frozen()
class SwitchingLoss(_Energy):
    """The kinetic energy that a `Switched` joint has taken so far [J], each time it became active.

    It is ½ Δvᵀ M Δv of the plastic impacts. If several joints close at once, it is this joint's
    part: half of its impulses times the speeds that they stop.
    """

    joint: str
    in_equilibrium = False

    def rows(self, model: SensorModel) -> Sequence[Form]:
        return [sum(model.switching_losses(self.joint), Form({}))]


def _polars(displacement: Form, model: SensorModel) -> list[Polar]:
    """Return the terms of a variable that is an angle or an elongation; none of a coordinate."""
    row = max((j for _, j, _ in displacement.terms), default=0)
    return model.polars.get(row, [])


def _rate_in_impulse(variable: Form, model: SensorModel) -> Form:
    """Return the rate of a coordinate while an impulse acts; joints of angles do no work then."""
    _, row, _ = next(iter(variable.terms))
    if row > model.state.coordinates:
        return Form({})
    return variable.shift(model.state.velocity) * Form.function(during_impulse)
