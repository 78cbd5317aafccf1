"""A four-bar linkage in space with a flexible coupler, in Exudyn.

A motor of constant torque turns a crank with a flywheel about the vertical. A thin rod, which hangs
in ball joints, leads its motion to a rocker that swings about a horizontal axis. The rod's length
is an interval, its Young's modulus is not known well. Exudyn is needed: ``pip install exudyn``.
"""

import exudyn as exu
import numpy as np
import xarray as xr
from exudyn.beams import GenerateBeamElementsAlongLine
from exudyn.itemInterface import (
    MarkerBodyPosition,
    MarkerNodePosition,
    ObjectANCFCable,
    SensorNode,
    SphericalJoint,
)
from exudyn.rigidBodyUtilities import RigidBodyInertia

import flexband as fb

CRANK, ROCKER, PIVOT = 0.06, 0.2, np.array([0.1, 0.3, 0.0])  # m
TORQUE, FLYWHEEL = 1.0, 0.01  # N m, kg m²
RADIUS, DENSITY, RETARDATION = 3e-3, 1200.0, 2e-3  # m, kg/m³, s, of the rod
DURATION, STEP = 0.6, 5e-4  # s


def rocker_angle(crank_angle, length):
    """Return the angle of the rocker if the rod is rigid, from Y to Z [rad]."""
    tip = CRANK * np.array([np.cos(crank_angle), np.sin(crank_angle), 0 * crank_angle])
    separation = PIVOT.reshape((3,) + (1,) * np.ndim(crank_angle)) - tip
    size = np.hypot(separation[1], separation[2])
    cosine = (length**2 - (separation**2).sum(0) - ROCKER**2) / (2 * ROCKER * size)
    return np.arctan2(separation[2], separation[1]) + np.arccos(cosine)


def four_bar(length, youngs_modulus, elements=6):
    """Return both angles [rad] and how far the rod's middle is above its chord [m], over time."""
    container = exu.SystemContainer()
    system = container.AddSystem()
    ground, down = system.CreateGround(), [0.0, 0.0, -9.81]
    angle = rocker_angle(0.0, length)
    ends = [[CRANK, 0.0, 0.0], [*(PIVOT + ROCKER * np.array([0, np.cos(angle), np.sin(angle)]))]]
    crank = system.CreateRigidBody(inertia=RigidBodyInertia(1.0, np.diag([0.01, 0.01, FLYWHEEL])))
    rocker = system.CreateRigidBody(
        referencePosition=list(PIVOT),
        inertia=RigidBodyInertia(0.1, np.diag([1e-3, 1e-4, 1e-3])),
    )
    system.CreateRevoluteJoint(itemNumbers=[ground, crank], position=[0, 0, 0], axis=[0, 0, 1])
    system.CreateRevoluteJoint(itemNumbers=[ground, rocker], position=list(PIVOT), axis=[1, 0, 0])
    system.CreateTorque(itemNumber=crank, loadVector=[0.0, 0.0, TORQUE])
    area = np.pi * RADIUS**2
    bending = youngs_modulus * area * RADIUS**2 / 4
    cable = ObjectANCFCable(
        massPerLength=DENSITY * area,
        axialStiffness=youngs_modulus * area,
        bendingStiffness=bending,
        bendingDamping=RETARDATION * bending,
    )
    rod = GenerateBeamElementsAlongLine(system, *ends, elements, cable, gravity=down)
    nodes = rod["nodes"]
    for node, body, place in (
        (nodes[0], crank, ends[0]),
        (nodes[-1], rocker, list(np.array(ends[1]) - PIVOT)),
    ):
        markers = [
            system.AddMarker(MarkerNodePosition(nodeNumber=node)),
            system.AddMarker(MarkerBodyPosition(bodyNumber=body, localPosition=place)),
        ]
        system.AddObject(SphericalJoint(markerNumbers=markers))
    sensors = [
        system.AddSensor(
            SensorNode(
                nodeNumber=node,
                storeInternal=True,
                outputVariableType=exu.OutputVariableType.Position,
            )
        )
        for node in (nodes[0], nodes[elements // 2], nodes[-1])
    ]
    system.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = round(DURATION / STEP)
    settings.timeIntegration.endTime = DURATION
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.7
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = 10 * STEP
    system.SolveDynamic(settings)
    first, middle, last = (system.GetSensorStoredData(sensor)[:, 1:] for sensor in sensors)
    arm, chord = last - PIVOT, (last - first) / np.linalg.norm(last - first, axis=1)[:, None]
    off = middle - first
    rows = [
        np.unwrap(np.arctan2(first[:, 1], first[:, 0])),
        np.arctan2(arm[:, 2], arm[:, 1]),
        off[:, 2] - (off * chord).sum(1) * chord[:, 2],
    ]
    return xr.DataArray(
        rows,
        dims=("output", "time"),
        coords={
            "output": ["crank", "rocker", "deflection"],
            "unit": ("output", ["rad", "rad", "m"]),
            "time": np.round(system.GetSensorStoredData(sensors[0])[:, 0], 9),
        },
    )


response = fb.models.samplewise(four_bar)
inputs = {
    "length": fb.Interval(0.298, 0.302),
    "youngs_modulus": fb.Normal(3e9, 0.15e9),
}
study = fb.Study(response, inputs, fb.AdaptivePCCI(tolerance=0.05))
