"""Gears, racks, torsion springs, friction and force laws against exact motions."""

import numpy as np
import pytest

import flexband as fb

from .models import Dense

UNDAMPED = fb.GeneralizedAlpha(spectral_radius=1.0)


def wheel(mass=1.0, inertia=0.5, **start):
    return fb.RigidBody(mass=mass, inertia=inertia, points={"rim": (0.1, 0.0)}, **start)


def test_a_torsion_pendulum():
    """J θ̈ + d θ̇ + k θ = 0 from rest at θ₀, and its frequency."""
    J, k, d, start = 0.5, np.array([8.0, 20.0]), 0.3, 0.7
    model = fb.Mechanism(
        bodies={"w": wheel(inertia=J, angle=start)},
        joints={"pin": fb.Revolute("w", (0.0, 0.0))},
        loads={"t": fb.TorsionSpring("w", (0.0, 0.0), stiffness=k, rest_angle=0.0, damping=d)},
        sensors={"a": fb.Angle("w"), "m": fb.SpringMoment("t"), "E": fb.ElasticEnergy()},
    )
    motion = fb.simulate(model, duration=2.0, step=1e-3, integrator=UNDAMPED)
    t, zeta = motion["time"].values, d / (2 * J)
    w = np.sqrt(k / J - zeta**2)[:, None]
    exact = start * np.exp(-zeta * t) * (np.cos(w * t) + zeta / w * np.sin(w * t))
    angle, moment = motion.sel(output="a"), motion.sel(output="m_M")
    np.testing.assert_allclose(angle, exact, atol=5e-5)
    rate = np.gradient(exact, t, axis=1, edge_order=2)
    np.testing.assert_allclose(moment, -k[:, None] * exact - d * rate, atol=2e-3)
    np.testing.assert_allclose(motion.sel(output="E"), 0.5 * k[:, None] * angle**2, atol=1e-9)
    undamped = fb.Mechanism(
        bodies=model.bodies, joints=model.joints, sensors=model.sensors,
        loads={"t": fb.TorsionSpring("w", (0.0, 0.0), stiffness=k, rest_angle=0.0)},
    )  # fmt: skip
    found = fb.modes(undamped, 1)["frequency"][:, 0]
    np.testing.assert_allclose(found, np.sqrt(k / J) / (2 * np.pi), rtol=1e-7)


def test_a_torsion_spring_counts_turns_and_a_motor_winds_it_up():
    """A weak spring, relaxed at the start, and a moment that turns the wheel many times."""
    J, k, T = 0.5, 0.02, 3.0
    model = fb.Mechanism(
        bodies={"w": wheel(inertia=J, angle=0.4)},
        joints={"pin": fb.Revolute("w", (0.0, 0.0))},
        loads={"t": fb.TorsionSpring("w", (0.0, 0.0), stiffness=k, torque=lambda t: T)},
        sensors={"a": fb.Angle("w"), "W": fb.Work("t"), "E": fb.KineticEnergy()},
    )
    motion = fb.simulate(model, duration=5.0, step=1e-3)
    t, w = motion["time"].values, np.sqrt(k / J)
    exact = T / k * (1 - np.cos(w * t))
    assert exact[-1] > 4 * 2 * np.pi
    np.testing.assert_allclose(motion.sel(output="a") - 0.4, exact, rtol=2e-4, atol=1e-6)
    work, energy = motion.sel(output="W"), motion.sel(output="E")
    np.testing.assert_allclose(work, energy, atol=1e-3 * float(energy.max()))


def test_friction_in_a_guide_and_in_a_pin():
    """v = v₀ e^(−dt/m) and ω = ω₀ e^(−dt/J)."""
    m, J, d = 2.0, 0.5, np.array([0.8, 3.0])
    block = fb.RigidBody(mass=m, inertia=1.0, velocity=(1.5, 0.0))
    spun = wheel(inertia=J, position=(0.0, 1.0), rate=4.0)
    model = fb.Mechanism(
        bodies={"b": block, "w": spun},
        joints={"guide": fb.Prismatic("b", (0.0, 0.0)), "pin": fb.Revolute("w", (0.0, 1.0))},
        loads={
            "f": fb.ViscousFriction("b", (0.0, 0.0), d),
            "p": fb.TorsionSpring("w", (0.0, 1.0), damping=d),
        },
        sensors={"v": fb.Velocity("b"), "w": fb.AngularVelocity("w")},
    )
    motion = fb.simulate(model, duration=1.0, step=1e-3, integrator=UNDAMPED)
    t = motion["time"].values
    decay = np.exp(-d[:, None] * t)
    np.testing.assert_allclose(motion.sel(output="v_X"), 1.5 * decay ** (1 / m), atol=1e-5)
    np.testing.assert_allclose(motion.sel(output="w"), 4.0 * decay ** (1 / J), atol=2e-5)


