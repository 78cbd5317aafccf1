"""A double pendulum in Exudyn.

Two rigid bars swing under gravity. Exudyn simulates one sample at a time, so `fb.models.samplewise`
makes a response of it. The length of the second bar is an interval, the friction of the lower hinge
is not known well. Exudyn is needed: ``pip install exudyn``.
"""

import exudyn as exu
import numpy as np
import xarray as xr
from exudyn import itemInterface as interface  # noqa: N813

import flexband as fb

LENGTH, DENSITY = 0.4, 1.5  # m, kg/m
DURATION, STEP = 1.0, 1e-3  # s


def double_pendulum(second_length, friction):
    """Return the angles of both bars [rad], from hanging at rest to the side; friction [N m s]."""
    container = exu.SystemContainer()
    system = container.AddSystem()
    previous_body = system.AddObject(interface.ObjectGround())
    end, sensors = [0, 0, 0], []
    for length in (LENGTH, second_length):
        centre = [end[0] + length / 2, 0, 0]
        node = system.AddNode(interface.NodeRigidBody2D(referenceCoordinates=centre))
        mass = DENSITY * length
        bar = system.AddObject(
            interface.ObjectRigidBody2D(nodeNumber=node, mass=mass, inertia=mass * length**2 / 12)
        )
        middle = system.AddMarker(interface.MarkerBodyMass(bodyNumber=bar))
        system.AddLoad(
            interface.LoadMassProportional(markerNumber=middle, loadVector=[0, -9.81, 0])
        )
        ends = [
            (previous_body, end if not sensors else [LENGTH / 2, 0, 0]),
            (bar, [-length / 2, 0, 0]),
        ]
        pins = [system.AddMarker(interface.MarkerBodyPosition(bodyNumber=b, localPosition=x))
                for b, x in ends]  # fmt: skip
        system.AddObject(interface.ObjectJointRevolute2D(markerNumbers=pins))
        if sensors:
            turns = [system.AddMarker(interface.MarkerNodeCoordinate(nodeNumber=n, coordinate=2))
                     for n in (node - 1, node)]  # fmt: skip
            system.AddObject(
                interface.CoordinateSpringDamper(markerNumbers=turns, damping=friction)
            )
        sensors.append(
            system.AddSensor(
                interface.SensorNode(
                    nodeNumber=node, storeInternal=True,
                    outputVariableType=exu.OutputVariableType.Coordinates,
                )
            )
        )  # fmt: skip
        previous_body, end = bar, [end[0] + length, 0, 0]
    system.Assemble()
    settings = exu.SimulationSettings()
    settings.timeIntegration.numberOfSteps = round(DURATION / STEP)
    settings.timeIntegration.endTime = DURATION
    settings.timeIntegration.verboseMode = 0
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
    settings.solution.file.write = False
    settings.solution.sensors.writePeriod = 10 * STEP
    system.SolveDynamic(settings)
    records = np.stack([system.GetSensorStoredData(number)[:, [0, 3]] for number in sensors])
    return xr.DataArray(
        records[..., 1],
        dims=("output", "time"),
        coords={"output": ["first", "second"], "unit": ("output", ["rad", "rad"]),
                "time": np.round(records[0, :, 0], 9)},
    )  # fmt: skip


response = fb.models.samplewise(double_pendulum)
inputs = {"second_length": fb.Interval(0.29, 0.31), "friction": fb.LogNormal(0.02, 0.004)}
study = fb.Study(response, inputs, fb.AdaptivePCCI(tolerance=0.02))
