"""The engine takes vectors of three components: bodies with twelve coordinates, against SciPy.

The body is written here, in forms; there is no spatial body in flexband yet.
"""

import warnings

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

import flexband as fb
from flexband.mechanics.joints.joint import Joint, PairJoint
from flexband.mechanics.kernels.forms import (
    Form,
    add,
    constant_vector,
    length,
    scale,
    subtract,
)
from flexband.mechanics.kernels.relation_forms import meet, parallel, turn
from flexband.mechanics.loads.load import Entries, SpringEntry
from tests.mechanics.space import INERTIA, MASS, Coordinates, SpatialBody, axes_of

ignore_resolution = pytest.mark.filterwarnings("ignore::flexband.errors.ResolutionWarning")

WEIGHT = np.array([0.0, 0.0, -9.81 * MASS])


class Ball(Joint):
    """A ball at the origin."""

    def __init__(self, first):
        self.first = first

    def constraints(self, frame):
        return list(frame(self.first).position)


class Entered:
    """A load that is written in a test."""

    points = ()

    def __init__(self, enters):
        self.enters = enters


def weight(name):
    def enters(model):
        (row,) = [j for _, j, _ in model.frame(name).position[2].terms]
        return Entries(forces={row: Form.constant(WEIGHT[2])})

    return Entered(enters)


def rates_of_top(t, state):
    """Return Euler's equations of a body about its foot, axes and spin in its own axes."""
    turn = state[:9].reshape(3, 3)
    spin = state[9:]
    inertia = INERTIA + MASS * np.array([1.0, 0.0, 1.0])
    moment = np.cross([0.0, 1.0, 0.0], turn.T @ WEIGHT)
    change = (moment - np.cross(spin, inertia * spin)) / inertia
    return np.concatenate([np.cross(turn, spin).ravel(), change])


@ignore_resolution
def test_a_heavy_top_precesses():
    turn = Rotation.from_euler("xz", [0.4, 0.3])
    spin = np.array([0.5, 60.0, -2.0])  # in its axes
    place = turn.apply([0.0, 1.0, 0.0])
    angular_velocity = turn.apply(spin)
    top = fb.Mechanism(
        bodies={
            "top": SpatialBody(place, turn, np.cross(angular_velocity, place), angular_velocity)
        },
        joints={"tip": Ball("top.foot")},
        loads={"weight": weight("top")},
        sensors={"top": Coordinates("top")},
    )
    exact = solve_ivp(
        rates_of_top, (0.0, 0.5), [*turn.as_matrix().ravel(), *spin], method="DOP853", rtol=1e-11,
        atol=1e-11,
    ).y[:9, -1].reshape(3, 3)  # fmt: skip
    errors = []
    for step in (1e-3, 5e-4, 2.5e-4):
        motion = fb.simulate(top, duration=0.5, step=step)
        errors.append(np.abs(axes_of(motion, "top")[-1] - exact).max())
    assert errors[2] < 3e-3
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)
    assert errors[1] / errors[2] == pytest.approx(4.0, rel=0.1)


def spatial_pair(loads):
    """Return two free bodies, of which the second one spins about a tilted axis."""
    first = Rotation.from_euler("xyz", [0.3, -0.2, 0.5])
    second = Rotation.from_euler("y", 0.4)
    spin = second.apply([0.0, 0.0, 14.0])
    return fb.Mechanism(
        bodies={
            "a": SpatialBody((0.0, 0.0, 0.0), first, (0.1, 0.0, -0.2), (0.0, 0.3, 0.1)),
            "b": SpatialBody((0.4, 1.2, -0.5), second, (0.0, 0.2, 0.1), spin),
        },
        loads=loads,
        sensors={"a": Coordinates("a"), "b": Coordinates("b"), "U": fb.ElasticEnergy()},
    )


