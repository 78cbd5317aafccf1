"""Mechanisms of any size, in flexband and in Exudyn: a flexible pendulum and a chain of loops.

The pendulum is the soft one of the tests: 0.5 m long, 2 mm high, released from the horizontal. A
chain of n parallelograms has n + 1 flexible rods of two elements, which hang from the ground, and n
rigid bars between the ends of adjacent rods. It starts at 0.5 rad from the vertical.
"""

from __future__ import annotations

import time
from itertools import pairwise

import numpy as np

import flexband as fb
from benchmarks.speed import peer_exudyn as peer

LENGTH = 0.5
HEIGHT = 0.002
WIDTH = 0.01
DENSITY = 1000.0
MODULUS = 1e8
NU = 0.3
LEAN = 0.5
ROD_ELEMENTS = 2


def _rod(modulus, elements: int, start, angle: float) -> fb.Beam:
    return fb.Beam(
        length=LENGTH, height=HEIGHT, width=WIDTH, density=DENSITY, youngs_modulus=modulus,
        poissons_ratio=NU, elements=elements, start=start, angle=angle,
        integration=fb.sections.SelectiveIntegration(),  # the element of the peers
    )  # fmt: skip


def pendulum(elements: int, modulus=MODULUS) -> fb.Mechanism:
    """Return the pendulum; `modulus` is a number, or an array with one value per sample."""
    return fb.Mechanism(
        bodies={"rod": _rod(modulus, elements, (0.0, 0.0), 0.0)},
        joints={"hinge": fb.Revolute("rod.start", (0.0, 0.0))},
        loads={"gravity": fb.Gravity()},
        sensors={"tip": fb.Position("rod.end")},
    )


def parallelograms(loops: int, modulus=MODULUS) -> fb.Mechanism:
    """Return the chain; `modulus` is a number, or an array with one value per sample."""
    down = LEAN - np.pi / 2
    x = LENGTH * np.cos(down)
    y = LENGTH * np.sin(down)
    bodies = {}
    joints = {}
    for k in range(loops + 1):
        bodies[f"rod{k}"] = _rod(modulus, ROD_ELEMENTS, (float(k), 0.0), down)
        joints[f"ground{k}"] = fb.Revolute(f"rod{k}.start", (float(k), 0.0))
    for k in range(loops):
        bodies[f"bar{k}"] = fb.RigidBody.bar(
            length=1.0, height=HEIGHT, width=WIDTH, density=DENSITY, start=(k + x, y)
        )
        joints[f"left{k}"] = fb.Revolute(f"bar{k}.start", f"rod{k}.end")
        joints[f"right{k}"] = fb.Revolute(f"bar{k}.end", f"rod{k + 1}.end")
    return fb.Mechanism(
        bodies=bodies,
        joints=joints,
        loads={"gravity": fb.Gravity()},
        sensors={"tip": fb.Position("rod0.end")},
    )


