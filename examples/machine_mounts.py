"""A machine on two mounts: every kind of knowledge in one study.

A shaker starts at full speed. Its payload is between 20 and 60 kg, most often 30 kg. The mounts
come from one batch, so their stiffnesses are correlated, and of their mean an interval is known.
The unbalance is an interval, and the rubber is one of two.
"""

import numpy as np

import flexband as fb

FRAME, SPEED, HEIGHT = 160.0, 2 * np.pi * 12.0, 0.25  # kg, rad/s, m
DAMPING = {"natural": 800.0, "synthetic": 2000.0}  # N s/m of each mount
UP = (0.0, 1.0)


def shaker(payload, front, rear, unbalance, rubber):
    damping = np.array([DAMPING[kind] for kind in rubber])
    mount = {"stiffness": front, "damping": damping, "rest_length": HEIGHT}
    return fb.Mechanism(
        bodies={"machine": fb.RigidBody(mass=FRAME + payload, inertia=10.0, position=(0.0, HEIGHT),
                                        points={"front": (0.4, 0.0), "rear": (-0.4, 0.0)})},
        joints={"guide": fb.Prismatic("machine", (0.0, 0.0), UP)},
        loads={
            "front": fb.Spring("machine.front", (0.4, 0.0), **mount),
            "rear": fb.Spring("machine.rear", (-0.4, 0.0), **{**mount, "stiffness": rear}),
            "drive": fb.Force("machine", y=lambda t: unbalance * SPEED**2 * np.sin(SPEED * t)),
        },
        sensors={"front": fb.SpringForce("front")},
    )  # fmt: skip


stiffness = fb.LogNormal(mean=fb.Interval(38e3, 42e3), cv=0.08)  # N/m
inputs = {
    "payload": fb.Triangular(20.0, 30.0, 60.0),  # kg
    "mounts": fb.Correlated({"front": stiffness, "rear": stiffness}, 0.8),
    "unbalance": fb.Interval(0.02, 0.03),  # kg m
    "rubber": fb.Choice(*DAMPING),
}
response = fb.dynamic_response(shaker, duration=1.0, step=1e-3)
study = fb.Study(response, inputs, fb.AdaptivePCCI(tolerance=0.03))


def picture(drawing, plot):
    fb.draw(shaker(33.0, 4e4, 4e4, 0.025, ["natural"]), axes=drawing, dimensions=False)
    bands = study.run().sel(output="front_F")
    for rubber, color in zip(DAMPING, ("#fdae6b", "#3182bd"), strict=True):
        error_bar = bands["error_bar_by_choice"].sel(choice=rubber)
        plot.fill_between(bands.time, *error_bar, color=color, alpha=0.7, label=f"{rubber} rubber")
    plot.set(xlabel="time [s]", ylabel="error bar of the force on the floor [N]")
    plot.legend()