def drag(t, x, v, p, force):
    """Air drag with the square of the speed, and a pull that grows with time."""
    speed = np.sqrt(v[0, 0] ** 2 + v[0, 1] ** 2)
    force[0, 0] = -p[0] * speed * v[0, 0]
    force[0, 1] = -p[0] * speed * v[0, 1] + p[1]


def test_a_law_of_the_users_own():
    """Fall with drag in proportion to v²: v = v∞ tanh(g t/v∞)."""
    m, g, c = 2.0, 9.81, np.linspace(0.1, 0.5, 11)
    model = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=m)},
        loads={"drag": fb.ForceLaw(["m"], drag, (c, lambda t: -m * g))},
        sensors={"v": fb.Velocity("m")},
    )
    motion = fb.simulate(model, duration=2.0, step=1e-3, integrator=UNDAMPED)
    limit = np.sqrt(m * g / c)[:, None]
    exact = -limit * np.tanh(g * motion["time"].values / limit)
    np.testing.assert_allclose(motion.sel(output="v_Y"), exact, atol=1e-5)


def spring_and_moment(t, x, v, p, force):
    """A spring between two points, and a moment on the second by its angle."""
    for axis in range(2):
        pull = p[0] * (x[0, axis] - x[1, axis])
        force[0, axis] = -pull
        force[1, axis] = pull
    force[1, 2] = -p[1] * x[1, 2]


def test_a_law_on_a_beam_is_the_load_that_it_stands_for():
    def model(loads):
        beam = fb.Beam(
            length=0.5, height=0.004, width=0.01, density=1000.0, youngs_modulus=1e8,
            poissons_ratio=0.3, elements=4,
        )  # fmt: skip
        return fb.Mechanism(
            bodies={"b": beam},
            joints={"pin": fb.Revolute("b.start", (0.0, 0.0))},
            loads={"g": fb.Gravity(), **loads},
            sensors={"tip": fb.Position("b.end"), "angle": fb.Angle("b.0.3")},
        )

    law = fb.ForceLaw([(0.5, 0.3), "b.0.3"], spring_and_moment, (4.0, 0.01))
    plain = {
        "s": fb.Spring((0.5, 0.3), "b.0.3", 4.0, rest_length=0.0),
        "t": fb.TorsionSpring("b.0.3", (0.0, 0.0), 0.01, rest_angle=0.0),
    }
    own = fb.simulate(model({"law": law}), duration=0.3, step=1e-3)
    same = fb.simulate(model(plain), duration=0.3, step=1e-3)
    assert np.ptp(same.values, axis=1).min() > 0.01
    np.testing.assert_allclose(own, same, atol=1e-7)
    np.testing.assert_allclose(
        fb.equilibrium(model({"law": law})), fb.equilibrium(model(plain)), atol=1e-7
    )


def gears(radii, inertias, **joints):
    r1, r2 = radii
    first = wheel(inertia=inertias[0], angle=0.3)
    second = wheel(inertia=inertias[1], position=(r1 + r2, 0.0), angle=-0.5)
    return {"1": first, "2": second}, {
        "A": fb.Revolute("1", (0.0, 0.0)),
        "B": fb.Revolute("2", (r1 + r2, 0.0)),
        "mesh": fb.Gear("1", "2", r1, r2),
        **joints,
    }


@pytest.mark.parametrize("second", [0.3, -0.5])
def test_a_gear_pair_driven_by_a_moment(second):
    """(J₁ + J₂ (r₁/r₂)²) α = T, the tooth force is J₂ α r₁/r₂²; a ring gear turns the same way."""
    r1, r2, J1, J2, T = 0.1, second, 0.4, 2.0, np.array([1.0, 5.0])
    bodies, joints = gears((r1, r2), (J1, J2))
    model = fb.Mechanism(
        bodies=bodies, joints=joints, loads={"T": fb.Moment("1", T)},
        sensors={"a": fb.Angle("1"), "b": fb.Angle("2"), "F": fb.Reaction("mesh"),
                 "A": fb.Reaction("A"), "W": fb.Work("T"), "E": fb.KineticEnergy()},
    )  # fmt: skip
    motion = fb.simulate(model, duration=2.0, step=1e-3)
    t, alpha = motion["time"].values, T / (J1 + J2 * (r1 / r2) ** 2)
    turned = 0.5 * alpha[:, None] * t**2
    assert turned.max() > 2 * np.pi
    np.testing.assert_allclose(motion.sel(output="a") - 0.3, turned, atol=1e-4 * turned.max())
    np.testing.assert_allclose(
        motion.sel(output="b") + 0.5, -turned * r1 / r2, atol=1e-4 * turned.max()
    )
    tooth = -J2 * alpha * r1 / r2**2  # on the first gear, against its turning
    late = motion.sel(time=slice(0.1, None))
    exact = np.broadcast_to(tooth[:, None], late.sel(output="F_Y").shape)
    np.testing.assert_allclose(late.sel(output="F_Y"), exact, rtol=1e-3)
    np.testing.assert_allclose(late.sel(output="A_Y"), -exact, rtol=1e-3)
    np.testing.assert_allclose(late.sel(output="F_X"), 0.0, atol=1e-6)
    np.testing.assert_allclose(motion.sel(output="W"), motion.sel(output="E"), rtol=1e-3, atol=1e-4)


