"""Convergence in step and mesh, energy, long chains of loops, stiff members next to soft ones."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import ellipj

import flexband as fb
from tests.mechanics.models import slider_crank


def run(model, duration, step, radius=0.8):
    integrator = fb.GeneralizedAlpha(spectral_radius=radius, tolerance=1e-13)
    return fb.simulate(model, duration=duration, step=step, integrator=integrator)


def four_bar(a=1.0, mass=1.0, time=1.0):
    """A driven four-bar, its coupler of damped rubber, in units of a m, mass kg and time s."""
    stress = mass / (a * time**2)
    density = 1000.0 * mass / a**3
    rod = {"height": 0.02 * a, "width": 0.02 * a, "density": 2 * density}
    return fb.Mechanism(
        bodies={
            "crank": fb.RigidBody.bar(length=0.3 * a, angle=1.0, **rod),
            "coupler": fb.Beam(
                length=0.9 * a, height=0.04 * a, width=0.02 * a, density=density, elements=3,
                youngs_modulus=1e7 * stress, poissons_ratio=0.3, retardation_time=3e-4 * time,
                start=(0.16 * a, 0.25 * a), angle=0.518,
            ),
            "rocker": fb.RigidBody.bar(length=0.7 * a, start=(a, 0.0), angle=1.651, **rod),
        },
        joints={
            "A": fb.Revolute("crank.start", (0.0, 0.0)), "D": fb.Revolute("rocker.start", (a, 0.0)),
            "B": fb.Revolute("coupler.start", "crank.end"),
            "C": fb.Revolute("coupler.end", "rocker.end"),
            "motor": fb.PrescribedRotation("crank", lambda t: 1.0 + 2 * np.pi * t / time),
        },
        loads={"gravity": fb.Gravity(y=-9.81 * a / time**2)},
        sensors={
            "r": fb.Position("coupler.middle"), "v": fb.Velocity("coupler.middle"),
            "A": fb.Reaction("A"), "C": fb.Reaction("C"), "M": fb.ReactionMoment("motor"),
        },
    )  # fmt: skip


@pytest.mark.parametrize("radius", [0.5, 0.8, 1.0])
def test_a_flexible_closed_loop_converges_with_the_square_of_the_step(radius):
    """Against steps 8 times finer; order 2, multipliers included, at every ρ."""
    exact = run(four_bar(), 0.5, 0.5 / 16_000).values
    errors = []
    for steps in (500, 1000, 2000):
        motion = run(four_bar(), 0.5, 0.5 / steps, radius).values
        deviation = (motion - exact[:, :: 16_000 // steps])[:, steps // 2 :]
        errors.append(np.abs(deviation).max(axis=1))
    orders = np.log2(np.array(errors)[:-1] / np.array(errors)[1:])
    np.testing.assert_allclose(orders, 2.0, atol=0.05)


@pytest.mark.parametrize("tolerance", [1e-10, 1e-13])
def test_reactions_converge_with_the_square_of_tiny_steps(tolerance):
    """To 1 µs: Newton's tolerance, a length, does not limit accelerations and reactions.

    The link is damped by 0.6 %, since its axial waves from 5.6 kHz on last if it is not.
    """
    model = slider_crank()
    link = replace(model.bodies["link"], retardation_time=1e-5)
    model = replace(model, bodies=dict(model.bodies) | {"link": link})
    model = replace(model, sensors={"A": fb.Reaction("A"), "M": fb.ReactionMoment("motor")})
    integrator = fb.GeneralizedAlpha(tolerance=tolerance)

    def motion(substeps):
        run = {"duration": 0.02, "step": 1e-3, "substeps": substeps, "integrator": integrator}
        return fb.simulate(model, **run).values

    reactions = np.array([motion(125 * 2**k) for k in range(4)])
    errors = np.abs(np.diff(reactions, axis=0)).max(axis=2)
    np.testing.assert_allclose(np.log2(errors[:-1] / errors[1:]), 2.0, atol=0.02)


@settings(max_examples=5, deadline=None)
@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(-1.0, 1.0))
def test_a_closed_loop_is_the_same_in_other_units(length, mass, time):
    """Lengths, masses and times by powers of ten: no scale is built in."""
    a = 10.0**length
    b = 10.0**mass
    c = 10.0**time
    reference = run(four_bar(), 0.1, 1e-3)
    scaled_motion = run(four_bar(a, b, c), 0.1 * c, 1e-3 * c)
    units = {"m": a, "m/s": a / c, "N": b * a / c**2, "N m": b * (a / c) ** 2}
    converted_values = scaled_motion.values / np.array(
        [[units[u]] for u in scaled_motion.unit.values]
    )
    np.testing.assert_array_less(
        np.abs(converted_values - reference).max("time"), 1e-7 * np.abs(reference).max("time")
    )


@pytest.mark.parametrize(
    ("rule", "locks"), [(fb.sections.SelectiveIntegration, 0), (fb.sections.FullIntegration, 1)]
)
def test_a_thick_beam_converges_to_timoshenkos_and_the_plain_element_to_a_stiffer_one(rule, locks):
    """Pinned: it sags by 5wL⁴/384EI + wL²/8kGA, (ρIω² − EIκ² − kGA)(ρAω² − kGAκ²) = (kGAκ)².

    `FullIntegration` has E/(1 − ν²) and k = 1 there, on the finest mesh.
    """
    E = 7e10
    rho = 2700.0
    area = 0.04
    second = 0.1 * 0.4**3 / 12
    nu = np.array([0.0, 0.3, 0.45])
    EI = E * second / (1 - locks * nu**2)
    kGA = E * area / (2 * (1 + nu)) * (1.0 if locks else 10 * (1 + nu) / (12 + 11 * nu))
    wave = np.arange(1, 3)[:, None] * np.pi / 2.0  # κ = nπ/L
    half = (area * (EI * wave**2 + kGA) + second * kGA * wave**2) / (2 * rho * area * second)
    square = half - np.sqrt(half**2 - EI * kGA * wave**4 / (rho**2 * area * second))
    exact = np.stack([1e3 * (80 / 384 / EI + 4 / 8 / kGA), *np.sqrt(square) / (2 * np.pi)])

    def solve(elements):
        model = fb.Mechanism(
            bodies={"b": fb.Beam(
                length=2.0, height=0.4, width=0.1, density=rho, youngs_modulus=E, elements=elements,
                poissons_ratio=nu, integration=rule(),
            )},
            joints={"pin": fb.Revolute("b.start", (0.0, 0.0)), "roll": fb.Slot("b.end", (0, 0))},
            loads={"w": fb.DistributedLoad("b", y=1e3)}, sensors={"r": fb.Position("b.middle")},
        )  # fmt: skip
        frequency = fb.modes(model, 3, about="start")["frequency"].values  # the second is axial
        return np.stack([fb.equilibrium(model).sel(output="r_Y"), *frequency[:, [0, 2]].T])

    meshes = np.array([solve(8), solve(16), solve(32)])
    orders = np.log2((meshes[:-1] - exact) / (meshes[1:] - exact))
    np.testing.assert_allclose(orders, 2.0, atol=0.05)
    np.testing.assert_allclose((4 * meshes[2] - meshes[1]) / 3, exact, rtol=5e-6)


def elastic_trammel():
    """Two masses on rails at right angles, joined by a spring."""
    a = fb.PointMass(mass=1.0, position=(0.3, 0))
    b = fb.PointMass(mass=0.5, position=(0, -0.45))
    return fb.Mechanism(
        bodies={"a": a, "b": b},
        joints={"x": fb.Slot("a", (0.0, 0.0)), "y": fb.Slot("b", (0.0, 0.0), axis=(0.0, 1.0))},
        loads={"gravity": fb.Gravity(), "s": fb.Spring("a", "b", 200.0, 0.5)},
        sensors={"T": fb.KineticEnergy(), "s": fb.SpringForce("s"), "b": fb.Position("b")},
    )


def rubber_swing():
    """A parallelogram of two beams and a cable that hangs from two pins."""
    side = {"length": 0.6, "angle": 1.0 - np.pi / 2, "elements": 3}
    rubber = {"height": 0.05, "width": 0.02, "density": 1e3, "youngs_modulus": 1e7}
    rope = {"mass_per_length": 0.8, "axial_stiffness": 4e3, "bending_stiffness": 0.5}
    a = fb.Beam(poissons_ratio=0.3, **side, **rubber)
    b = fb.Cable(start=(0.8, 0), **side, **rope)
    seat = fb.Beam(length=0.8, elements=3, start=(0.5, -0.3), poissons_ratio=0.3, **rubber)
    pins = {"a.start": (0, 0), "b.start": (0.8, 0), "seat.start": "a.end", "seat.end": "b.end"}
    return fb.Mechanism(
        bodies={"a": a, "seat": seat, "b": b},
        joints={first: fb.Revolute(first, second) for first, second in pins.items()},
        loads={"gravity": fb.Gravity()},
        sensors={"T": fb.KineticEnergy(), "U": fb.ElasticEnergy(), "V": fb.PotentialEnergy()},
    )


@pytest.mark.parametrize(
    ("build", "duration", "step"),
    [(elastic_trammel, 60.0, 2e-3), (rubber_swing, 4.0, 1e-3)],
)
def test_the_undamped_integrator_keeps_energy(build, duration, step):
    """At ρ = 1 its error, a part of what is exchanged, does not grow, and falls with h²."""

    def errors(step):
        motion = run(build(), duration, step, radius=1.0)
        o = dict(zip(motion.output.values, motion.values, strict=True))
        potential = o["U"] + o["V"] if "U" in o else o["s_F"] ** 2 / 400 + 0.5 * 9.81 * o["b_Y"]
        return np.abs(o["T"] + potential - o["T"][0] - potential[0]) / np.ptp(o["T"])

    coarse = errors(step)
    fine = errors(step / 2)
    assert coarse.max() < 4e-5
    assert coarse[3 * len(coarse) // 4 :].max() < 2.5 * coarse[: len(coarse) // 4].max()
    assert coarse.max() / fine.max() == pytest.approx(4.0, rel=0.1)


@pytest.mark.parametrize("brace", [False, True])
def test_a_chain_of_fourteen_loops_swings_as_one_pendulum(brace):
    """In closed form, sin θ/2 = sin θ₀/2 cd ωt; the ground carries weight and m r¨."""
    lean = 1.2
    rod = {"height": 0.02, "width": 0.02, "density": 2000.0}  # 0.8 kg/m
    radius = np.linspace(0.5, 1.0, 10)
    pitch = np.linspace(0.9, 0.4, 10)
    place = [pitch * k * (1 + 0.02 * k) for k in range(15)]
    x = radius * np.sin(lean)
    y = -radius * np.cos(lean)
    bodies = {}
    joints = {}
    for k, at in enumerate(place):
        crank = {"length": radius, "angle": lean - np.pi / 2, "start": (at, 0.0)}
        bodies[f"crank{k}"] = fb.RigidBody.bar(**crank, **rod)
        joints[f"ground{k}"] = fb.Revolute(f"crank{k}.start", (at, 0.0))
    for k, at in enumerate(place[:-1]):
        coupler = {"length": place[k + 1] - at, "start": (at + x, y)}
        bodies[f"coupler{k}"] = fb.RigidBody.bar(**coupler, **rod)
        joints[f"left{k}"] = fb.Revolute(f"coupler{k}.start", f"crank{k}.end")
        joints[f"right{k}"] = fb.Revolute(f"coupler{k}.end", f"crank{k + 1}.end")
    # A rod from the first crank to the last is redundant and changes nothing.
    joints |= {"brace": fb.Distance("crank0.end", "crank14.end", place[14])} if brace else {}
    sensors = {f"F{k}": fb.Reaction(f"ground{k}") for k in range(15)}
    sensors |= {"r": fb.Position("crank14.end")}
    model = {"bodies": bodies, "joints": joints, "sensors": sensors}
    motion = run(fb.Mechanism(loads={"gravity": fb.Gravity()}, **model), 1.0, 1e-3)
    assert ("joint 'brace'" in motion.attrs.get("not_unique", [])) == brace
    radius = radius[:, None]
    span = place[14][:, None]
    half = np.sin(lean / 2)
    cranks = 12 * radius
    couplers = 0.8 * span  # masses
    arm = (cranks / 2 + couplers) * radius
    square = 9.81 * arm / (cranks * (radius**2 / 3 + 0.02**2 / 12) + couplers * radius**2)
    _, cn, dn, _ = ellipj(np.sqrt(square) * motion.time.values, half**2)
    theta = 2 * np.arcsin(half * cn / dn)
    exact = np.stack([span + radius * np.sin(theta), -radius * np.cos(theta)], axis=1)
    np.testing.assert_allclose(motion.sel(output=["r_X", "r_Y"]), exact, atol=2e-5)
    vertical_force = motion.sel(output=[f"F{k}_Y" for k in range(15)]).sum("output")
    fall = 2 * (np.cos(theta) - np.cos(lean)) * np.cos(theta) - np.sin(theta) ** 2
    np.testing.assert_allclose(
        vertical_force, 9.81 * (cranks + couplers) + arm * square * fall, rtol=1e-4
    )


def two_members(first, second, elements=3, force=None, rigid=False):
    """A cantilever of two members of 0.4 m, of Young's moduli `first` and `second` [Pa]."""
    a = {"length": 0.4, "height": 0.02, "width": 0.02, "density": 1000.0}
    b = a | {"start": (0.4, 0.0)}
    material = {"poissons_ratio": 0.3, "elements": elements}
    outer = fb.RigidBody.bar(**b) if rigid else fb.Beam(**b, **material, youngs_modulus=second)
    return fb.Mechanism(
        bodies={"a": fb.Beam(**a, **material, youngs_modulus=first), "b": outer},
        joints={"clamp": fb.Weld("a.start", (0.0, 0.0)), "weld": fb.Weld("b.start", "a.end")},
        loads={"P": fb.Force("b.end", y=force)} if force else {"gravity": fb.Gravity()},
        sensors={"tip": fb.Position("b.end")},
    )


