"""A robot arm in space, in Exudyn.

A column turns about the vertical, an upper arm and a forearm about horizontal axes; the three
motors hold their targets as springs and dampers do. flexband has no mechanisms in space, but
studies any model that is a function of its inputs: the mass in the gripper is not known well, the
length of the upper arm and the stiffness of the elbow are intervals. Exudyn is needed:
``pip install exudyn``.
"""

import exudyn as exu
import numpy as np
import xarray as xr
from exudyn.itemInterface import SensorNode
from exudyn.rigidBodyUtilities import InertiaCuboid

import flexband as fb

WIDTH, DENSITY, FOREARM = 0.04, 2700.0, 0.4  # m, kg/m³, m
TARGETS = (1.0, 0.5, -0.8)  # rad, from an arm that points along x
STIFFNESS, DAMPING = (400.0, 600.0), (15.0, 20.0, 4.0)  # N m/rad, N m s/rad
DURATION, STEP = 0.5, 5e-4  # s


def robot_arm(payload, upper_length, elbow_stiffness):
    """Return the position of the gripper [m] over time; mass [kg], length [m], stiffness [N m]."""
    container = exu.SystemContainer()
    system = container.AddSystem()
    down, z, y = [0.0, 0.0, -9.81], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]
    before, x = system.CreateGround(), 0.0
    lengths = (WIDTH, upper_length, FOREARM)
    stiffness = (*STIFFNESS, elbow_stiffness)
    for k, (length, axis) in enumerate(zip(lengths, (z, y, y), strict=True)):
        center = [x + length / 2 if k else 0.0, 0.0, 0.0]
        link = system.CreateRigidBody(
            referencePosition=center,
            inertia=InertiaCuboid(DENSITY, [length, WIDTH, WIDTH]),
            gravity=down,
        )
        joint = {"itemNumbers": [before, link], "position": [x, 0.0, 0.0], "axis": axis}
        system.CreateRevoluteJoint(**joint)
        system.CreateTorsionalSpringDamper(
            **joint, stiffness=stiffness[k], damping=DAMPING[k], offset=TARGETS[k]
        )
        before, x = link, x + length if k else 0.0
    load = system.CreateMassPoint(referencePosition=[x, 0.0, 0.0], mass=payload, gravity=down)
    system.CreateSphericalJoint(itemNumbers=[before, load], position=[x, 0.0, 0.0])
    sensor = system.AddSensor(
        SensorNode(
            nodeNumber=system.GetObject(load)["nodeNumber"],
            storeInternal=True,
            outputVariableType=exu.OutputVariableType.Position,
        )
    )
    system.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = round(DURATION / STEP)
    settings.timeIntegration.endTime = DURATION
    settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = 10 * STEP
    system.SolveDynamic(settings)
    stored = system.GetSensorStoredData(sensor)
    return xr.DataArray(
        stored[:, 1:].T,
        dims=("output", "time"),
        coords={
            "output": ["x", "y", "z"],
            "unit": ("output", ["m"] * 3),
            "time": np.round(stored[:, 0], 9),
        },
    )


response = fb.models.samplewise(robot_arm)
inputs = {
    "payload": fb.Normal(1.0, 0.05),
    "upper_length": fb.Interval(0.495, 0.505),
    "elbow_stiffness": fb.Interval(90.0, 110.0),
}
study = fb.Study(response, inputs, fb.AdaptivePCCI(tolerance=0.02))
