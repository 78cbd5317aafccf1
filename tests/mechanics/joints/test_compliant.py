"""Joints that give, against closed forms, free bodies with springs, and rigid joints."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import flexband as fb

STEEL = 7800.0


def disc(**motion):
    return fb.RigidBody.disc(radius=0.1, width=0.05, density=STEEL, **motion)


def mass_of(body):
    return float(body.mass)


def test_two_masses_on_a_rod_that_gives():
    """ω² = k (1/m₁ + 1/m₂), and the damping ratio is ω τ/2."""
    a = fb.PointMass(mass=2.0)
    b = fb.PointMass(mass=3.0, position=(0.5, 0.0))
    k = 4e4
    rod = fb.Compliant(fb.Distance("a", "b", 0.5), stiffness=k, damping=1e-4)
    rails = {name: fb.Slot(name, (0.0, 0.0)) for name in "ab"}
    train = fb.Mechanism(bodies={"a": a, "b": b}, joints={**rails, "rod": rod})
    modes = fb.modes(train, 2)
    square = k * (1 / 2.0 + 1 / 3.0)
    damping = np.sqrt(square) * 1e-4 / 2
    assert modes["frequency"].values[1] == pytest.approx(np.sqrt(square) / (2 * np.pi), rel=1e-9)
    assert modes["damping_ratio"].values[1] == pytest.approx(damping, rel=1e-9)


def test_a_jeffcott_rotor_in_anisotropic_bearings():
    """Whirls at √(k_x/m) and √(k_y/m); its unbalance e moves it by e Ω²/(k/m − Ω²)."""
    speed = 200.0
    e = 1e-4
    k = (2e6, 1e6)
    mass = mass_of(disc())
    bearing = fb.Compliant(fb.Revolute("rotor.shaft", (0.0, 0.0)), stiffness=k)

    def shaft(**motion):
        body = disc(**motion)
        return fb.RigidBody(
            mass=body.mass, inertia=body.inertia, points={"shaft": (-e, 0.0)}, **motion
        )

    whirl = [e * speed**2 / (stiffness / mass - speed**2) for stiffness in k]
    start = shaft(position=(e + whirl[0], 0.0), velocity=(0.0, (e + whirl[1]) * speed), rate=speed)
    machine = fb.Mechanism(
        bodies={"rotor": start},
        joints={"bearing": bearing, "motor": fb.PrescribedRotation("rotor", lambda t: speed * t)},
        sensors={"place": fb.Position("rotor.shaft"), "force": fb.Reaction("bearing")},
    )
    motion = fb.simulate(machine, duration=0.1, step=5e-5)
    x, y, fx, fy = motion.values
    turn = speed * motion["time"].values
    assert x == pytest.approx(whirl[0] * np.cos(turn), abs=2e-4 * whirl[0])
    assert y == pytest.approx(whirl[1] * np.sin(turn), abs=2e-4 * whirl[1])
    assert fx == pytest.approx(-k[0] * x, abs=1e-6)
    assert fy == pytest.approx(-k[1] * y, abs=1e-6)
    at_rest = fb.Mechanism(bodies={"rotor": disc()}, joints={
        "bearing": fb.Compliant(fb.Revolute("rotor", (0.0, 0.0)), stiffness=k)
    })  # fmt: skip
    frequencies = fb.modes(at_rest, 3)["frequency"].values[1:]
    assert frequencies == pytest.approx(np.sqrt([k[1] / mass, k[0] / mass]) / (2 * np.pi), rel=1e-9)


# Three free bodies with springs along what joints hold, whose elongations are written anew here.
# A body is (x, y, θ); a point is a body and its place in the body's axes.


def rotate(angle, v):
    c = np.cos(angle)
    s = np.sin(angle)
    return np.array([c * v[0] - s * v[1], s * v[0] + c * v[1]])


def place(q, body, at):
    return at if body is None else q[3 * body : 3 * body + 2] + rotate(q[3 * body + 2], at)


def angle_of(q, body):
    return 0.0 if body is None else q[3 * body + 2]


def in_axes(q, first, second):
    separation = place(q, *first) - place(q, *second)
    return rotate(-angle_of(q, second[0]), separation)


def elongations(kind, q, first, second, numbers):
    """Return travels that a joint holds, and whether each is an angle."""
    x, y = in_axes(q, first, second)
    turn = angle_of(q, first[0]) - angle_of(q, second[0])
    if kind == "Revolute":
        return [(x, False), (y, False)]
    if kind == "Weld":
        return [(x, False), (y, False), (turn - numbers["angle"], True)]
    a, b = np.array(numbers.get("axis", (1.0, 0.0))) / np.hypot(*numbers.get("axis", (1.0, 0.0)))
    if kind == "Slot":
        return [(a * y - b * x, False)]
    if kind == "Prismatic":
        return [(a * y - b * x, False), (turn - numbers["angle"], True)]
    if kind == "Rack":
        return [(a * x + b * y + numbers["radius"] * turn, False)]
    length = numbers["length"]
    return [((x**2 + y**2 - length**2) / (2 * length), False)]


KINDS = "Revolute", "Weld", "Slot", "Prismatic", "Rack", "Distance"


def draw(seed, kinds=KINDS):
    """Return three bodies and four joints, the last one to the ground."""
    rng = np.random.default_rng(seed)
    q = rng.uniform(-0.5, 0.5, 9)
    v = rng.uniform(-1.0, 1.0, 9)
    masses = rng.uniform(1.0, 3.0, (3, 2)) * [1.0, 0.02]
    joints = []
    for first, second in ((0, None), (1, 0), (2, 1), (2, None)):
        kind = str(rng.choice(kinds))
        ends = [(body, rng.uniform(-0.3, 0.3, 2)) for body in (first, second)]
        numbers = {
            "Weld": {"angle": rng.uniform(-1, 1)},
            "Slot": {"axis": tuple(rng.uniform(-1, 1, 2))},
            "Prismatic": {"axis": tuple(rng.uniform(-1, 1, 2)), "angle": rng.uniform(-1, 1)},
            "Rack": {"axis": tuple(rng.uniform(-1, 1, 2)), "radius": rng.uniform(0.1, 0.3)},
            "Distance": {"length": rng.uniform(0.2, 0.6)},
        }.get(kind, {})
        joints.append((kind, *ends, numbers, *rng.uniform([50, 5, 1e-3], [500, 50, 1e-2])))
    return q, v, masses, joints


def accelerations(q, v, masses, joints, start):
    """Return those of the free bodies, from −(k s + d ṡ) ∂s/∂q by complex steps."""
    force = np.zeros(9)
    n = range(9)
    for kind, first, second, numbers, k, tilt, tau in joints:
        rest_elongations = elongations(kind, start, first, second, numbers)
        complex_elongations = [
            elongations(kind, q + 1e-30j * (np.arange(9) == j), first, second, numbers) for j in n
        ]
        for row, (rest, angular) in enumerate(rest_elongations):
            stiffness = tilt if angular else k
            gradient = np.array([complex_elongations[j][row][0].imag / 1e-30 for j in n])
            s = complex_elongations[0][row][0].real - (rest if kind == "Rack" else 0.0)
            force -= (stiffness * s + stiffness * tau * gradient @ v) * gradient
    return force / masses[:, [0, 0, 1]].ravel()


def mechanism_of(q, v, masses, joints):
    def end(joint, side):
        body, at = joint[side]
        return tuple(at) if body is None else f"{'abc'[body]}.{joint[0]} {side} {id(joint)}"

    points = {name: {} for name in "abc"}
    for joint in joints:
        for side in (1, 2):
            body, at = joint[side]
            if body is not None:
                points["abc"[body]][end(joint, side).partition(".")[2]] = tuple(at)
    bodies = {
        name: fb.RigidBody(
            mass=masses[b, 0], inertia=masses[b, 1], points=points[name],
            position=tuple(q[3 * b : 3 * b + 2]), angle=q[3 * b + 2],
            velocity=tuple(v[3 * b : 3 * b + 2]), rate=v[3 * b + 2],
        )
        for b, name in enumerate("abc")
    }  # fmt: skip
    kinds = {kind: getattr(fb, kind) for kind in ("Revolute", "Weld", "Slot", "Prismatic", "Rack")}
    parts = {}
    for number, joint in enumerate(joints):
        kind, _, _, numbers, k, tilt, tau = joint
        rigid = kinds.get(kind, fb.Distance)(end(joint, 1), end(joint, 2), **numbers)
        tilts = kind in ("Weld", "Prismatic")
        parts[f"joint {number}"] = fb.Compliant(rigid, k, tilt if tilts else None, damping=tau)
    sensors = {}
    for name in "abc":
        sensors |= {f"r {name}": fb.Position(name), f"angle {name}": fb.Angle(name)}
    return fb.Mechanism(bodies=bodies, joints=parts, sensors=sensors)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.filterwarnings("ignore::flexband.errors.FlexbandWarning")
def test_random_mechanisms_move_as_free_bodies_with_springs(seed):
    """The error falls with the square of the step, so that two of them give the fourth order."""
    q, v, masses, joints = draw(seed)

    def rates(t, state):
        return [*state[9:], *accelerations(state[:9], state[9:], masses, joints, q)]

    exact = solve_ivp(rates, (0.0, 0.2), [*q, *v], method="DOP853", rtol=1e-11, atol=1e-12)
    mechanism = mechanism_of(q, v, masses, joints)
    steps = (5e-4, 2.5e-4)
    coarse, fine = (fb.simulate(mechanism, duration=0.2, step=h).values[:, -1] for h in steps)
    errors = [np.abs(x - exact.y[:9, -1]).max() for x in (coarse, fine, (4 * fine - coarse) / 3)]
    assert errors[1] < 1e-4
    assert errors[0] > 3 * errors[1]
    assert errors[2] < 2e-6


def linear_springs(t, x, v, p, force):
    """Fill in the forces of springs along a x + b y + c φ − s₀ in the axes of the second body.

    Each has the numbers a, b, c, s₀, stiffness and damping.
    """
    for n in range(0, len(p), 6):
        s = -p[n + 3]
        rate = 0.0
        for i in range(3):
            s += p[n + i] * x[2, i]
            rate += p[n + i] * v[2, i]
        for i in range(3):
            force[2, i] -= p[n + i] * (p[n + 4] * s + p[n + 5] * rate)


def rod(t, x, v, p, force):
    """Fill in the forces of a spring along (d · d − ℓ²)/2ℓ, from ℓ, stiffness and damping."""
    s = (x[2, 0] ** 2 + x[2, 1] ** 2 - p[0] ** 2) / (2 * p[0])
    rate = (x[2, 0] * v[2, 0] + x[2, 1] * v[2, 1]) / p[0]
    for i in range(2):
        force[2, i] -= x[2, i] / p[0] * (p[1] * s + p[2] * rate)


def law_of(joint, points, start):
    """Return a joint of `draw` that gives as a user's force law."""
    kind, first, second, numbers, k, tilt, tau = joint
    if kind == "Distance":
        return fb.ForceLaw(points, rod, [numbers["length"], k, tau * k], within=[(0, 1)])
    a, b = np.array(numbers.get("axis", (1.0, 0.0))) / np.hypot(*numbers.get("axis", (1.0, 0.0)))
    turn = (0, 0, 1, numbers.get("angle"), tilt, tau * tilt)
    ((rest, _), *_) = elongations(kind, start, first, second, numbers)
    rows = {
        "Revolute": [(1, 0, 0, 0, k, tau * k), (0, 1, 0, 0, k, tau * k)],
        "Weld": [(1, 0, 0, 0, k, tau * k), (0, 1, 0, 0, k, tau * k), turn],
        "Slot": [(-b, a, 0, 0, k, tau * k)],
        "Prismatic": [(-b, a, 0, 0, k, tau * k), turn],
        "Rack": [(a, b, numbers.get("radius"), rest, k, tau * k)],
    }[kind]
    parameters = [float(number) for row in rows for number in row]
    return fb.ForceLaw(points, linear_springs, parameters, within=[(0, 1)])