class _Model:
    """An Exudyn system with cables and bars under gravity."""

    def __init__(self, modulus: float):
        exu = peer._exudyn()
        from exudyn import itemInterface as interface  # noqa: N813, PLC0415

        self.interface = interface
        self.modulus = modulus
        self.container = exu.SystemContainer()
        self.mbs = self.container.AddSystem()
        self.ground = self.mbs.AddObject(interface.ObjectGround())

    def rod(self, start, angle: float, elements: int) -> tuple[int, int]:
        """Add cables and return the markers of both ends."""
        interface = self.interface
        mbs = self.mbs
        element_length = LENGTH / elements
        direction = np.array([np.cos(angle), np.sin(angle)])
        nodes = [
            mbs.AddNode(
                interface.NodePoint2DSlope1(
                    referenceCoordinates=[
                        *(np.asarray(start) + k * element_length * direction),
                        *direction,
                    ]
                )
            )
            for k in range(elements + 1)
        ]
        area = HEIGHT * WIDTH
        for pair in pairwise(nodes):
            cable = mbs.AddObject(
                interface.Cable2D(
                    physicsLength=element_length,
                    physicsMassPerLength=DENSITY * area,
                    physicsBendingStiffness=self.modulus * area * HEIGHT**2 / 12,
                    physicsAxialStiffness=self.modulus * area,
                    nodeNumbers=list(pair),
                )
            )
            self._weigh(interface.MarkerBodyMass(bodyNumber=cable))
        ends = (nodes[0], nodes[-1])
        start, end = (mbs.AddMarker(interface.MarkerNodePosition(nodeNumber=n)) for n in ends)
        self.tip = nodes[-1]
        return start, end

    def bar(self, start, length: float) -> tuple[int, int]:
        """Add a horizontal rigid bar and return the markers of both ends."""
        interface = self.interface
        mbs = self.mbs
        mass = DENSITY * HEIGHT * WIDTH * length
        node = mbs.AddNode(
            interface.NodeRigidBody2D(referenceCoordinates=[start[0] + length / 2, start[1], 0])
        )
        inertia = mass * (length**2 + HEIGHT**2) / 12
        body = mbs.AddObject(
            interface.ObjectRigidBody2D(physicsMass=mass, physicsInertia=inertia, nodeNumber=node)
        )
        self._weigh(interface.MarkerBodyMass(bodyNumber=body))
        first_end, second_end = (
            mbs.AddMarker(interface.MarkerBodyPosition(bodyNumber=body, localPosition=[x, 0, 0]))
            for x in (-length / 2, length / 2)
        )
        return first_end, second_end

    def _weigh(self, marker) -> None:
        self.mbs.AddLoad(
            self.interface.LoadMassProportional(
                markerNumber=self.mbs.AddMarker(marker), loadVector=[0, -9.81, 0]
            )
        )

    def pin(self, first: int, second: int | None = None, place=(0.0, 0.0)) -> None:
        """Join two markers, or one marker and a point of the ground."""
        if second is None:
            second = self.mbs.AddMarker(
                self.interface.MarkerBodyPosition(bodyNumber=self.ground, localPosition=[*place, 0])
            )
        self.mbs.AddObject(self.interface.ObjectJointRevolute2D(markerNumbers=[second, first]))


def _peer_pendulum(elements: int, modulus: float) -> _Model:
    model = _Model(modulus)
    start, _ = model.rod((0.0, 0.0), 0.0, elements)
    model.pin(start)
    return model


def _peer_parallelograms(loops: int, modulus: float) -> _Model:
    model = _Model(modulus)
    down = LEAN - np.pi / 2
    ends = []
    tips = []
    for k in range(loops + 1):
        start, end = model.rod((float(k), 0.0), down, ROD_ELEMENTS)
        model.pin(start, place=(float(k), 0.0))
        ends.append(end)
        tips.append(model.tip)
    for k in range(loops):
        first_end, second_end = model.bar((k + LENGTH * np.cos(down), LENGTH * np.sin(down)), 1.0)
        model.pin(first_end, ends[k])
        model.pin(second_end, ends[k + 1])
    model.tip = tips[0]
    return model


PEERS = {"pendulum": _peer_pendulum, "parallelograms": _peer_parallelograms}
OURS = {"pendulum": pendulum, "parallelograms": parallelograms}


def peer_run(kind: str, size: int, repeats: int, steps: int, step: float, setting: str) -> dict:
    """Return the seconds per run of Exudyn's solver and the final position of the tip."""
    total = 0.0
    for _ in range(repeats):
        model = PEERS[kind](size, MODULUS)
        model.mbs.Assemble()
        simulation_settings = peer.settings(steps * step, step, 0.7, *peer.SETTINGS[setting])
        begin = time.perf_counter()
        model.mbs.SolveDynamic(simulation_settings)
        total += time.perf_counter() - begin
    position = peer._exudyn().OutputVariableType.Position
    tip = model.mbs.GetNodeOutput(model.tip, position)[:2]
    return {"seconds": total / repeats, "tip": [float(x) for x in tip]}


if __name__ == "__main__":  # a separate process, so that a failure does not affect others
    import json
    import sys

    kind, size, repeats, steps, step, setting = json.loads(sys.argv[1])
    print(json.dumps(peer_run(kind, size, repeats, steps, step, setting)))
