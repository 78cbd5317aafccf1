"""A slider–crank with a worn pin.

The crank of a small engine turns at 5000 rpm. The slider's pin has a clearance of 0.05 to 0.2 mm:
it flies through its hole and hits the other side, and the slider's acceleration becomes a series
of impacts. Four clearances are computed together as samples.
"""

import numpy as np

import flexband as fb

CRANK, ROD = 0.05, 0.12  # m
SPEED = 2 * np.pi * 5000 / 60  # rad/s
PIN = fb.contact.LankaraniNikravesh(stiffness=6.61e10, restitution=0.9)  # N/m^1.5
CLEARANCES = np.array([0.05e-3, 0.1e-3, 0.15e-3, 0.2e-3])  # m: hole's radius less the pin's


def engine(clearance=CLEARANCES):
    rod = fb.RigidBody(
        mass=0.21, inertia=2.5e-5, position=(CRANK + ROD / 2, 0.0), rate=-CRANK * SPEED / ROD,
        velocity=(0.0, CRANK * SPEED / 2), points={"crank": (-ROD / 2, 0.0), "pin": (ROD / 2, 0.0)},
    )  # fmt: skip
    return fb.Mechanism(
        bodies={
            "crank": fb.RigidBody(mass=1.0, inertia=1e-3, points={"end": (CRANK, 0.0)}, rate=SPEED),
            "rod": rod,
            "slider": fb.PointMass(mass=0.14, position=(CRANK + ROD, 0.0)),
        },
        joints={
            "main": fb.Revolute("crank", (0.0, 0.0)),
            "motor": fb.PrescribedRotation("crank", lambda t: SPEED * np.asarray(t)),
            "big end": fb.Revolute("rod.crank", "crank.end"),
            "pin": fb.Revolute("rod.pin", "slider", clearance=clearance, law=PIN),
            "guide": fb.Slot("slider", (0.0, 0.0)),
        },
        sensors={
            "velocity": fb.Velocity("slider"),
            "impacts": fb.contact.Contacts("pin", first=3),
        },
    )


def motion():
    return fb.simulate(engine(), duration=2e-3, step=1e-5)


def picture(drawing, plot):
    fb.draw(engine(CLEARANCES[:1]), axes=drawing)
    result = motion()
    velocity = result.sel(output="velocity_X")
    for n, clearance in enumerate(CLEARANCES):
        plot.plot(1e3 * result.time, velocity[n], color=str(0.7 - 0.2 * n),
                  label=f"{1e3 * clearance:.2f} mm")  # fmt: skip
    plot.set(xlabel="time [ms]", ylabel="slider's velocity [m/s]")
    plot.legend(title="clearance")
