"""A door that hits its stop: a user-defined force law.

Seen from above, a door swings against a rubber buffer. The buffer pushes only while it is
compressed, with the contact force of Hunt and Crossley. The force law is a Python function that
Numba compiles.
"""

import numpy as np

import flexband as fb

DOOR, REACH = 0.9, 0.8  # m: width of the door, distance of the buffer from the hinge
STIFFNESS, DISSIPATION = 4e5, 0.5  # N/m^1.5, s/m: buffer
SPEED = 1.5  # rad/s: initial speed
OPEN = 0.6  # rad: initial angle from the buffer


def buffer(t, x, v, p, force):
    """Set the force on the contact point x[0] of the door; the buffer's face is at Y = 0."""
    pressed = -x[0, 1]
    if pressed > 0.0:
        push = p[0] * pressed**1.5 * (1.0 - p[1] * v[0, 1])
        force[0, 1] = max(push, 0.0)


def door():
    leaf = fb.RigidBody.block(
        length=DOOR, height=0.04, width=2.0, density=500.0, angle=OPEN, rate=-SPEED,
        position=(DOOR / 2 * np.cos(OPEN), DOOR / 2 * np.sin(OPEN)),
        points={"hinge": (-DOOR / 2, 0.0), "edge": (DOOR / 2, 0.0),
                "contact": (REACH - DOOR / 2, 0.0)},
        velocity=(SPEED * DOOR / 2 * np.sin(OPEN), -SPEED * DOOR / 2 * np.cos(OPEN)),
    )  # fmt: skip
    return fb.Mechanism(
        bodies={"door": leaf},
        joints={"hinge": fb.Revolute("door.hinge", (0.0, 0.0))},
        loads={
            "buffer": fb.ForceLaw(["door.contact", (REACH, 0.0)], buffer, [STIFFNESS, DISSIPATION])
        },
        sensors={
            "angle": fb.Angle("door"),
            "rate": fb.AngularVelocity("door"),
            "hinge": fb.Reaction("hinge"),
        },
    )


def motion():
    return fb.simulate(door(), duration=1.0, step=2e-4)


def picture(drawing, plot):
    fb.draw(door(), axes=drawing)
    result = motion()
    plot.plot(result.time, result.sel(output="angle"), color="#1f78b4", label="angle [rad]")
    plot.plot(result.time, result.sel(output="rate"), color="#d95f02", label="rate [rad/s]")
    plot.axhline(0.0, color="0.6", linewidth=0.8)
    plot.set(xlabel="time [s]")
    plot.legend()
