"""The quick-return mechanism of a shaper.

A pin on the crank slides in the slot of a lever, and a rod joins the lever to the ram. The ram
returns faster than it cuts. The ratio depends only on the length and the position of the crank.
"""

import numpy as np

import flexband as fb

CRANK, PIVOT = 0.1, 0.25  # m: crank, and height of its bearing above the lever's
LEVER, ROD = 0.5, 0.22  # m
RAM = 0.52  # m: height of its guide
SPEED = 2 * np.pi  # rad/s: one turn per second
STEEL = {"height": 0.03, "width": 0.02, "density": 7800.0}  # m, m, kg/m³


def quick_return():
    lean = np.arctan2(PIVOT, CRANK)
    return fb.Mechanism(
        bodies={
            "crank": fb.RigidBody.bar(length=CRANK, start=(0.0, PIVOT), **STEEL),
            "lever": fb.RigidBody.bar(length=LEVER, angle=lean, **STEEL),
            "rod": fb.RigidBody.bar(length=ROD, start=(0.2, 0.47), angle=0.2, **STEEL),
            "ram": fb.RigidBody.block(
                length=0.3, height=0.08, width=0.08, density=7800.0, position=(0.4, RAM)
            ),
        },
        joints={
            "A": fb.Revolute("crank.start", (0.0, PIVOT)),
            "O": fb.Revolute("lever.start", (0.0, 0.0)),
            "slot": fb.Slot("crank.end", "lever.start"),
            "B": fb.Revolute("rod.start", "lever.end"),
            "C": fb.Revolute("rod.end", "ram"),
            "guide": fb.Prismatic("ram", (0.0, RAM)),
            "motor": fb.PrescribedRotation("crank", lambda t: SPEED * t),
        },
        loads={"friction": fb.ViscousFriction("ram", (0.8, RAM), 200.0)},  # N s/m
        sensors={"ram": fb.Velocity("ram"), "lever": fb.Angle("lever"),
                 "torque": fb.ReactionMoment("motor")},
    )  # fmt: skip


def motion():
    return fb.simulate(quick_return(), duration=2.0, step=1e-3)


def picture(drawing, plot):
    fb.draw(quick_return(), axes=drawing, dimensions=False)
    result = motion()
    plot.plot(result.time, result.sel(output="ram_X"), color="#1f78b4")
    plot.set(xlabel="time [s]", ylabel="velocity of the ram [m/s]")
    plot.axhline(0.0, color="0.6", linewidth=0.8)