@pytest.mark.parametrize("seed", range(10, 12))
@pytest.mark.filterwarnings("ignore::flexband.errors.FlexbandWarning")
def test_random_mechanisms_move_as_with_force_laws_of_a_user(seed):
    """Both rules are of second order; the laws are not part of the tangent."""
    q, v, masses, joints = draw(seed)
    mechanism = mechanism_of(q, v, masses, joints)
    laws = {
        name: law_of(joint, list(part.points), q)
        for joint, (name, part) in zip(joints, mechanism.joints.items(), strict=True)
    }
    law_mechanism = fb.Mechanism(bodies=mechanism.bodies, loads=laws, sensors=mechanism.sensors)
    differences = []
    for step in (5e-4, 2.5e-4):
        motions = (
            fb.simulate(m, duration=0.2, step=step).values for m in (mechanism, law_mechanism)
        )
        differences.append(np.abs(np.subtract(*motions)).max())
    assert differences[1] < 2e-5
    assert differences[1] < 0.3 * differences[0]


@pytest.mark.parametrize("seed", range(2))
def test_frequencies_about_a_loaded_equilibrium(seed):
    """The tangent has what tensions do: frequencies are those of the Hessian of the energy."""
    q, v, masses, joints = draw(100 + seed, ("Revolute", "Weld", "Distance"))
    joints[0] = ("Weld", *joints[0][1:3], {"angle": 0.3}, *joints[0][4:])
    mechanism = mechanism_of(q, 0 * v, masses, joints)
    mechanism = replace(mechanism, loads={"gravity": fb.Gravity()})
    rest = fb.equilibrium(mechanism)
    at = rest.values
    weight = np.zeros(9)
    weight[1::3] = -9.81 * masses[:, 0]
    size = masses[:, [0, 0, 1]].ravel()

    def gradient(place):
        elastic_joints = [(*joint[:6], 0.0) for joint in joints]
        return weight + size * accelerations(place, np.zeros(9), masses, elastic_joints, q)

    assert np.abs(gradient(at)).max() < 1e-5 * np.abs(weight).max()
    h = 1e-6
    hessian = -np.array(
        [(gradient(at + h * e) - gradient(at - h * e)) / (2 * h) for e in np.eye(9)]
    )
    square = np.linalg.eigvalsh(hessian / np.sqrt(np.outer(size, size)))
    assert square.min() > 0
    undamped_joints = [(*joint[:6], 0.0) for joint in joints]
    undamped_mechanism = replace(
        mechanism_of(at, 0 * v, masses, undamped_joints), loads={"gravity": fb.Gravity()}
    )
    frequencies = fb.modes(undamped_mechanism, 9, about="equilibrium")["frequency"].values
    assert frequencies == pytest.approx(np.sqrt(square) / (2 * np.pi), rel=1e-6)