def rates_of_pair(forces):
    """Return the rates of two bodies: positions, axes, velocities and spins in their own axes."""

    def rates(t, state):
        places, turns, velocities, spins = np.split(state, [6, 24, 30])
        places, velocities, spins = (v.reshape(2, 3) for v in (places, velocities, spins))
        turns = turns.reshape(2, 3, 3)
        force, moment = forces(places, turns, velocities, spins)
        moment = np.einsum("bij,bi->bj", turns, moment)  # in the axes of the bodies
        change = (moment - np.cross(spins, INERTIA * spins)) / INERTIA
        turn_rates = np.stack(
            [np.cross(turn, spin) for turn, spin in zip(turns, spins, strict=True)]
        )
        return np.concatenate(
            [velocities.ravel(), turn_rates.ravel(), force.ravel() / MASS, change.ravel()]
        )

    return rates


def errors_of_pair(load, forces, duration=1.5, steps=(1e-3, 5e-4)):
    """Return the errors of the places and axes at the end with some steps."""
    pair = spatial_pair({"spring": load})
    bodies = [pair.bodies[name] for name in "ab"]
    start = [np.array([*map(float, body.start)]) for body in bodies]
    rates = [np.array([*map(float, body.rates)]) for body in bodies]
    turns = [q[3:].reshape(3, 3).T for q in start]
    spins = [
        np.array([(turn.T @ rate[3:].reshape(3, 3).T)[i, j] for i, j in ((2, 1), (0, 2), (1, 0))])
        for turn, rate in zip(turns, rates, strict=True)
    ]
    first = np.concatenate([
        *(q[:3] for q in start), *(turn.ravel() for turn in turns), *(v[:3] for v in rates), *spins
    ])  # fmt: skip
    exact = solve_ivp(
        rates_of_pair(forces), (0.0, duration), first, method="DOP853", rtol=1e-11, atol=1e-11
    ).y[:24, -1]  # fmt: skip
    errors = []
    for step in steps:
        motion = fb.simulate(pair, duration=duration, step=step)
        places = [motion.sel(output=[f"{n} {k}" for k in range(3)]).values[:, -1] for n in "ab"]
        axes = [axes_of(motion, name)[-1].ravel() for name in "ab"]
        errors.append(np.abs(np.concatenate([*places, *axes]) - exact).max())
    return errors, motion


@ignore_resolution
def test_a_spring_between_two_bodies_in_space():
    stiffness = 300.0
    damping = 2.0
    rest = 0.7

    def enters(model):
        separation = subtract(model.frame("a.foot").position, model.frame("b").position)
        return Entries(
            springs=[SpringEntry(length(separation), stiffness, rest, 0.0, damping, Form({}))]
        )

    def forces(places, turns, velocities, spins):
        lever = -turns[0][:, 1]
        separation = places[0] + lever - places[1]
        relative_velocity = velocities[0] + np.cross(turns[0] @ spins[0], lever) - velocities[1]
        size = np.linalg.norm(separation)
        tension = stiffness * (size - rest) + damping * (separation @ relative_velocity) / size
        pull = -tension * separation / size
        return np.array([pull, -pull]), np.array([np.cross(lever, pull), np.zeros(3)])

    errors, _ = errors_of_pair(Entered(enters), forces)
    assert errors[1] < 2e-3
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)


