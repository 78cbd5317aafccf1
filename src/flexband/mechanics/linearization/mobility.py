"""The degrees of freedom of a mechanism, and which outputs do not depend on its past."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexband.mechanics.assembly.packing import AT_START, pack
from flexband.mechanics.assembly.system import System, assemble
from flexband.mechanics.engine import redundancy
from flexband.mechanics.engine.batch import begin
from flexband.mechanics.engine.failures import raise_failures
from flexband.mechanics.engine.threads import while_compiling
from flexband.mechanics.kernels.lane_arrays import WIDTH
from flexband.mechanics.model.mechanism import Mechanism


class Mobility(NamedTuple):
    """The first sample of a mechanism at its start."""

    system: System
    z: np.ndarray  # the states of the first samples, (rows, lanes)
    redundant: int  # number of constraints that depend on others
    joints: list[str]  # those that these belong to

    @staticmethod
    def from_mechanism(mechanism: Mechanism) -> Mobility:
        """Return that of a mechanism; raise what `simulate` does about its start."""
        system = assemble(mechanism)
        values = pack(system, AT_START)(0)
        work, failure = while_compiling(lambda: begin(system, values))
        raise_failures(failure.T[: min(system.samples, WIDTH)], system, np.zeros(1))
        return Mobility(system, work.z, *redundancy.dependent(system, work.z[:, 0]))

    @property
    def degrees_of_freedom(self) -> int:
        """The number of coordinates that no constraint determines."""
        coordinates = self.system.structure.state.coordinates
        return coordinates - len(self.system.constraints) + self.redundant


def free_bodies(mechanism: Mechanism) -> list[str]:
    """Return the bodies whose motion no joint prescribes at the start."""
    mobility = Mobility.from_mechanism(mechanism)
    return redundancy.free_bodies(mobility.system, mobility.z[:, 0])


def instantaneous(mechanism: Mechanism) -> list[str]:
    """Return the outputs that follow from the parameters at each instant, whatever was before.

    These are positions, angles and lengths where the motion is prescribed, without gears and the
    like.
    """
    mobility = Mobility.from_mechanism(mechanism)
    holds_start = any(joint.holds_start for joint in mechanism.joints.values())
    if mobility.degrees_of_freedom or holds_start:
        return []
    state = mobility.system.structure.state
    names = []
    for name, sensor in mechanism.sensors.items():
        rows = {i for form in sensor.rows(mechanism.model) for key in form.terms for i in key[:2]}
        if all(i <= state.coordinates or state.angle <= i < state.velocity for i in rows):
            names += [output for output, _ in mechanism.model.outputs[name]]
    return names
