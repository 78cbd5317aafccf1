"""A bar that seizes a load, swings it up and lets it fly.

A bar falls on its pin. When it hangs, a gripper at its end seizes a load that rests there, by a
plastic impact, and later lets it go. The gripper and the support of the load are joints that are
active only part of the time.
"""

import flexband as fb

LENGTH, MASS, LOAD = 1.0, 3.0, 0.5  # m, kg
SEIZED, RELEASED = 0.48335, 0.75  # s: the bar hangs; the load flies


def gripped(t):
    return SEIZED < t < RELEASED


def gripper():
    bar = fb.RigidBody(
        mass=MASS, inertia=MASS * LENGTH**2 / 12, position=(LENGTH / 2, 0.0),
        points={"start": (-LENGTH / 2, 0.0), "end": (LENGTH / 2, 0.0)},
    )  # fmt: skip
    rest = fb.Revolute("load", (0.0, -LENGTH))
    return fb.Mechanism(
        bodies={"bar": bar, "load": fb.PointMass(mass=LOAD, position=(0.0, -LENGTH))},
        joints={
            "pin": fb.Revolute("bar.start", (0.0, 0.0)),
            "gripper": fb.contact.Switched(fb.Revolute("load", "bar.end"), gripped),
            "rest": fb.contact.Switched(rest, lambda t: t < SEIZED),
        },
        loads={"gravity": fb.Gravity()},
        sensors={
            "bar": fb.Position("bar.end"),
            "load": fb.Position("load"),
            "lost": fb.sensors.SwitchingLoss("gripper"),
            "grip": fb.Reaction("gripper"),
        },
    )


def motion():
    return fb.simulate(gripper(), duration=1.1, step=5e-3)


def picture(drawing, plot):
    fb.draw(gripper(), axes=drawing)
    result = motion()
    for name, color in (("bar", "0.6"), ("load", "#d95f02")):
        x, y = (result.sel(output=f"{name}_{axis}") for axis in "XY")
        plot.plot(x, y, color=color, label="end of the bar" if name == "bar" else name)
    plot.set(aspect="equal", xlabel="X [m]", ylabel="Y [m]")
    plot.legend()