@ignore_resolution
def test_a_torsion_spring_about_a_tilted_axis_counts_turns():
    """The angle is that of b's first axis about a's third one, in the other axes of a.

    Its vector has products of coordinates of both bodies. The moments are those of virtual work.
    """
    stiffness = 0.05
    damping = 0.002

    def enters(model):
        a = model.frame("a")
        b = model.frame("b")
        spring = SpringEntry(turn(b, a), stiffness, 0.0, 0.0, damping, Form({}), angular=True)
        return Entries(springs=[spring])

    state = {"turn": 0.0}

    def forces(places, turns, velocities, spins):
        a = turns[0]
        u = turns[1][:, 0]
        x = u @ a[:, 0]
        y = u @ a[:, 1]
        angle = np.arctan2(y, x)
        state["turn"] = angle + 2 * np.pi * np.round((state["turn"] - angle) / (2 * np.pi))
        by_u = (x * a[:, 1] - y * a[:, 0]) / (x**2 + y**2)  # ∂θ/∂u
        by_axes = [np.cross(a[:, 0], -y * u), np.cross(a[:, 1], x * u)]
        of_b = np.cross(u, by_u)
        of_a = sum(by_axes) / (x**2 + y**2)
        rate = of_b @ (turns[1] @ spins[1]) + of_a @ (a @ spins[0])
        moment = -(stiffness * state["turn"] + damping * rate)
        return np.zeros((2, 3)), moment * np.array([of_a, of_b])

    errors, motion = errors_of_pair(Entered(enters), forces, duration=1.8)
    assert state["turn"] > 3 * 2 * np.pi
    energy = float(motion.sel(output="U")[-1])
    assert energy == pytest.approx(0.5 * stiffness * state["turn"] ** 2, rel=1e-2)
    assert errors[1] < 5e-3
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.15)


class Drive(PairJoint):
    """A pin along the third axes of both bodies, and the angle about it as a function of time."""

    def __init__(self, first, second, turn):
        self.first = first
        self.second = second
        self.turn = turn

    def constraints(self, frame):
        a = frame(self.second)
        b = frame(self.first)
        return [*meet(b, a), *parallel(b, a), turn(b, a) - Form.function(self.turn)]

    def moment(self, multipliers):
        return -multipliers[-1]


@ignore_resolution
def test_a_drive_about_a_tilted_axis_of_two_bodies_counts_turns():
    """The angle 30 t + 4 t² makes five turns between two free bodies, which take 4 J each."""
    tilt = Rotation.from_euler("xyz", [0.5, -0.4, 0.3])
    spins = [tilt.apply([0.0, 0.0, speed]) for speed in (20.0, 50.0)]
    bodies = [SpatialBody(np.zeros(3), tilt, np.zeros(3), spin) for spin in spins]
    mechanism = fb.Mechanism(
        bodies=dict(zip("ab", bodies, strict=True)),
        joints={"motor": Drive("b", "a", lambda t: 30 * t + 4 * t**2)},
        sensors={name: Coordinates(name) for name in "ab"} | {"M": fb.ReactionMoment("motor")},
    )
    motion = fb.simulate(mechanism, duration=1.0, step=5e-4)
    time = motion["time"].values
    turns = {"a": 20 * time - 2 * time**2, "b": 50 * time + 2 * time**2}
    x = {name: axes_of(motion, name)[:, :, 0] for name in "ab"}
    relative = turns["b"] - turns["a"]
    assert relative[-1] > 5 * 2 * np.pi
    assert np.sum(x["a"] * x["b"], axis=1) == pytest.approx(np.cos(relative), abs=1e-9)
    for name, way in turns.items():
        exact = (tilt * Rotation.from_rotvec(np.outer(way, [0, 0, 1]))).as_matrix()
        assert axes_of(motion, name) == pytest.approx(exact, abs=2e-2)
    moment = motion.sel(output="M").values
    assert moment[0] == pytest.approx(4 * INERTIA[2], rel=1e-9)