def bar(**start):
    return fb.RigidBody.bar(length=0.5, height=0.02, width=0.02, density=STEEL, **start)


def pendulum(joint, sensors=()):
    return fb.Mechanism(
        bodies={"bar": bar()},
        joints={"pin": joint},
        loads={"gravity": fb.Gravity()},
        sensors={"end": fb.Position("bar.end"), "pin": fb.Reaction("pin"), **dict(sensors)},
    )


@pytest.mark.filterwarnings("ignore::flexband.errors.FlexbandWarning")
def test_a_stiff_joint_is_the_rigid_one():
    """What it gives is a hundredth at a hundred times the stiffness."""
    pin = fb.Revolute("bar.start", (0.0, 0.0))
    rigid = fb.simulate(pendulum(pin), duration=0.4, step=5e-4)
    deviations = []
    for stiffness in (1e5, 1e7):
        compliant_pin = fb.Compliant(pin, stiffness=stiffness, damping=1e-3)
        motion = fb.simulate(pendulum(compliant_pin), duration=0.4, step=5e-4)
        deviations.append(np.abs((motion - rigid).values[:, 400:]).max(axis=1))
    assert deviations[1][:2] == pytest.approx(deviations[0][:2] / 100, rel=0.3)
    assert np.all(deviations[1][2:] < 2e-3 * 15)  # of the weight [N]