def test_a_planetary_gear():
    """Sun driven, ring fixed: the arm turns at ω_sun r_s/(r_s + r_r), the planet by Willis."""
    sun, planet = 0.1, 0.05
    ring = sun + 2 * planet
    arm = fb.RigidBody.bar(length=sun + planet, height=0.01, width=0.01, density=1000.0)
    model = fb.Mechanism(
        bodies={
            "sun": wheel(), "arm": arm,
            "planet": wheel(position=(sun + planet, 0.0)), "ring": wheel(),
        },
        joints={
            "S": fb.Revolute("sun", (0.0, 0.0)),
            "A": fb.Revolute("arm.start", (0.0, 0.0)),
            "P": fb.Revolute("planet", "arm.end"),
            "R": fb.Weld("ring", (0.0, 0.0)),
            "inner": fb.Gear("sun", "planet", sun, planet),
            "outer": fb.Gear("planet", "ring", planet, -ring),
            "motor": fb.PrescribedRotation("sun", lambda t: 30.0 * t),
        },
        sensors={"arm": fb.Angle("arm"), "planet": fb.Angle("planet")},
    )  # fmt: skip
    assert "0 degrees of freedom" in fb.describe(model)
    motion = fb.simulate(model, duration=2.0, step=1e-3)
    t = motion["time"].values
    arm_turned = 30.0 * t * sun / (sun + ring)
    np.testing.assert_allclose(motion.sel(output="arm"), arm_turned, atol=1e-8)
    exact = arm_turned - (30.0 * t - arm_turned) * sun / planet
    np.testing.assert_allclose(motion.sel(output="planet"), exact, atol=1e-7)


@pytest.mark.parametrize("radius", [0.2, -0.2])
def test_a_rack_and_pinion(radius):
    """A pinion on a fixed centre pulls its rack along: (J + m r²) α = T."""
    J, m, T, tilt = 0.5, 3.0, 2.0, 0.6
    c, s = np.cos(tilt), np.sin(tilt)
    rack = fb.RigidBody(mass=m, inertia=0.1, position=(radius * s, -radius * c), angle=tilt)
    model = fb.Mechanism(
        bodies={"p": wheel(inertia=J, angle=1.0), "r": rack},
        joints={
            "pin": fb.Revolute("p", (0.0, 0.0)),
            "guide": fb.Prismatic("r", (radius * s, -radius * c), axis=(c, s), angle=tilt),
            "mesh": fb.Rack("p", "r", radius),
        },
        loads={"T": fb.Moment("p", T)},
        sensors={"a": fb.Angle("p"), "r": fb.Position("r"), "F": fb.Reaction("mesh"),
                 "M": fb.ReactionMoment("mesh")},
    )  # fmt: skip
    motion = fb.simulate(model, duration=2.0, step=1e-3)
    t, alpha = motion["time"].values, T / (J + m * radius**2)
    turned = 0.5 * alpha * t**2
    np.testing.assert_allclose(motion.sel(output="a") - 1.0, turned, atol=1e-4 * turned.max())
    way = radius * turned
    np.testing.assert_allclose(motion.sel(output="r_X") - radius * s, way * c, atol=1e-4)
    np.testing.assert_allclose(motion.sel(output="r_Y") + radius * c, way * s, atol=1e-4)
    late = motion.sel(time=slice(0.1, None))
    force = -m * radius * alpha
    np.testing.assert_allclose(late.sel(output="F_X"), force * c, rtol=1e-3)
    np.testing.assert_allclose(late.sel(output="M"), force * radius, rtol=1e-3)


def test_a_rolling_wheel():
    """A wheel on a slope rolls with g sin β/(1 + J/mr²): the rack is the ground."""
    m, J, r, slope = 2.0, 0.03, 0.2, 0.3
    c, s = np.cos(-slope), np.sin(-slope)
    disc = fb.RigidBody(mass=m, inertia=J, position=(-r * s, r * c))
    model = fb.Mechanism(
        bodies={"w": disc},
        joints={
            "height": fb.Slot("w", (-r * s, r * c), axis=(c, s)),
            "roll": fb.Rack("w", (0.0, 0.0), r, axis=(c, s)),
        },
        loads={"g": fb.Gravity()},
        sensors={"w": fb.Position("w"), "a": fb.Angle("w")},
    )
    motion = fb.simulate(model, duration=1.5, step=1e-3)
    t = motion["time"].values
    way = 0.5 * 9.81 * np.sin(slope) / (1 + J / (m * r**2)) * t**2
    np.testing.assert_allclose(motion.sel(output="w_X"), -r * s + way * c, atol=1e-4)
    np.testing.assert_allclose(motion.sel(output="a"), -way / r, rtol=2e-5, atol=1e-6)


