"""Published rigid mechanisms, built from the public interface only."""

from __future__ import annotations

import numpy as np
from checks import Check, differences

import flexband as fb

GRAVITY = {"gravity": fb.Gravity()}


def outputs_at(motion, time: float, *names: str) -> np.ndarray:
    """Return outputs at a time of the motion."""
    return motion.sel(output=list(names)).sel(time=time, method="nearest").values


def pendulum() -> list[Check]:
    """IFToMM A01: a point mass of 1 kg on a massless rod of 1 m, released at (−1, 0)."""
    model = fb.Mechanism(
        bodies={"mass": fb.PointMass(mass=1.0, position=(-1.0, 0.0))},
        joints={"rod": fb.Distance("mass", (0.0, 0.0), 1.0)},
        loads=GRAVITY,
        sensors={
            "r": fb.Position("mass"),
            "v": fb.Velocity("mass"),
            "kinetic": fb.KineticEnergy(),
        },
    )
    motion = fb.simulate(
        model, duration=10.0, step=2e-4, integrator=fb.GeneralizedAlpha(spectral_radius=0.8)
    )
    exact = {
        1.0: (0.9862917511, -0.1650108531),
        5.0: (-0.9423054350, -0.3347543384),
        10.0: (-0.2750874626, -0.9614192050),
    }
    name = "pendulum (IFToMM A01)"
    checks = [
        c
        for t, r in exact.items()
        for c in differences(
            f"{name}, r({t:g} s) [m]", outputs_at(motion, t, "r_X", "r_Y"), r, 1e-5
        )
    ]
    v = outputs_at(motion, 10.0, "v_X", "v_Y")
    checks += differences(f"{name}, v(10 s) [m/s]", v, (4.1755981, -1.1947491), 1e-4)
    energy = motion.sel(output="kinetic") + 9.81 * motion.sel(output="r_Y")
    return [*checks, Check(f"{name}, energy kept [J]", 0.0, float(np.abs(energy).max()), 5e-5)]


def four_bar_chain() -> list[Check]:
    """IFToMM A02, N = 2: three vertical and two horizontal rods, which lie on a line repeatedly."""
    rod = {"length": 1.0, "height": 1e-4, "width": 1e4, "density": 1.0}  # 1 kg, thin
    bodies = {
        f"up{k}": fb.RigidBody.bar(**rod, start=(float(k), 0.0), angle=np.pi / 2, rate=-1.0)
        for k in range(3)
    } | {
        f"across{k}": fb.RigidBody.bar(**rod, start=(float(k), 1.0), velocity=(1.0, 0.0))
        for k in range(2)
    }
    joints = {f"ground{k}": fb.Revolute(f"up{k}.start", (float(k), 0.0)) for k in range(3)}
    for k in range(2):
        joints[f"left{k}"] = fb.Revolute(f"across{k}.start", f"up{k}.end")
        joints[f"right{k}"] = fb.Revolute(f"across{k}.end", f"up{k + 1}.end")
    model = fb.Mechanism(
        bodies=bodies, joints=joints, loads=GRAVITY, sensors={"top": fb.Position("up0.end")}
    )
    motion = fb.simulate(
        model, duration=10.0, step=2e-4, integrator=fb.GeneralizedAlpha(spectral_radius=0.8)
    )
    exact = {
        1.0: (-0.195020302, -0.980799206),
        4.0: (0.117616102, 0.993059138),
        10.0: (0.328458112, 0.944518538),
    }
    return [
        c
        for t, r in exact.items()
        for c in differences(
            f"N-four-bar (IFToMM A02), r({t:g} s) [m]",
            outputs_at(motion, t, "top_X", "top_Y"),
            r,
            1e-4,
        )
    ]


