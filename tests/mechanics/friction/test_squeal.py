"""Modes of what slides steadily, against closed forms, another derivation and simulations."""

import numpy as np
import pytest
from scipy.optimize import root

import flexband as fb
from flexband.contact import Brake, CircleOnLine, Contact, Coulomb, KeepsRestitution

G = 9.81


def belt(speed, height=0.0):
    """A belt that a drive moves along X, and its joints; its travel may be given as well."""
    travel = speed if callable(speed) else lambda t: speed * np.asarray(t)
    place = (0.0, height)
    return {"belt": fb.RigidBody(mass=1.0, inertia=1.0, position=place)}, {
        "bed": fb.Prismatic("belt", place),
        "drive": fb.PrescribedTravel("belt", place, travel),
    }


def hoffmann(mu, **start):
    """A mass of 1 kg on a belt, on springs at 150° and 30°, which has its rest at the origin."""
    stiffness = 11.0
    depth = 0.1
    bodies, joints = belt(-2.0, depth)
    ends = [(np.cos(a), np.sin(a)) for a in np.deg2rad([150.0, 30.0])]
    touch = KeepsRestitution(stiffness=stiffness, exponent=1.0)
    loads = {
        "contact": Contact(
            "m", "belt", CircleOnLine(), touch, closed_at_start=True, friction=mu
        ),
        "left": fb.Spring("m", ends[0], 11.0, 1.0),
        "right": fb.Spring("m", ends[1], 20.0, 1.0),
        "load": fb.Force("m", mu * stiffness * depth, -stiffness * depth),
    }  # fmt: skip
    mass = fb.PointMass(mass=1.0, position=(0.0, 0.0), **start)
    return fb.Mechanism(
        bodies=bodies | {"m": mass}, joints=joints, loads=loads, sensors={"m": fb.Position("m")}
    )


K11 = 23.25
K12 = 9.0 * np.sqrt(3.0) / 4.0
K22 = 18.75
K3 = 11.0
CRITICAL = (K12 + (K11 - K22) ** 2 / (4 * K12)) / K3


def flutter_roots(mu):
    """Return s of [[k11, k12 − µ k3], [k12, k22]], those with Im s > 0."""
    square = np.linalg.eigvals([[K11, K12 - mu * K3], [K12, K22]]).astype(complex)
    s = 1j * np.sqrt(square)
    return in_order(np.where(s.imag < 0, -s, s))


def in_order(s):
    """Return eigenvalues in the order of their imaginary parts, then of their real ones."""
    s = np.asarray(s)
    return s[np.lexsort((s.real, s.imag.round(6)))]


def test_two_modes_meet_at_the_critical_coefficient_of_hoffmanns_model():
    """Hoffmann, Fischer, Allgaier and Gaul (2002): flutter from µ = 0.4724 on."""
    mu = np.array([0.2, 0.999 * CRITICAL, 1.001 * CRITICAL, 0.8])
    modes = fb.modes(hoffmann(mu), 2, about="sliding")
    for s, coefficient in zip(modes["eigenvalue"].values, mu, strict=True):
        np.testing.assert_allclose(in_order(s), flutter_roots(coefficient), rtol=0, atol=1e-9)
    unstable_flags = [[False] * 2] * 2 + [[False, True]] * 2
    np.testing.assert_array_equal(np.sort(modes["unstable"]), unstable_flags)
    assert modes.attrs["sliding"] == ["contact"]


def growth(motion, output, count):
    """Return s of `count` exponentials in an equidistant series, by Prony's method."""
    x = motion.sel(output=output).values
    step = float(motion["time"][1])
    rows = np.lib.stride_tricks.sliding_window_view(x, count + 1)
    recurrence = np.linalg.lstsq(rows[:, :-1], rows[:, -1], rcond=None)[0]
    return np.log(np.roots([1.0, *-recurrence[::-1]]).astype(complex)) / step


def test_a_simulation_grows_as_fast_as_its_mode():
    model = hoffmann(0.8, velocity=(1e-6, 0.0))
    integrator = fb.GeneralizedAlpha(step_tolerance=1e-12, spectral_radius=1.0)
    motion = fb.simulate(model, duration=5.0, step=0.1, integrator=integrator)
    eigenvalues = growth(motion, "m_X", 4)
    eigenvalue = flutter_roots(0.8)[-1]
    assert np.abs(eigenvalues - eigenvalue).min() < 2e-5 * abs(eigenvalue)


SLOWING = Coulomb(kinetic=0.2, static=0.5, stribeck_speed=0.3)