def test_tangent_is_the_derivative_of_the_residual():
    """Gears, a rack and laws on bodies and on a beam's section, in any state, multipliers too."""
    r1, r2 = 0.1, 0.25
    bodies, joints = gears((r1, r2), (0.4, 0.3))
    beam = fb.Beam(length=0.4, height=0.02, width=0.01, elements=1, density=1000.0,
                   youngs_modulus=1e4, poissons_ratio=0.3, start=(r1 + r2, 0.2))  # fmt: skip
    model = fb.Mechanism(
        bodies=bodies | {"b": beam},
        joints={
            "mesh": joints["mesh"],
            "rack": fb.Rack("b.0.3", "2", 0.2, axis=(0.6, 0.8)),
            "more": fb.Gear("b.end", "1", 0.3, 0.1),
        },
        loads={
            "t": fb.TorsionSpring("b.0.7", "1", 3.0, rest_angle=0.2, cubic=2.0),
            "l": fb.ForceLaw(["1", "b.0.3"], spring_and_moment, (4.0, 0.01)),
        },
    )  # fmt: skip
    dense = Dense(model)
    dense.values.laws.parameter[4] = 0.2
    count = dense.structure.state.coordinates
    rng = np.random.default_rng(3)
    unknowns = np.concatenate(
        [dense.start + 0.05 * rng.standard_normal(count), rng.standard_normal(3)]
    )
    step = 1e-6
    exact = np.stack(
        [
            (dense.residual(unknowns + step * e) - dense.residual(unknowns - step * e)) / (2 * step)
            for e in np.eye(len(unknowns))
        ],
        axis=1,
    )
    own = dense.tangent(unknowns) - dense.tangent(unknowns, 0.0)
    Phi = dense.tangent(unknowns, 0.0)
    np.testing.assert_allclose(own[:count, :count], exact[:count, :count], atol=2e-6)
    np.testing.assert_allclose(Phi[count:, :count], exact[count:, :count], atol=1e-8)


def does_not_compile(t, x, v, p, force):
    force[0] = {"no": object()}


def force_law(points, law, parameters=()):
    return fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0)}, loads={"l": fb.ForceLaw(points, law, parameters)}
    )


@pytest.mark.parametrize(
    ("make", "text"),
    [
        (lambda: force_law(["m"], does_not_compile), "does not compile"),
        (lambda: force_law("m", drag), "points must be a list"),
        (lambda: force_law([], drag), "points must be a list"),
        (lambda: force_law(["x"], drag, (1.0, 1.0)), "load 'l': body 'x' is not"),
        (lambda: force_law(["m"], drag, (np.nan, 1.0)), "ForceLaw parameter 0"),
        (lambda: force_law(["m"], 3.0), "law must be a function"),
        (lambda: fb.TorsionSpring("a", "b", stiffness=-1.0), "TorsionSpring stiffness"),
        (lambda: fb.ViscousFriction("a", "b", -1.0), "ViscousFriction damping"),
        (lambda: fb.Gear("a", "b", 0.1, -0.1), "Gear radii"),
        (lambda: fb.Gear("a", "b", 0.0, 0.1), "Gear radii"),
        (lambda: fb.Rack("a", "b", 0.0), "Rack radius"),
        (
            lambda: fb.Mechanism(
                bodies={"m": fb.PointMass(mass=1.0)},
                loads={"f": fb.ViscousFriction("m", (0.0, 0.0), 1.0)},
                sensors={"W": fb.Work("f")},
            ),
            "sensor 'W': the work of a ViscousFriction is not known",
        ),
        (lambda: fb.Rack("a", "b", 0.1, axis=(0.0, 0.0)), "Rack axis must have a length"),
    ],
)
def test_bad_laws_and_gears_are_refused(make, text):
    with pytest.raises(fb.InputError, match=text):
        make()


def test_descriptions_name_the_points_of_laws_and_gears():
    bodies, joints = gears((0.1, 0.2), (0.4, 0.3))
    law = fb.ForceLaw(["1", (0.3, 0.2)], spring_and_moment, (4.0, 0.01))
    text = fb.describe(fb.Mechanism(bodies=bodies, joints=joints, loads={"l": law}))
    assert "1 – 2" in text
    assert "1 – (0.3, 0.2)" in text
    assert "1 degrees of freedom" in text