@pytest.mark.filterwarnings("ignore::flexband.errors.FlexbandWarning")
@pytest.mark.parametrize(
    "joint",
    [
        fb.Revolute("bar.start", (0.0, 0.0)),
        fb.Weld("bar.start", (0.0, 0.0)),
        fb.Prismatic("bar.start", (0.0, 0.0), axis=(1.0, 2.0)),
        fb.Distance("bar.start", (0.3, 0.2), 0.4),
    ],
)
def test_energy_balances(joint):
    """Elastic, kinetic and potential energy change by what the dampers take."""
    tilt = 300.0 if isinstance(joint, fb.Weld | fb.Prismatic) else None
    sensors = {
        "T": fb.KineticEnergy(), "U": fb.ElasticEnergy(), "V": fb.PotentialEnergy(),
        "W": fb.Work("pin"), "P": fb.sensors.Power("pin"),
    }  # fmt: skip
    for damping in (0.0, 2e-3):
        compliant_joint = fb.Compliant(joint, 5e3, tilt, damping=damping)
        motion = fb.simulate(pendulum(compliant_joint, sensors), duration=0.5, step=1e-4)
        T, U, V, W, P = (motion.sel(output=name).values for name in "TUVWP")
        size = T.max()
        assert T + V - (T + V)[0] == pytest.approx(W, abs=2e-5 * size)
        dissipation = -W - (U - U[0])
        assert dissipation[-1] > 1e-4 * size if damping else np.abs(dissipation).max() < 2e-5 * size
        assert np.all(np.diff(dissipation) > -1e-6 * size)
        power = np.cumsum((P[1:] + P[:-1]) / 2) * 1e-4
        assert power == pytest.approx(W[1:], abs=2e-4 * size)


