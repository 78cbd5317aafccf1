"""The slider–crank in Exudyn: three ANCFCable2D elements, rigid bodies, drive at velocity level.

Everything that takes time apart from the simulation is switched off: file output, statistics and,
in `seconds`, sensors. The beam is thin, so the missing shear of the cable has no effect; its
bending stiffness is that of the plain plane-stress element, EI/(1−ν²).
"""

from __future__ import annotations

import sys
import time
import warnings
from importlib.util import find_spec
from itertools import pairwise

import numpy as np

AVAILABLE = find_spec("exudyn") is not None
LINK = 0.45
SIDE = 0.01
SPEED = 4 * np.pi
SETTINGS = {
    "modified Newton, dense": (True, True),
    "modified Newton, sparse": (True, False),
    "full Newton, dense": (False, True),
    "full Newton, sparse": (False, False),
}


def _exudyn():
    sys.exudynFast = True  # type: ignore[attr-defined]  # the build without range checks
    import exudyn  # noqa: PLC0415

    return exudyn


def build(crank_length: float, spring_stiffness: float, youngs_modulus: float, nu: float):
    """Return the container, the system, and its joint A, crank node and slider node."""
    exu = _exudyn()
    from exudyn import itemInterface as interface  # noqa: N813, PLC0415

    container = exu.SystemContainer()
    mbs = container.AddSystem()

    def at_body(body, x=0.0):
        return mbs.AddMarker(interface.MarkerBodyPosition(bodyNumber=body, localPosition=[x, 0, 0]))

    def of_node(node, coordinate):
        return mbs.AddMarker(interface.MarkerNodeCoordinate(nodeNumber=node, coordinate=coordinate))

    def pin(first, second):
        return mbs.AddObject(interface.ObjectJointRevolute2D(markerNumbers=[first, second]))

    def rigid(x, velocities, mass, inertia):
        node = mbs.AddNode(
            interface.NodeRigidBody2D(referenceCoordinates=[x, 0, 0], initialVelocities=velocities)
        )
        body = interface.ObjectRigidBody2D(
            physicsMass=mass, physicsInertia=inertia, nodeNumber=node
        )
        return node, mbs.AddObject(body)

    # The crank and its drive.
    L = crank_length
    tip = SPEED * crank_length
    ground = mbs.AddObject(interface.ObjectGround())
    ground_marker = of_node(mbs.AddNode(interface.NodePointGround()), 0)
    mass = 7800 * L * SIDE**2
    crank_node, crank = rigid(L / 2, [0, tip / 2, SPEED], mass, mass * (L**2 + SIDE**2) / 12)
    joint = pin(at_body(ground), at_body(crank, -L / 2))
    mbs.AddObject(
        interface.CoordinateConstraint(
            markerNumbers=[ground_marker, of_node(crank_node, 2)], velocityLevel=True, offset=SPEED
        )
    )
    # The link.
    nodes = [
        mbs.AddNode(
            interface.NodePoint2DSlope1(
                referenceCoordinates=[L + LINK * s, 0, 1, 0],
                initialVelocities=[0, tip * (1 - s), 0, -tip / LINK],
            )
        )
        for s in np.linspace(0, 1, 4)
    ]
    for pair in pairwise(nodes):
        mbs.AddObject(
            interface.Cable2D(
                physicsLength=LINK / 3,
                physicsMassPerLength=2700 * SIDE**2,
                physicsBendingStiffness=youngs_modulus * SIDE**4 / 12 / (1 - nu**2),
                physicsAxialStiffness=youngs_modulus * SIDE**2,
                nodeNumbers=list(pair),
            )
        )
    ends = [
        mbs.AddMarker(interface.MarkerNodePosition(nodeNumber=n)) for n in (nodes[0], nodes[-1])
    ]
    pin(at_body(crank, L / 2), ends[0])
    # The slider and its spring.
    mass = 7800 * 0.08 * 0.08 * 0.2
    slider_node, slider = rigid(L + LINK, [0, 0, 0], mass, mass * 0.08**2 / 6)
    pin(at_body(slider), ends[1])
    for coordinate in (1, 2):
        mbs.AddObject(
            interface.CoordinateConstraint(
                markerNumbers=[ground_marker, of_node(slider_node, coordinate)]
            )
        )
    mbs.AddObject(
        interface.CoordinateSpringDamper(
            markerNumbers=[ground_marker, of_node(slider_node, 0)], stiffness=spring_stiffness
        )
    )
    return container, mbs, joint, crank_node, slider_node


def settings(duration: float, step: float, radius: float, modified: bool, dense: bool):
    """Return simulation settings without any output."""
    exu = _exudyn()
    simulation_settings = exu.SimulationSettings()
    simulation_settings.timeIntegration.numberOfSteps = round(duration / step)
    simulation_settings.timeIntegration.endTime = duration
    simulation_settings.timeIntegration.generalizedAlpha.spectralRadius = radius
    simulation_settings.timeIntegration.newton.useModifiedNewton = modified
    simulation_settings.timeIntegration.verboseMode = 0
    simulation_settings.solutionSettings.writeSolutionToFile = False
    simulation_settings.solutionSettings.sensorsWritePeriod = step
    simulation_settings.parallel.numberOfThreads = 1
    kinds = exu.LinearSolverType
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        simulation_settings.linearSolverType = kinds.EXUdense if dense else kinds.EigenSparse
    return simulation_settings


def seconds(parameters: np.ndarray, duration: float, step: float, setting: str) -> float:
    """Return the solver's seconds for runs with these parameters, shape (runs, 4).

    The time to build and assemble the systems is not included.
    """
    total = 0.0
    for row in parameters:
        _container, mbs, *_ = build(*row)
        mbs.Assemble()
        simulation_settings = settings(duration, step, 0.7, *SETTINGS[setting])
        begin = time.perf_counter()
        mbs.SolveDynamic(simulation_settings)
        total += time.perf_counter() - begin
    return total


def motion(row: np.ndarray, duration: float, step: float, radius: float) -> dict[str, np.ndarray]:
    """Return crank centre, slider position and reaction at A over time, each (times, 2)."""
    exu = _exudyn()
    from exudyn import itemInterface as interface  # noqa: N813, PLC0415

    _container, mbs, joint, crank, slider = build(*row)
    kind = exu.OutputVariableType
    sensors = {
        name: mbs.AddSensor(
            interface.SensorNode(
                nodeNumber=node, outputVariableType=kind.Position, storeInternal=True
            )
        )
        for name, node in (("crank", crank), ("slider", slider))
    }
    sensors["F"] = mbs.AddSensor(
        interface.SensorObject(
            objectNumber=joint, outputVariableType=kind.Force, storeInternal=True
        )
    )
    mbs.Assemble()
    mbs.SolveDynamic(settings(duration, step, radius, modified=False, dense=True))
    return {name: mbs.GetSensorStoredData(number)[:, 1:3] for name, number in sensors.items()}