def on_belt(law, mass, speed=0.2):
    bodies, joints = belt(speed)
    return fb.Mechanism(
        bodies=bodies | {"block": fb.RigidBody(mass=mass, inertia=0.01)},
        joints=joints | {"face": fb.Prismatic("block", "belt", friction=law, length=0.1)},
        loads={"g": fb.Gravity(), "spring": fb.Spring("block", (-1.0, 0.0), 100.0, 1.0)},
        sensors={"x": fb.Position("block")},
    )


def test_a_falling_curve_of_friction_gives_negative_damping():
    """m s² + (µ′(v) m g + c) s + k = 0 with µ = 0.2 + 0.3 exp(−(v/0.3)²)."""
    m = 2.0
    c = 0.4
    slope = -0.3 * 2 * 0.2 / 0.3**2 * np.exp(-((0.2 / 0.3) ** 2))
    law = Coulomb(kinetic=0.2, static=0.5, stribeck_speed=0.3, viscous=c)
    modes = fb.modes(on_belt(law, m), 3, about="sliding")
    exact = np.roots([m, slope * m * G + c, 100.0])
    np.testing.assert_allclose(modes["eigenvalue"], [exact[exact.imag > 0][0]], rtol=1e-8)
    assert modes["unstable"].all()
    assert modes["eigenvalue"].real == pytest.approx(-(slope * m * G + c) / (2 * m), rel=1e-8)


def test_bristles_on_a_belt_have_the_roots_of_their_three_equations():
    """m ẍ = −k x + σ δw, δẇ = −(u g′/g) ẋ − (σ u/g) δw with g = F_c + (F_s − F_c) exp(−(u/v)²)."""
    m = 2.0
    k = 100.0
    u = 0.2
    bristles = 1e4
    bodies, joints = belt(u)
    model = fb.Mechanism(
        bodies=bodies | {"block": fb.PointMass(mass=m)},
        joints=joints | {"bed of the block": fb.Slot("block", (0.0, 0.0))},
        loads={
            "spring": fb.Spring("block", (-1.0, 0.0), k, 1.0),
            "felt": fb.contact.LuGre(
                "block", "belt", kinetic=4.0, static=10.0, stiffness=bristles, stribeck_speed=0.3
            ),
        },
    )
    rise = 6.0 * np.exp(-((u / 0.3) ** 2))
    g = 4.0 + rise
    slope = -2 * u / 0.3**2 * rise
    A = [[0, 1, 0], [-k / m, 0, bristles / m], [0, -u * slope / g, -bristles * u / g]]
    exact = np.linalg.eigvals(A)
    s = fb.modes(model, 3, about="sliding")["eigenvalue"]
    np.testing.assert_allclose(in_order(s), in_order(exact[exact.imag >= 0]), rtol=1e-5)


M = 2.0
J = 0.3
LENGTH = 0.5
SPRING = 400.0
TORSION = 60.0


def leaning_rod(mu, inertia=J, share=0.0, speed=-1.0):
    """A rod whose lower end slides in a belt, on a spring at its centre and a torsion spring.

    A part of its mass and inertia is that of a body on a rough pin at its centre.
    """
    bodies, joints = belt(speed)
    centre = (0.0, LENGTH)
    tip = {"tip": (0.0, -LENGTH)}
    bodies["rod"] = fb.RigidBody(
        mass=M * (1 - share), inertia=inertia * (1 - share), position=centre, points=tip
    )
    joints["tip"] = fb.Slot("rod.tip", "belt", friction=mu)
    if share:
        bodies["load"] = fb.RigidBody(mass=M * share, inertia=inertia * share, position=centre)
        joints["pin"] = fb.Revolute("load", "rod", friction=0.3, radius=0.01)
    return fb.Mechanism(
        bodies=bodies,
        joints=joints,
        loads={
            "g": fb.Gravity(),
            "spring": fb.Spring("rod", (-1.0, LENGTH), SPRING, 1.0),
            "torsion": fb.TorsionSpring("rod", stiffness=TORSION, rest_angle=0.3),
        },
        sensors={"tip": fb.Position("rod.tip"), "angle": fb.Angle("rod")},
    )


def rod_accelerations(state, mu):
    """ẍ of the tip and θ̈ of the rod, from its three equations of motion; they hold for N > 0."""
    x, angle, _, rate = state
    s = np.sin(angle)
    c = np.cos(angle)
    dx = x - LENGTH * s + 1.0
    dy = LENGTH * c - LENGTH
    long = np.sqrt(dx * dx + dy * dy)
    pull = -SPRING * (long - 1.0) / long
    # unknowns: ẍ, θ̈ and N; the belt moves backwards, so its friction is −µN
    matrix = np.array([[M, -M * LENGTH * c, mu], [0, -M * LENGTH * s, -1.0],
                       [0, J, (mu * c - s) * LENGTH]], dtype=state.dtype)  # fmt: skip
    right = np.array([
        pull * dx - M * LENGTH * s * rate**2,
        pull * dy - M * G + M * LENGTH * c * rate**2,
        -TORSION * (angle - 0.3),
    ])  # fmt: skip
    return np.linalg.solve(matrix, right)[:2]


