"""A brake that squeals.

A piston presses a pad against a disc that turns. Friction couples the motion of the pad along the
disc with that across it. With more friction the frequencies of the two modes come together. From
where they meet, one of them grows: the brake squeals.
"""

import numpy as np

import flexband as fb

MASS, FORCE, RADIUS, RATE = 0.2, 400.0, 0.12, 30.0  # kg, N, m, rad/s
LINING = fb.contact.KeepsRestitution(stiffness=1.1e7, exponent=1.0)  # N/m
SUPPORTS = {"left": (150.0, 1.1e7), "right": (30.0, 2.0e7)}  # angle [°] and stiffness [N/m]
LENGTH = 0.05  # m


def brake(friction):
    top = RADIUS - FORCE / LINING.stiffness  # of a pad that the force presses into its lining

    def support(angle, stiffness):
        x, y = LENGTH * np.cos(np.deg2rad(angle)), LENGTH * np.sin(np.deg2rad(angle))
        return fb.Spring("pad", (x, top + y), stiffness, LENGTH)

    return fb.Mechanism(
        bodies={
            "disc": fb.RigidBody(mass=5.0, inertia=0.03),
            "pad": fb.PointMass(mass=MASS, position=(0.0, top)),
        },
        joints={
            "axle": fb.Revolute("disc", (0.0, 0.0)),
            "motor": fb.PrescribedRotation("disc", lambda t: RATE * np.asarray(t)),
        },
        loads={
            "lining": fb.contact.Contact(
                "pad", "disc", fb.contact.CircleOnCircle(radii=(0.0, RADIUS)), LINING,
                closed_at_start=True, friction=friction,
            ),
            "piston": fb.Force("pad", 0.0, -FORCE),
        } | {name: support(*numbers) for name, numbers in SUPPORTS.items()},
        sensors={"pad": fb.Position("pad")},
    )  # fmt: skip


def modes(friction):
    return fb.modes(brake(friction), 2, about="sliding")


def picture(drawing, plot):
    fb.draw(brake(0.4), axes=drawing)
    friction = np.linspace(0.0, 1.0, 51)
    result = modes(friction)
    plot.plot(friction, np.sort(result.frequency, axis=1) / 1e3, "C0", label="frequencies [kHz]")
    plot.plot(friction, result.eigenvalue.real.max("mode") / 1e3, "C3", label="growth [1/ms]")
    plot.set(xlabel="friction coefficient")
    handles, labels = plot.get_legend_handles_labels()
    plot.legend(handles[1:], labels[1:])
