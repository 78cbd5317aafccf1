"""A door that hits a rubber stop.

Seen from above, a door swings against a rubber buffer at the wall, which pushes only while it is
compressed. The door rebounds with 60 % of its speed, and every sample finds its steps: of the
impact, which takes milliseconds, and of the free motion before and after.
"""

import numpy as np

import flexband as fb

DOOR, REACH = 0.9, 0.8  # m: width of the door, distance of the buffer from the hinge
RUBBER = fb.contact.KeepsRestitution(stiffness=4e5, restitution=0.6)  # N/m^1.5
RADIUS = 0.02  # m: of the buffer
SPEED = 1.5  # rad/s: initial speed
OPEN = 0.6  # rad: initial angle from the wall


def door():
    leaf = fb.RigidBody.block(
        length=DOOR, height=0.04, width=2.0, density=500.0, angle=OPEN, rate=-SPEED,
        position=(DOOR / 2 * np.cos(OPEN), DOOR / 2 * np.sin(OPEN)),
        points={"hinge": (-DOOR / 2, 0.0), "face": (REACH - DOOR / 2, 0.0)},
        velocity=(SPEED * DOOR / 2 * np.sin(OPEN), -SPEED * DOOR / 2 * np.cos(OPEN)),
    )  # fmt: skip
    face = fb.contact.CircleOnLine(radius=RADIUS, normal=(0.0, -1.0))
    return fb.Mechanism(
        bodies={"door": leaf},
        joints={"hinge": fb.Revolute("door.hinge", (0.0, 0.0))},
        loads={
            "buffer": fb.contact.Contact((REACH, -RADIUS), "door.face", face, RUBBER),
        },
        sensors={
            "angle": fb.Angle("door"),
            "rate": fb.AngularVelocity("door"),
            "impacts": fb.contact.Contacts("buffer", first=1),
        },
    )


def motion():
    return fb.simulate(door(), duration=1.0, step=5e-3)


def picture(drawing, plot):
    fb.draw(door(), axes=drawing)
    result = motion()
    plot.plot(result.time, result.sel(output="angle"), color="#1f78b4", label="angle [rad]")
    plot.plot(result.time, result.sel(output="rate"), color="#d95f02", label="rate [rad/s]")
    plot.axhline(0.0, color="0.6", linewidth=0.8)
    plot.set(xlabel="time [s]")
    plot.legend()
