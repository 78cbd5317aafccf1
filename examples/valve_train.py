"""A valve train whose follower lifts off.

An eccentric cam lifts a flat-faced follower against a spring. Above a certain speed the spring no
longer holds the follower on the cam at the top: it flies and lands. That begins at
ω² = (F₀ + 2ke)/(me), with preload F₀, stiffness k, mass m and eccentricity e. The picture shows
one speed below and one above.
"""

import numpy as np

import flexband as fb

MASS, STIFFNESS, ECCENTRICITY, RADIUS, PRELOAD = 0.5, 2000.0, 0.01, 0.03, 60.0  # SI units
LIFT_OFF = np.sqrt((PRELOAD + 2 * STIFFNESS * ECCENTRICITY) / (MASS * ECCENTRICITY))  # rad/s
SPEEDS = LIFT_OFF * np.array([0.95, 1.1])
FACE = fb.contact.KeepsRestitution(stiffness=1e8, restitution=0.7, exponent=1.0)  # N/m


def valve_train(speed=SPEEDS, law=FACE):
    depth = (PRELOAD + MASS * ECCENTRICITY * speed**2) / law.stiffness  # at the lowest position
    height = RADIUS - ECCENTRICITY - depth
    cam = fb.RigidBody(
        mass=1.0, inertia=1e-3, angle=-np.pi / 2, rate=speed, points={"disc": (ECCENTRICITY, 0.0)}
    )
    face = fb.contact.CircleOnLine(radius=RADIUS, normal=(0.0, -1.0))
    return fb.Mechanism(
        bodies={"cam": cam, "follower": fb.PointMass(mass=MASS, position=(0.0, height))},
        joints={
            "shaft": fb.Revolute("cam", (0.0, 0.0)),
            "motor": fb.PrescribedRotation("cam", lambda t: speed * np.asarray(t) - np.pi / 2),
            "guide": fb.Slot("follower", (0.0, 0.0), axis=(0.0, 1.0)),
        },
        loads={
            "spring": fb.Spring("follower", (0.0, 0.15), stiffness=STIFFNESS,
                                rest_length=0.15 - height + PRELOAD / STIFFNESS),
            "face": fb.contact.Contact("cam.disc", "follower", face, law, closed_at_start=True),
        },
        sensors={
            "force": fb.contact.ContactForce("face"),
            "gap": fb.contact.Gap("face"),
            "landings": fb.contact.Contacts("face", first=1),
        },
    )  # fmt: skip


def motion():
    turn = 2 * np.pi / LIFT_OFF
    return fb.simulate(valve_train(), duration=turn, step=turn / 400)


def picture(drawing, plot):
    fb.draw(valve_train(SPEEDS[:1]), axes=drawing)
    result = motion()
    for n, color in enumerate(("#1f78b4", "#d95f02")):
        label = f"{SPEEDS[n] / LIFT_OFF:.2f} of the speed of lift-off"
        plot.plot(1e3 * result.time, 1e3 * result.sel(output="gap")[n], color=color, label=label)
    plot.set(xlabel="time [ms]", ylabel="gap [mm]")
    plot.legend(loc="upper left")