def torque_slider_crank() -> list[Check]:
    """Crank 0.5 m, 2 kg; rod 1 m, 4 kg; slider 1 kg; 10 N m from rest at angle 0, no gravity."""

    def uniform(length: float, mass: float, start: float) -> fb.RigidBody:
        return fb.RigidBody(
            mass=mass,
            inertia=mass * length**2 / 12,
            points={"start": (0.0, 0.0), "end": (length, 0.0)},
            center=(length / 2, 0.0),
            position=(start, 0.0),
        )

    model = fb.Mechanism(
        bodies={
            "crank": uniform(0.5, 2.0, 0.0),
            "rod": uniform(1.0, 4.0, 0.5),
            "slider": fb.PointMass(mass=1.0, position=(1.5, 0.0)),
        },
        joints={
            "A": fb.Revolute("crank.start", (0.0, 0.0)),
            "B": fb.Revolute("rod.start", "crank.end"),
            "C": fb.Revolute("slider", "rod.end"),
            "guide": fb.Slot("slider", (0.0, 0.0)),
        },
        loads={"torque": fb.Moment("crank", 10.0)},
        sensors={
            "angle": fb.Angle("crank"),
            "rate": fb.AngularVelocity("crank"),
            "slider": fb.Position("slider"),
        },
    )
    motion = fb.simulate(
        model, duration=2.0, step=1e-4, integrator=fb.GeneralizedAlpha(spectral_radius=0.8)
    )
    name = "slider–crank driven by a torque"
    exact = {
        0.5: {"angle": 1.4582418799},
        1.0: {"angle": 5.6423299821, "rate": 10.1765251663, "slider_X": 1.3550640434},
        2.0: {"angle": 22.0891715703, "rate": 29.6358150058, "slider_X": 0.5012022650},
    }
    return [
        Check(f"{name}, {output}({t:g} s)", value, float(outputs_at(motion, t, output)[0]), 1e-4)
        for t, values in exact.items()
        for output, value in values.items()
    ]


def andrews() -> list[Check]:
    """Andrews' squeezing mechanism: seven bodies, four of which share one pin P."""
    A, B, C = (-0.06934, -0.00227), (-0.03635, 0.03273), (0.014, 0.072)
    rr, ra, d, da, e, ea = 0.007, 0.00092, 0.028, 0.0115, 0.02, 0.01421
    ss, sa, sb, sc, sd = 0.035, 0.01874, 0.01043, 0.018, 0.02
    zt, ta, tb, zf, fa, u, ua, ub = 0.04, 0.02308, 0.00916, 0.02, 0.01421, 0.04, 0.01228, 0.00449
    # Data and initial angles of the test set.
    mass = (0.04325, 0.00365, 0.02373, 0.00706, 0.0705, 0.00706, 0.05498)
    inertia = (2.194e-6, 4.41e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5)
    beta, theta, gamma, phi, delta, omega, epsilon = (
        -0.0617138900142764, 0.0, 0.45527981916307, 0.222668390165886, 0.487364979543843,
        -0.222668390165886, 1.23054744454982,
    )  # fmt: skip
    tip = (rr * np.cos(beta), rr * np.sin(beta))
    P = (tip[0] - d * np.cos(beta + theta), tip[1] - d * np.sin(beta + theta))
    O = (0.0, 0.0)  # noqa: E741
    places = [  # points and centre in the body's axes, where its origin starts, and its angle
        ({"O": O, "tip": (rr, 0.0)}, (ra, 0.0), O, beta),
        ({"tip": O, "P": (-d, 0.0)}, (-da, 0.0), tip, beta + theta),
        ({"B": O, "P": (0.0, -ss), "D": (sd, -sc)}, (sa, sb), B, gamma),
        ({"P": O, "E": (0.0, e)}, (0.0, ea), P, phi + delta),
        ({"A": O, "E": (zt, 0.0)}, (ta, tb), A, delta),
        ({"P": O, "F": (-zf, 0.0)}, (-fa, 0.0), P, omega + epsilon),
        ({"A": O, "F": (0.0, -u)}, (ua, ub), A, epsilon),
    ]
    # The mechanism.
    bodies = {
        str(k): fb.RigidBody(
            mass=m, inertia=J, points=points, center=center, position=position, angle=angle
        )
        for k, (m, J, (points, center, position, angle)) in enumerate(
            zip(mass, inertia, places, strict=True), start=1
        )
    }
    pins = (("1.O", O), ("1.tip", "2.tip"), ("3.B", B), ("5.A", A), ("7.A", A), ("2.P", "3.P"),
            ("2.P", "4.P"), ("2.P", "6.P"), ("4.E", "5.E"), ("6.F", "7.F"))  # fmt: skip
    model = fb.Mechanism(
        bodies=bodies,
        joints={f"pin {k}": fb.Revolute(*pin) for k, pin in enumerate(pins)},
        loads={
            "spring": fb.Spring("3.D", C, 4530.0, rest_length=0.07785),
            "torque": fb.Moment("1", 0.033),
        },
        sensors={f"angle {k}": fb.Angle(k) for k in bodies}
        | {f"rate {k}": fb.AngularVelocity(k) for k in bodies},
    )
    # Compare at the end, in the test set's relative angles.
    motion = fb.simulate(
        model, duration=0.03, step=5e-7, integrator=fb.GeneralizedAlpha(spectral_radius=0.8)
    ).isel(time=-1)
    exact_q = (15.8107711952, -15.7563710584, 0.0408222401, -0.5347301163, 0.5244099659,
               0.5347301163, 1.0480807410)  # fmt: skip
    exact_v = (1139.9203023, -1424.3792952, 11.0329119, 19.2933741, 0.5735699, -19.2933741,
               0.3231791)  # fmt: skip
    checks = []
    for kind, exact, tolerance, unit in (
        ("angle", exact_q, 1e-5, "rad"),
        ("rate", exact_v, 1e-4, "rad/s"),
    ):
        a = {k: float(motion.sel(output=f"{kind} {k}")) for k in bodies}
        relative_values = (
            a["1"],
            a["2"] - a["1"],
            a["3"],
            a["4"] - a["5"],
            a["5"],
            a["6"] - a["7"],
            a["7"],
        )
        for name, value, reference in zip("βΘγΦδΩε", relative_values, exact, strict=True):
            size = max(1.0, abs(reference)) if kind == "rate" else 1.0
            checks.append(
                Check(
                    f"Andrews' mechanism, {kind} {name} (0.03 s) [{unit}]",
                    reference,
                    value,
                    tolerance * size,
                )
            )
    return checks