def test_a_guide_with_two_carriages_shares_its_load_as_springs_do():
    """Two slots hold one motion twice where there is a third: rigid reactions are not unique."""
    places = {"a": -0.2, "b": 0.0, "c": 0.3}
    body = fb.RigidBody(
        mass=2.0, inertia=0.05, points={name: (x, 0.0) for name, x in places.items()}
    )
    stiffness = {"a": 1e5, "b": 2e5, "c": 4e5}
    joints = {
        name: fb.Compliant(fb.Slot(f"body.{name}", (0.0, 0.0)), stiffness=k)
        for name, k in stiffness.items()
    }
    guide = fb.Mechanism(
        bodies={"body": body},
        joints={**joints, "stop": fb.PrescribedTravel("body", (0.0, 0.0), lambda t: 0.0)},
        loads={"gravity": fb.Gravity()},
        sensors={name: fb.Reaction(name) for name in places},
    )
    x = np.array(list(places.values()))
    k = np.array(list(stiffness.values()))
    matrix = np.array([[k.sum(), k @ x], [k @ x, k @ x**2]])  # of the sink and the turn
    sink, turn = np.linalg.solve(matrix, [2.0 * 9.81, 0.0])
    rest = fb.equilibrium(guide)
    reactions = [float(rest.sel(output=f"{name}_Y")) for name in places]
    assert reactions == pytest.approx(k * (sink + turn * x), rel=1e-6)


