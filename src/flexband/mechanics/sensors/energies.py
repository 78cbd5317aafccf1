"""Sensors of energy and work: of the whole mechanism, and of one of its parts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from flexband.mechanics.forms import Form
from flexband.mechanics.loads.force_laws import TorsionSpring
from flexband.mechanics.loads.loads import Spring
from flexband.mechanics.sensors.forces import SpringForce, SpringMoment
from flexband.mechanics.sensors.motion import Model, Plain


class _Energy:
    """A sensor with one output in joules."""

    def outputs(self) -> list[tuple[str, str]]:
        """Return one output in joules."""
        return [("", "J")]


@dataclass(frozen=True)
class KineticEnergy(_Energy, Plain):
    """The kinetic energy of all bodies [J]."""

    def rows(self, model: Model) -> Sequence[Form]:
        """Return ½ vᵀ M v."""
        return [model.kinetic_energy()]


@dataclass(frozen=True)
class ElasticEnergy(_Energy):
    """The elastic energy of all beams, cables, springs and torsion springs [J]."""

    def rows(self, model: Model) -> Sequence[Form]:
        """Return it, as the engine finds it, and what `SpringMoment` asks of torsion springs."""
        springs = [SpringMoment(name).rows(model) for name in model.torsion_springs()]
        return [model.elastic_energy(), *(form for rows in springs for form in rows)]

    def derive(self, rows: np.ndarray, model: Model) -> np.ndarray:
        """Return the sum, with ½ k φ² + ¼ k₃ φ⁴ from rest of the torsion springs."""
        total, names = rows[0].copy(), model.torsion_springs()
        for name, own in zip(names, np.split(rows[1:], len(names) or 1), strict=False):
            away = SpringMoment(name).away(own) ** 2
            total += 0.5 * own[8] * away + 0.25 * own[11] * away**2
        return total[None]


@dataclass(frozen=True)
class PotentialEnergy(_Energy, Plain):
    """The potential energy of all bodies in the fields of gravity [J], zero at the origin."""

    def rows(self, model: Model) -> Sequence[Form]:
        """Return −∫ρ g · r dV."""
        return [model.potential_energy()]


@dataclass(frozen=True)
class Work(_Energy):
    """The work that a load, joint or drive has done on the mechanism since the start [J].

    It is summed by the trapezoidal rule over the steps. Where names of joints and loads are the
    same, the joint is meant.
    """

    part: str

    def rows(self, model: Model) -> Sequence[Form]:
        """Return generalized forces and their coordinates, or force and length of a spring.

        Raises
        ------
        InputError
            Where there is no such part.
        """
        spring = self._spring(model)
        if spring is not None:
            return spring.rows(model)
        force = model.generalized_force(self.part)
        return [*force.values(), *map(Form.variable, force)]

    def _spring(self, model: Model) -> SpringForce | SpringMoment | None:
        """Return the sensor of a spring's force or moment, None where it is none."""
        load = model.load(self.part)
        if isinstance(load, Spring):
            return SpringForce(self.part)
        return SpringMoment(self.part) if isinstance(load, TorsionSpring) else None

    def derive(self, rows: np.ndarray, model: Model) -> np.ndarray:
        """Return Σ ∫ Q dq."""
        spring = self._spring(model)
        if spring is not None:
            pull, moved = spring.derive(rows, model)[:, None]
            force = -pull if isinstance(spring, SpringForce) else pull
        else:
            force, moved = np.split(rows, 2)
        steps = 0.5 * (force[:, 1:] + force[:, :-1]) * np.diff(moved, axis=1)
        work = np.zeros((1, *rows.shape[1:]))
        np.cumsum(steps.sum(axis=0), axis=0, out=work[0, 1:])
        return work