def car_axis() -> list[Check]:
    """Two wheels' masses on springs; the left one on a line that turns with the road."""
    length, rest, bump, rate, mass = 1.0, 0.5, 0.1, 10.0, 0.01**2 * 10.0 / 2
    start = {"mass": mass, "velocity": (-rest, 0.0)}
    model = fb.Mechanism(
        bodies={
            "road": fb.RigidBody(mass=1.0, inertia=1.0, points={"right": (length, 0.0)}),
            "left": fb.PointMass(position=(0.0, rest), **start),
            "right": fb.PointMass(position=(length, rest), **start),
        },
        joints={
            "hub": fb.Revolute("road", (0.0, 0.0)),
            "tilt": fb.PrescribedRotation(
                "road", lambda t: np.arcsin(bump * np.sin(rate * t) / length)
            ),
            "line": fb.Slot("left", "road", axis=(0.0, 1.0)),
            "axis": fb.Distance("left", "right", length),
        },
        loads={
            "weight": fb.Gravity(0.0, -1.0),
            "left": fb.Spring("left", (0.0, 0.0), 1.0, rest),
            "right": fb.Spring("right", "road.right", 1.0, rest),
        },
        sensors={
            f"{kind} {side}": sensor(side)
            for kind, sensor in (("place", fb.Position), ("velocity", fb.Velocity))
            for side in ("left", "right")
        },
    )
    motion = fb.simulate(
        model, duration=3.0, step=5e-5, integrator=fb.GeneralizedAlpha(spectral_radius=1.0)
    )
    exact = {
        "place left": (0.049345578428, 0.49698946023, 1e-6),
        "place right": (1.0417425249, 0.37391102727, 1e-6),
        "velocity left": (-0.077058368, 0.0074468666, 1e-4),
        "velocity right": (0.0175568157, 0.770341044, 1e-4),
    }
    return [
        check
        for k, (name, (*reference, tolerance)) in enumerate(exact.items())
        for check in differences(
            f"car axis, {name} at 3 s", motion[2 * k : 2 * k + 2, -1].values, reference, tolerance
        )
    ]


PROBLEMS = [pendulum, four_bar_chain, torque_slider_crank, andrews, car_axis]