def test_a_motor_and_gears_that_give():
    """A train in equilibrium is wound up by M/k at each spring, gears by their radii."""

    def wheel(radius, x):
        return fb.RigidBody.disc(radius=radius, width=0.01, density=STEEL, position=(x, 0.0))

    r1 = 0.2
    r2 = 0.1
    moment = 3.0
    teeth = 1e5
    motor = 40.0
    train = fb.Mechanism(
        bodies={"wheel": wheel(r1, 0.0), "pinion": wheel(r2, 0.3)},
        joints={
            "axle": fb.Revolute("wheel", (0.0, 0.0)),
            "shaft": fb.Revolute("pinion", (0.3, 0.0)),
            "mesh": fb.Compliant(
                fb.Gear("wheel", "pinion", first_radius=r1, second_radius=r2), stiffness=teeth
            ),
            "motor": fb.Compliant(
                fb.PrescribedRotation("wheel", lambda t: 0.1), tilt_stiffness=motor
            ),
        },
        loads={"load": fb.Moment("pinion", moment)},
        sensors={
            "wheel": fb.Angle("wheel"), "pinion": fb.Angle("pinion"),
            "mesh": fb.Reaction("mesh"), "motor": fb.ReactionMoment("motor"),
        },
    )  # fmt: skip
    rest = fb.equilibrium(train)
    wheel_turn, pinion_turn, _, force, drive = (
        float(rest.sel(output=name)) for name in ("wheel", "pinion", "mesh_X", "mesh_Y", "motor")
    )
    tooth = moment / r2
    turn = 0.1 - tooth * r1 / motor
    assert abs(force) == pytest.approx(tooth, rel=1e-9)
    assert abs(drive) == pytest.approx(tooth * r1, rel=1e-9)
    assert abs(wheel_turn) == pytest.approx(abs(turn), rel=1e-9)
    assert r1 * wheel_turn + r2 * pinion_turn == pytest.approx(tooth / teeth, rel=1e-6)


def test_it_goes_on_from_a_result():
    compliant_weld = fb.Compliant(fb.Weld("bar.start", (0.0, 0.0)), 1e5, 500.0, damping=1e-4)
    machine = pendulum(compliant_weld)
    first = fb.simulate(machine, duration=0.1, step=1e-3, keep_state=True)
    second = fb.simulate(machine, duration=0.1, step=1e-3, start=first)
    full_motion = fb.simulate(machine, duration=0.2, step=1e-3)
    assert second.values == pytest.approx(full_motion.values[:, 100:], rel=1e-9, abs=1e-9)


@pytest.mark.parametrize(
    ("joint", "numbers", "text"),
    [
        (fb.Revolute("m", (0.0, 0.0), radius=0.1, friction=0.2), {}, "clearance, friction"),
        (fb.Revolute("m", (0.0, 0.0), offset=(1e-3, 0.0)), {}, "with an offset, or with play"),
        (fb.contact.Switched(fb.Revolute("m", (0.0, 0.0)), lambda t: t > 1), {}, "switches"),
        (fb.Compliant(fb.Revolute("m", (0.0, 0.0)), 1.0), {}, "gives already"),
        (fb.Weld("m", (0.0, 0.0)), {}, "a Weld that is Compliant needs a tilt_stiffness"),
        (fb.Revolute("m", (0.0, 0.0)), {"tilt_stiffness": 1.0}, "holds nothing with a tilt"),
        (fb.Revolute("m", (0.0, 0.0)), {"stiffness": None}, "needs a stiffness; got None"),
        (fb.Slot("m", (0.0, 0.0)), {"stiffness": (1.0, 2.0)}, "directions, which are 1; got 2"),
        (fb.Revolute("m", (0.0, 0.0)), {"stiffness": -1.0}, "must be positive"),
        (fb.Distance("m", (0.0, 0.0), lambda t: 1.0), {}, "a cylinder cannot be Compliant"),
        (fb.PrescribedTravel("m", (0.0, 0.0), np.sin), {"damping": 1.0}, "needs damping 0"),
        ("pin", {}, "must be a joint"),
    ],
)
def test_what_cannot_give_is_refused_by_name(joint, numbers, text):
    def build():
        compliant_joint = fb.Compliant(joint, **{"stiffness": 1.0, **numbers})
        body = fb.RigidBody(mass=1.0, inertia=1.0)
        return fb.Mechanism(bodies={"m": body}, joints={"pin": compliant_joint})

    with pytest.raises(fb.errors.InputError, match=text):
        build()


def test_a_joint_that_starts_far_from_where_it_holds_is_named():
    compliant_pin = fb.Compliant(fb.Revolute("bar.start", (0.05, 0.0)), stiffness=1e4)
    with pytest.warns(fb.errors.FlexbandWarning, match="joint 'pin' starts 0.05 m from where"):
        fb.simulate(pendulum(compliant_pin), duration=1e-3, step=1e-4)
    fb.equilibrium(pendulum(compliant_pin))
