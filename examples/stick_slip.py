"""A block that sticks to a belt and slips on it.

A belt carries a block until its spring pulls harder than static friction holds. The block then
slips back, and sticks again when it is as fast as the belt. It sticks for 2 (x_s − x_k)/v in each
cycle, where x_s and x_k are the elongations at which the spring balances both frictions.
"""

import numpy as np

import flexband as fb

STIFFNESS, WEIGHT, SPEED = 100.0, 10.0, 0.05  # N/m, N, m/s
FELT = fb.contact.Coulomb(kinetic=0.25, static=0.4)


def slide(stiffness=STIFFNESS):
    return fb.Mechanism(
        bodies={
            "block": fb.PointMass(mass=1.0),
            "belt": fb.PointMass(mass=1.0, velocity=(SPEED, 0.0)),
        },
        joints={
            "motor": fb.PrescribedPath("belt", lambda t: SPEED * np.asarray(t), lambda t: 0.0),
            "felt": fb.Slot("block", "belt", friction=FELT),
        },
        loads={
            "weight": fb.Force("block", 0.0, -WEIGHT),
            "spring": fb.Spring("block", (-1.0, 0.0), stiffness, rest_length=1.0),
        },
        sensors={"x": fb.Position("block"), "felt": fb.contact.FrictionForce("felt")},
    )


def motion():
    return fb.simulate(slide(), duration=4.0, step=4e-3)


def picture(drawing, plot):
    fb.draw(slide(), axes=drawing)
    result = motion()
    plot.plot(result.time, 1e3 * result.sel(output="x_X"), label="block [mm]")
    plot.plot(result.time, 10 * result.sel(output="felt"), label="friction [0.1 N]")
    plot.set(xlabel="time [s]")
    plot.legend()