def rod_roots(mu):
    """Return s of the rod about its equilibrium, by derivatives with complex steps."""
    rest = root(lambda q: rod_accelerations(np.array([*q, 0, 0]), mu), [0.0, 0.2], tol=1e-14).x
    start = np.array([*rest, 0.0, 0.0])
    jacobian = [rod_accelerations(start + 1e-30j * e, mu).imag / 1e-30 for e in np.eye(4)]
    A = np.vstack([np.eye(4)[2:], np.transpose(jacobian)])
    s = np.linalg.eigvals(A)
    return in_order(s[s.imag >= 0])


@pytest.mark.parametrize("mu", [0.1, 0.6])
def test_friction_follows_the_reaction_of_its_joint(mu):
    """The reaction depends on accelerations, so that inertia is not symmetric."""
    modes = fb.modes(leaning_rod(mu), 4, about="sliding")
    np.testing.assert_allclose(in_order(modes["eigenvalue"]), rod_roots(mu), rtol=0, atol=1e-9)


def test_what_sticks_moves_along_and_changes_the_reactions_that_friction_follows():
    modes = fb.modes(leaning_rod(0.6, share=0.4), 4, about="sliding")
    np.testing.assert_allclose(in_order(modes["eigenvalue"]), rod_roots(0.6), rtol=0, atol=1e-9)
    assert modes.attrs["sliding"] == ["tip"]


def test_a_string_of_drill_pipes_in_steady_rotation():
    """J s² + r² F µ′ s + k = 0: what rotates as a whole slides on the ground."""
    rate = 4.0
    radius = 0.1
    force = 500.0
    stiffness = 30.0
    inertia = 2.0
    law = Coulomb(kinetic=0.2, static=0.5, stribeck_speed=0.3)
    model = fb.Mechanism(
        bodies={name: fb.RigidBody(mass=1.0, inertia=inertia) for name in ("motor", "bit")},
        joints={
            "top": fb.Revolute("motor", (0.0, 0.0)),
            "drive": fb.PrescribedRotation("motor", lambda t: rate * np.asarray(t)),
            "well": fb.Revolute("bit", (0.0, 0.0)),
        },
        loads={
            "string": fb.TorsionSpring("bit", "motor", stiffness),
            "rock": Brake("bit", (0.0, 0.0), friction=law, radius=radius, force=force),
        },
        sensors={"bit": fb.Angle("bit")},
    )
    modes = fb.modes(model, 4, about=fb.SteadyRotation(rate))
    u = radius * rate
    slope = -0.3 * 2 * u / 0.3**2 * np.exp(-((u / 0.3) ** 2))
    exact = np.roots([inertia, radius**2 * force * slope, stiffness])
    np.testing.assert_allclose(modes["eigenvalue"], [exact[exact.imag > 0][0]], rtol=1e-8)
    assert modes["unstable"].all()
    assert modes.attrs["sliding"] == ["rock"]


def crank(angle, **loads):
    bar = fb.RigidBody.bar(length=0.2, height=0.01, width=0.01, density=7800.0)
    return fb.Mechanism(
        bodies={"crank": bar, "slider": fb.RigidBody(mass=1.0, inertia=1.0, position=(0.2, 0.0))},
        joints={
            "pin": fb.Revolute("crank.start", (0.0, 0.0)),
            "drive": fb.PrescribedRotation("crank", angle),
            "guide": fb.Prismatic("slider", (0.0, 0.0)),
        },
        loads=loads,
    )


@pytest.mark.parametrize(
    ("model", "message"),
    [
        (lambda: on_belt(0.3, 2.0, speed=lambda t: 0.0 * t), "if no drive moves at the start"),
        (
            lambda: on_belt(SLOWING, 2.0, speed=lambda t: 0.2 * t + t * t),
            "its loads change on the way",
        ),
        (
            lambda: crank(lambda t: 3.0 * t, rod=fb.Spring("crank.end", "slider", 100.0, 0.1)),
            "does not slide steadily while its drives go on .sample 0.: its loads change",
        ),
        (lambda: leaning_rod(0.6, inertia=1e-3), "friction of 'tip' jams"),
        (lambda: leaning_rod(3.0, inertia=1e-3, speed=1.0), "friction of 'tip' jams"),
    ],
)
def test_what_does_not_slide_steadily_is_refused(model, message):
    with pytest.raises(fb.errors.InputError, match=message):
        fb.modes(model(), 4, about="sliding")