@ignore_resolution
def test_the_second_rate_of_an_angle_between_tumbling_bodies():
    """Euler's equations of both at the start, α_b = α_a + 8 e + 30 ω_a × e, M on b and −M on a."""
    tilt = Rotation.from_euler("xyz", [0.5, -0.4, 0.3])
    phase = Rotation.from_euler("z", 0.7)
    axis = tilt.apply([0.0, 0.0, 1.0])
    spin = np.array([2.0, -3.0, 4.0])
    turns = (tilt, tilt * phase)
    spins = (spin, spin + 30 * axis)
    bodies = [
        SpatialBody(np.zeros(3), turn, np.zeros(3), speed)
        for turn, speed in zip(turns, spins, strict=True)
    ]
    inertia = [turn.as_matrix() @ np.diag(INERTIA) @ turn.as_matrix().T for turn in turns]
    gyroscopic = [np.cross(w, J @ w) for w, J in zip(spins, inertia, strict=True)]
    relative = 8 * axis + 30 * np.cross(spin, axis)
    of_a = -np.linalg.solve(sum(inertia), sum(gyroscopic) + inertia[1] @ relative)
    exact = axis @ (inertia[1] @ (of_a + relative) + gyroscopic[1])
    mechanism = fb.Mechanism(
        bodies=dict(zip("ab", bodies, strict=True)),
        joints={"motor": Drive("b", "a", lambda t: 0.7 + 30 * t + 4 * t**2)},
        sensors={"M": fb.ReactionMoment("motor")},
    )
    motion = fb.simulate(mechanism, duration=0.05, step=1e-3)
    assert motion.values[0, 0] == pytest.approx(exact, rel=1e-7)


@pytest.mark.parametrize("axis", [(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.3, -0.5, 0.8)])
def test_steps_in_which_a_body_turns_far_are_warned_of_about_any_axis(axis):
    """By 0.6 rad a step numerical damping takes speed; by 0.05 rad it takes none to speak of."""
    spin = 600.0 * np.array(axis) / np.linalg.norm(axis)
    mechanism = fb.Mechanism(
        bodies={"b": SpatialBody(np.zeros(3), Rotation.identity(), np.zeros(3), spin)},
        sensors={"b": Coordinates("b")},
    )
    text = r"body 'b' turns by about 0\.(59|6\d*) rad per step"
    with pytest.warns(fb.errors.ResolutionWarning, match=text):
        fb.simulate(mechanism, duration=0.05, step=1e-3)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fb.simulate(mechanism, duration=0.005, step=1e-3 / 12)


def test_frequencies_of_a_body_on_six_skew_springs():
    """Those of M⁻¹ Σ k l lᵀ, where l = (n, r × n) of the line of each spring."""
    rng = np.random.default_rng(4)
    tilt = Rotation.from_euler("xyz", [0.5, -0.4, 0.3])
    anchors = rng.uniform(1, 2, (6, 3))
    levers = rng.uniform(-0.5, 0.5, (6, 3))
    stiffness = rng.uniform(100, 900, 6)

    def enters(model):
        a = model.frame("b")
        springs = []
        for k, anchor, lever in zip(stiffness, anchors, levers, strict=True):
            place = a.position
            for axis, component in zip(a.axes, lever, strict=True):
                place = add(place, scale(component, axis))
            distance = length(subtract(place, constant_vector(anchor)))
            springs.append(SpringEntry(distance, k, None, 0.0, 0.0, Form({})))
        return Entries(springs=springs)

    body = SpatialBody(np.zeros(3), tilt, np.zeros(3), np.zeros(3))
    mechanism = fb.Mechanism(bodies={"b": body}, loads={"springs": Entered(enters)})
    # Stiffness of the lines in the axes of the body.
    matrix = np.zeros((6, 6))
    for k, anchor, lever in zip(stiffness, tilt.inv().apply(anchors), levers, strict=True):
        n = (lever - anchor) / np.linalg.norm(lever - anchor)  # in the axes of the body
        line = np.concatenate([n, np.cross(lever, n)])
        matrix += k * np.outer(line, line)
    mass = np.array([MASS] * 3 + [*INERTIA])
    square = np.linalg.eigvalsh(matrix / np.sqrt(np.outer(mass, mass)))
    frequencies = fb.modes(mechanism, 6, about="start")["frequency"].values
    assert frequencies == pytest.approx(np.sqrt(square) / (2 * np.pi), rel=1e-8)
