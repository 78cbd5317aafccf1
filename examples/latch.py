"""A bar that lets go of one pin and is caught by another.

A slender bar swings down on a pin at its left end. When it almost hangs, it lets go, and a second
pin catches its right end where that is. So two simulations follow each other: the second one goes
on from the first, with another joint. Caught at the other end, the bar turns with −1/2 of its
speed, and 3/4 of its kinetic energy are lost.
"""

import numpy as np

import flexband as fb

LENGTH, SWING, DURATION, STEP = 1.0, 0.45, 1.5, 1e-3  # m, s: of the first part, of both, step


def bar(**pins):
    body = fb.RigidBody(
        mass=1.0, inertia=LENGTH**2 / 12, position=(LENGTH / 2, 0.0),
        points={"start": (-LENGTH / 2, 0.0), "end": (LENGTH / 2, 0.0)},
    )  # fmt: skip
    return fb.Mechanism(
        bodies={"bar": body},
        joints={name: fb.Revolute(f"bar.{name}", place) for name, place in pins.items()},
        loads={"gravity": fb.Gravity()},
        sensors={
            "start": fb.Position("bar.start"),
            "end": fb.Position("bar.end"),
            "rate": fb.AngularVelocity("bar"),
            "energy": fb.KineticEnergy(),
        },
    )


def motion():
    """Return the motion on the first pin, and that on the second."""
    swing = fb.simulate(bar(start=(0.0, 0.0)), duration=SWING, step=STEP, keep_state=True)
    pin = tuple(swing.isel(time=-1).sel(output=["end_X", "end_Y"]).values)
    caught = fb.simulate(bar(end=pin), duration=DURATION - SWING, step=STEP, start=swing)
    return swing, caught


def picture(drawing, plot):
    swing, caught = motion()
    for part, pinned, color in ((swing, "start", "#1f78b4"), (caught, "end", "#d95f02")):
        for place in part.isel(time=slice(0, None, 90)).T:
            x, y = (place.sel(output=[f"start_{k}", f"end_{k}"]) for k in "XY")
            drawing.plot(x, y, color=color, alpha=0.5)
        pin = part.isel(time=-1).sel(output=[f"{pinned}_X", f"{pinned}_Y"])
        drawing.plot(*pin, "o", color=color, markersize=6)
        label = f"pin at the bar's {pinned}"
        plot.plot(part.time, part.sel(output="rate"), color=color, label=label)
    drawing.set(aspect="equal", xlabel="X [m]", ylabel="Y [m]")
    plot.axvline(SWING, color="0.6", linewidth=0.8)
    plot.set(xlabel="time [s]", ylabel="angular velocity [rad/s]", xticks=np.arange(0.0, 1.6, 0.5))
    plot.legend()
