"""A beam that is spun up.

This spin-up manoeuvre is a common benchmark of flexible bodies. A slender beam is accelerated from
rest to 4 rad/s in 15 s. During the acceleration it lags behind; afterwards the centrifugal force
straightens it and loads its root.
"""

import numpy as np

import flexband as fb

LENGTH, AREA, SECOND_MOMENT = 8.0, 7.299e-5, 8.214e-9  # m, m², m⁴
MODULUS, DENSITY = 68.95e9, 2766.0  # Pa, kg/m³
SPEED, RAMP = 4.0, 15.0  # rad/s, s
TURN = 2 * np.pi / RAMP  # rad/s


def angle(t):
    t = np.asarray(t, dtype=float)
    ramp = SPEED / RAMP * (t**2 / 2 + (np.cos(TURN * t) - 1) / TURN**2)
    return np.where(t < RAMP, ramp, SPEED * (t - RAMP / 2))


def spin_up():
    beam = fb.Beam(
        length=LENGTH, section=fb.sections.GeneralSection(AREA, SECOND_MOMENT), elements=16,
        density=DENSITY, youngs_modulus=MODULUS, poissons_ratio=0.3,
    )  # fmt: skip
    return fb.Mechanism(
        bodies={"beam": beam},
        joints={"hub": fb.Revolute("beam.start", (0.0, 0.0)),
                "motor": fb.PrescribedRotation("beam.start", angle)},
        sensors={
            "tip": fb.Position("beam.end"),
            "root": fb.SectionForces("beam", "start"),
            "upper": fb.Stress("beam", "start", y=0.018),  # m
        },
    )  # fmt: skip


def motion():
    return fb.simulate(spin_up(), duration=20.0, step=5e-3)


def lag(result):
    """Return the displacement of the tip [m] to the left of that of a rigid beam."""
    rigid_angle = angle(result.time.values)
    x, y = result.sel(output=["tip_X", "tip_Y"]).values
    return np.cos(rigid_angle) * y - np.sin(rigid_angle) * x


def picture(drawing, plot):
    fb.draw(spin_up(), axes=drawing)
    result = motion()
    plot.plot(result.time, lag(result), color="#1f78b4")
    plot.set(xlabel="time [s]", ylabel="lag of the tip [m]")
    pull = plot.twinx()
    pull.plot(result.time, result.sel(output="root_N"), color="#d95f02")
    pull.set_ylabel("root force [N]", color="#d95f02")
