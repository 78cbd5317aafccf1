"""A planetary gear that starts a load.

A motor turns the sun inside a fixed ring; two planets drive the arm, which carries the load. The
teeth are modelled as pitch circles that roll without slipping.
"""

import numpy as np

import flexband as fb

SUN, PLANET = 0.03, 0.045  # m: radii of the pitch circles
RING, ARM = SUN + 2 * PLANET, SUN + PLANET
TORQUE = 4.0  # N m: motor
STEEL = {"width": 0.02, "density": 7800.0}  # m, kg/m³


def planetary_gear():
    bodies = {
        "sun": fb.RigidBody.disc(radius=SUN, **STEEL),
        "arm": fb.RigidBody.block(length=2 * ARM, height=0.02, **STEEL,
                                  points={"0": (ARM, 0.0), "1": (-ARM, 0.0)}),
    }  # fmt: skip
    joints = {"S": fb.Revolute("sun", (0.0, 0.0)), "A": fb.Revolute("arm", (0.0, 0.0))}
    for k, place in enumerate([(ARM, 0.0), (-ARM, 0.0)]):
        bodies[f"planet {k}"] = fb.RigidBody.disc(radius=PLANET, position=place, **STEEL)
        joints[f"P{k}"] = fb.Revolute(f"planet {k}", f"arm.{k}")
        joints[f"inner {k}"] = fb.Gear("sun", f"planet {k}", SUN, PLANET)
        joints[f"outer {k}"] = fb.Gear(f"planet {k}", (0.0, 0.0), PLANET, -RING)
    return fb.Mechanism(
        bodies=bodies,
        joints=joints,
        loads={
            "motor": fb.TorsionSpring("sun", (0.0, 0.0), torque=TORQUE),
            "load": fb.TorsionSpring("arm", (0.0, 0.0), damping=0.5),  # N m s/rad
        },
        sensors={name: fb.AngularVelocity(name) for name in ("sun", "planet 0", "arm")},
    )


def motion():
    return fb.simulate(planetary_gear(), duration=0.5, step=2.5e-4)


def picture(drawing, plot):
    fb.draw(planetary_gear(), axes=drawing, dimensions=False, names=False)
    drawing.margins(-0.15)  # without names, less margin is enough
    for x, y, name in ((0.0, -0.06, "sun"), (ARM, -0.03, "planet"), (0.0, 0.09, "ring, fixed")):
        drawing.text(x, y, name, ha="center", style="italic")
    result = motion()
    plot.plot(result.time, result.T * 30 / np.pi, label=result.output.values)
    plot.set(xlabel="time [s]", ylabel="speed [rev/min]")
    plot.legend()