def test_a_cantilever_of_stiff_and_soft_members_bends_as_beam_theory_says():
    """P (∫x²/EI + ∫1/kGA), where one member is 10⁴ times as stiff as the other."""
    first = np.array([1e6, 1e10, 1e10])
    second = np.array([1e10, 1e6, 1e10])
    force = 1e-5
    bending = np.array([0.8**3 - 0.4**3, 0.4**3]) * 4 / 0.02**4
    shear = 0.4 * 2.6 * 15.3 / 13 / 4e-4
    exact = force * ((bending[0] + shear) / first + (bending[1] + shear) / second)
    coarse, fine = (fb.equilibrium(two_members(first, second, n, force))[:, 1] for n in (4, 8))
    np.testing.assert_allclose((4 * fine - coarse) / 3, exact, rtol=1e-6)


def test_a_stiff_member_on_a_soft_one_falls_as_a_rigid_one():
    """The difference falls with the ratio of stiffness; steps are far longer than its periods."""
    ratios = np.array([1e2, 1e3, 1e4])
    rigid = run(two_members(1e7, 1e7, rigid=True), 0.6, 1e-3)
    assert float(rigid.sel(output="tip_Y").min()) < -0.4
    deviation = np.abs(run(two_members(1e7, 1e7 * ratios), 0.6, 1e-3) - rigid).max(
        ["time", "output"]
    )
    np.testing.assert_allclose(deviation[:-1] / deviation[1:], 10.0, rtol=0.1)


@pytest.mark.parametrize("radius", [0.0, 0.5, 0.8, 1.0])
def test_multipliers_have_order_two_from_the_first_step(radius):
    """In closed form, −v² − g·r of a mass on a rod, with v² = 9 − 2 g y."""
    model = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0, position=(1.0, 0.0), velocity=(0.0, 3.0))},
        joints={"rod": fb.Distance("m", (0.0, 0.0), 1.0)},
        loads={"gravity": fb.Gravity()},
        sensors={"F": fb.Reaction("rod"), "r": fb.Position("m")},
    )
    errors = []
    for step in (2e-3, 1e-3, 5e-4):
        Fx, Fy, x, y = run(model, 12 * step, step, radius).values
        errors.append(np.abs(Fx * x + Fy * y - (3 * 9.81 * y - 9.0)).max())
    assert (np.log2(np.array(errors)[:-1] / np.array(errors)[1:]) > 1.9).all()
