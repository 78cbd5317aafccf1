"""First-order states of force laws, against SciPy's integration of the same equations."""

import re

import numpy as np
import pytest
from numba import njit
from scipy.integrate import solve_ivp
from scipy.linalg import expm

import flexband as fb

FINE = fb.GeneralizedAlpha(spectral_radius=0.9, tolerance=1e-12)
ARM = {"length": 0.5, "height": 0.02, "width": 0.02, "density": 7800.0}
MASS = 7800.0 * 0.5 * 0.02**2
INERTIA = MASS * (0.5**2 / 3 + 0.02**2 / 12)  # about its start


def follows(t, x, v, s, p, force, rate):
    """A force that follows the position x with the gain p[0] and the time constant p[1]."""
    force[0, 0] = -s[0]
    rate[0] = (p[0] * x[0, 0] - s[0]) / p[1]


def follower(gain=100.0, time=0.05, start=0.0):
    return fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0, position=(0.1, 0.0))},
        loads={"f": fb.ForceLaw(["m"], follows, (gain, time), states={"s": start})},
        sensors={"x": fb.Position("m"), "s": fb.LawState("f", "s", "N")},
    )


def system(gain, time):
    """d/dt (x, v, s) of a mass of 1 kg."""
    return np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [gain / time, 0.0, -1.0 / time]])


def last(motion, *outputs):
    return motion.sel(output=list(outputs)).values[..., -1]


def test_starts_include_states():
    """At rest s = k x; on a periodic motion s/x is the transfer function k / (1 + iωτ)."""

    mass = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0, position=(0.1, 0.0))},
        joints={"rail": fb.Slot("m", (0.0, 0.0))},
        loads={
            "f": fb.ForceLaw(["m"], follows, (100.0, 0.05), states={"s": 0.0}),
            "damper": fb.Spring("m", (-1.0, 0.0), stiffness=0.0, damping=20.0, rest_length=1.0),
            "push": fb.Force("m", x=lambda t: 5.0 * np.cos(4 * np.pi * t)),
        },
        sensors={"x": fb.Position("m"), "s": fb.LawState("f", "s", "N")},
    )
    rest = fb.simulate(mass, duration=0.01, step=1e-3, start="static")
    assert rest.sel(output=["x_X", "s"]).values[:, 0] == pytest.approx([0.05, 5.0], rel=1e-9)
    cycle = fb.simulate(mass, duration=0.5, step=1e-3, start="periodic", period=0.5)
    assert np.abs(cycle[:, 0] - cycle[:, -1]).max() < 1e-9
    x, s = (np.fft.rfft(cycle.sel(output=name)[:-1])[1] for name in ("x_X", "s"))
    assert s / x == pytest.approx(100.0 / (1 + 0.05j * 4 * np.pi), rel=1e-3)


def test_states_converge_with_the_square_of_the_step():
    exact = (expm(system(100.0, 0.05)) @ [0.1, 0.0, 0.0])[[0, 2]]
    errors = [
        last(fb.simulate(follower(), duration=1.0, step=1.0 / n), "x_X", "s") - exact
        for n in (200, 400, 800)
    ]
    orders = np.log2(np.abs(errors[:-1]) / np.abs(errors[1:]))
    np.testing.assert_allclose(orders, 2.0, atol=0.04)


def pid(t, x, v, s, p, force, rate):
    """A controller whose integral leaks by p[4] s³ and whose moment stays below p[5]."""
    rate[0] = p[0] - x[0, 2] - p[4] * s[0] ** 3
    force[0, 2] = saturate(p[1] * (p[0] - x[0, 2]) + p[2] * s[0] - p[3] * v[0, 2], p[5])


@njit
def saturate(moment, limit):
    return limit * np.tanh(moment / limit)


def controlled_arm(target=0.3, leak=0.0, limit=1e9):
    return fb.Mechanism(
        bodies={"arm": fb.RigidBody.bar(**ARM)},
        joints={"pin": fb.Revolute("arm.start", (0.0, 0.0))},
        loads={"gravity": fb.Gravity(),
               "pid": fb.ForceLaw(["arm"], pid, (target, 20.0, 30.0, 3.0, leak, limit),
                                  states={"i": 0.0})},
        sensors={"phi": fb.Angle("arm"), "i": fb.LawState("pid", "i", "rad s"),
                 "work": fb.Work("pid"), "T": fb.KineticEnergy(), "V": fb.PotentialEnergy()},
    )  # fmt: skip


def test_a_pid_controlled_arm_moves_as_scipy_has_it():
    def rates(t, z):
        moment = 20.0 * (0.3 - z[0]) + 30.0 * z[2] - 3.0 * z[1]
        return [z[1], (moment - MASS * 9.81 * 0.25 * np.cos(z[0])) / INERTIA, 0.3 - z[0]]

    exact = solve_ivp(rates, (0, 1), np.zeros(3), rtol=1e-12, atol=1e-13, method="DOP853").y[:, -1]
    motion = fb.simulate(controlled_arm(), duration=1.0, step=1e-4, integrator=FINE)
    np.testing.assert_allclose(last(motion, "phi", "i"), exact[[0, 2]], rtol=0, atol=1e-6)
    energy = motion.sel(output="T") + motion.sel(output="V")
    work = motion.sel(output="work") - (energy - energy[0])
    assert np.abs(work).max() < 1e-5 * np.abs(motion.sel(output="work")).max()


@pytest.mark.filterwarnings("ignore:left out")
def test_an_equilibrium_holds_what_an_integral_controller_holds():
    """The error vanishes, and the integral carries the weight: its rate does not depend on it."""
    rest = fb.equilibrium(controlled_arm())
    integral = MASS * 9.81 * 0.25 * np.cos(0.3) / 30.0
    np.testing.assert_allclose(rest.sel(output=["phi", "i"]), [0.3, integral], rtol=1e-9)
    assert rest["stable"]
    small = fb.modes(controlled_arm(), 5)
    stiffness = 20.0 - MASS * 9.81 * 0.25 * np.sin(0.3)
    exact = np.sort(np.roots([INERTIA, 3.0, stiffness, 30.0]))[::-1]
    np.testing.assert_allclose(small["eigenvalue"], exact, rtol=1e-6)


def test_modes_of_a_mass_with_a_first_order_force_are_exact():
    exact = np.linalg.eigvals(system(100.0, 0.05))
    exact = exact[exact.imag >= 0][np.argsort(np.abs(exact[exact.imag >= 0]))]
    small = fb.modes(follower(), 10, about="start")
    moving_modes = small.isel(mode=np.abs(small["eigenvalue"].values) > 0)
    np.testing.assert_allclose(moving_modes["eigenvalue"], exact, rtol=1e-7)
    np.testing.assert_array_equal(moving_modes["unstable"], exact.real > 0)
    shape = moving_modes["shape"].sel(output="s") / moving_modes["shape"].sel(output="x_X")
    np.testing.assert_allclose(shape, 100.0 / (1 + 0.05 * exact), rtol=1e-5)


def valve(t, x, v, s, p, force, rate):
    """A cylinder: pressures of both chambers, flows through the edges of a valve with opening p."""
    opening = p[0]
    supply = p[1]
    area = p[2]
    bulk = p[3]
    volume = p[4]
    stroke = x[2, 0] - p[5]
    speed = v[2, 0]
    drops = (supply - s[0], s[1]) if opening > 0 else (s[0], supply - s[1])
    flow_a = opening * np.sign(drops[0]) * np.sqrt(abs(drops[0]))
    flow_b = opening * np.sign(drops[1]) * np.sqrt(abs(drops[1]))
    rate[0] = bulk / (volume + area * stroke) * (flow_a - area * speed)
    rate[1] = bulk / (volume - area * stroke) * (area * speed - flow_b)
    force[2, 0] = area * (s[0] - s[1])


VALVE = (4e-8, 1e7, 1e-3, 1e9, 3e-4, 0.5)


def cylinder(opening=VALVE[0]):
    return fb.Mechanism(
        bodies={"m": fb.RigidBody(mass=50.0, inertia=1.0, position=(0.5, 0.0))},
        joints={"guide": fb.Prismatic("m", (0.0, 0.0))},
        loads={"oil": fb.ForceLaw(["m", (0.0, 0.0)], valve, (opening, *VALVE[1:]),
                                  states={"a": 3e6, "b": 3e6}, between=[(0, 1)]),
               "damper": fb.ViscousFriction("m", (0.0, 0.0), 2000.0)},
        sensors={"x": fb.Position("m"), "a": fb.LawState("oil", "a", "Pa"),
                 "b": fb.LawState("oil", "b", "Pa")},
    )  # fmt: skip


def test_a_hydraulic_cylinder_moves_as_scipy_has_it():
    def rates(t, z):
        force = np.zeros((3, 3))
        rate = np.zeros(2)
        x = np.zeros((3, 3))
        v = np.zeros((3, 3))
        x[2, 0] = z[0]
        v[2, 0] = z[1]
        valve(t, x, v, z[2:], np.array(VALVE), force, rate)
        return [z[1], (force[2, 0] - 2000.0 * z[1]) / 50.0, *rate]

    options = {"method": "DOP853", "rtol": 1e-10, "atol": 1e-12}
    exact = solve_ivp(rates, (0, 0.2), [0.5, 0.0, 3e6, 3e6], **options).y[:, -1]
    motion = fb.simulate(cylinder(), duration=0.2, step=2e-5, integrator=FINE)
    scale = [0.1, 1e7, 1e7]
    deviation = (last(motion, "x_X", "a", "b") - exact[[0, 2, 3]]) / scale
    assert np.abs(deviation).max() < 1e-6


def lugre(t, x, v, s, p, force, rate):
    stiffness, damping, coulomb, stiction, stribeck = p
    slip = v[0, 0]
    limit = coulomb + (stiction - coulomb) * np.exp(-((slip / stribeck) ** 2))
    rate[0] = slip - stiffness * abs(slip) / limit * s[0]
    force[0, 0] = -stiffness * s[0] - damping * rate[0]


def test_bristles_stick_and_slip_as_scipy_has_it():
    """A spring drags a mass with LuGre friction: a stiff state that stops and reverses."""
    p = np.array([1e5, 300.0, 1.0, 1.5, 1e-3])

    def rates(t, z):
        force = np.zeros((1, 3))
        rate = np.zeros(1)
        lugre(t, np.zeros((1, 3)), np.array([[z[1], 0, 0]]), z[2:], p, force, rate)
        return [z[1], force[0, 0] - 200.0 * (z[0] - 0.01 * t), rate[0]]

    model = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0)},
        loads={"bristles": fb.ForceLaw(["m"], lugre, p.tolist(), states={"z": 0.0}),
               "spring": fb.Spring("m", (-1.0, 0.0), stiffness=200.0, rest_length=1.0),
               "drag": fb.Force("m", x=lambda t: 200.0 * 0.01 * t)},
        sensors={"x": fb.Position("m"), "z": fb.LawState("bristles", "z", "m")},
    )  # fmt: skip
    options = {"method": "Radau", "rtol": 1e-10, "atol": 1e-13}
    exact = solve_ivp(rates, (0, 1.1), np.zeros(3), **options).y[:, -1]
    motion = fb.simulate(model, duration=1.1, step=2e-4, integrator=FINE)
    np.testing.assert_allclose(last(motion, "x_X"), exact[:1], atol=2e-7)
    np.testing.assert_allclose(last(motion, "z"), exact[2:], atol=1e-9)


def test_stick_slip_is_right_at_the_default_tolerance_of_steps():
    """The mass of Canudas de Wit et al. (1995), pulled at 0.1 m/s, slips four times in 25 s."""
    p = np.array([1e5, np.sqrt(1e5), 1.0, 1.5, 1e-3])

    def rates(t, z):
        force = np.zeros((1, 3))
        rate = np.zeros(1)
        lugre(t, np.zeros((1, 3)), np.array([[z[1], 0, 0]]), z[2:], p, force, rate)
        return [z[1], force[0, 0] - 0.4 * z[1] - 2.0 * (z[0] - 0.1 * t), rate[0]]

    spring = {"stiffness": 2.0, "damping": 0.4, "rest_length": 1.0}
    model = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0)},
        joints={"rail": fb.Slot("m", (0.0, 0.0))},
        loads={"bristles": fb.ForceLaw(["m"], lugre, p.tolist(), states={"z": 0.0}),
               "spring": fb.Spring("m", (-1.0, 0.0), **spring),
               "drag": fb.Force("m", x=lambda t: 2.0 * 0.1 * t)},
        sensors={"x": fb.Position("m")},
    )  # fmt: skip
    integrator = fb.GeneralizedAlpha(step_tolerance=1e-7)
    motion = fb.simulate(model, duration=25.0, step=0.05, integrator=integrator).sel(output="x_X")
    options = {"method": "Radau", "rtol": 1e-10, "atol": 1e-13, "t_eval": motion.time.values}
    exact = solve_ivp(rates, (0, 25.0), np.zeros(3), **options).y[0]
    assert exact[-1] == pytest.approx(1.9088392, abs=2e-6)
    np.testing.assert_allclose(motion.values.ravel(), exact, atol=2e-4 * np.ptp(exact))


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("time", [1e-4, 0.1])
def test_a_state_that_begins_at_zero_is_judged_by_the_size_it_gets(size, time):
    """A filter of a cosine moves a mass."""

    def filter_force(t, x, v, s, p, force, rate):
        rate[0] = (p[0] * np.cos(3.0 * t) - s[0]) / p[1]
        force[0, 0] = s[0] / p[0]

    model = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0)},
        loads={"f": fb.ForceLaw(["m"], filter_force, [size, time], states={"s": 0.0})},
        sensors={"s": fb.LawState("f", "s", "V")},
    )
    integrator = fb.GeneralizedAlpha(step_tolerance=1e-7)
    motion = fb.simulate(model, duration=5.0, step=0.01, integrator=integrator).sel(output="s")
    t = motion.time.values
    phase = np.arctan(3.0 * time)
    exact = np.cos(3.0 * t - phase) - np.cos(phase) * np.exp(-t / time)
    exact *= size / np.hypot(1.0, 3.0 * time)
    np.testing.assert_allclose(motion.values.ravel(), exact, atol=2e-5 * size)


@pytest.mark.parametrize("start", [0.0, 50.0, "steady"])
def test_a_state_of_a_million_per_second_follows_at_once(start):
    """With a step of 1 ms, from any start: the force is that of a spring after two steps."""
    motion = fb.simulate(follower(gain=100.0, time=1e-6, start=start), duration=0.1, step=1e-3)
    x = motion.sel(output="x_X").values
    s = motion.sel(output="s").values
    np.testing.assert_allclose(s[3:], 100.0 * x[3:], rtol=1e-3)
    assert np.abs(s[1:]).max() < 11.0
    expected = 10.0 if start == "steady" else start
    assert s[0] == pytest.approx(expected, rel=1e-12)


def filter_force(t, x, v, s, p, force, rate):
    """A force that follows p[0] with the time constant p[1]."""
    rate[0] = (p[0] - s[0]) / p[1]
    force[0, 1] = s[0]


@pytest.mark.parametrize("at", [0.3, 0.30037])
def test_states_are_of_second_order_across_a_jump(at):
    """The input of a filter jumps, at a time of the run and between two."""
    step = fb.table([0, at, at, 2], [0.0, 0.0, 1.0, 1.0])
    model = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0)},
        loads={"f": fb.ForceLaw(["m"], filter_force, (step, 0.05), states={"s": 0.0})},
        sensors={"s": fb.LawState("f", "s")},
    )  # fmt: skip
    exact = 1 - np.exp(-(0.5 - at) / 0.05)
    errors = [
        last(fb.simulate(model, duration=0.5, step=0.5 / n), "s")[0] - exact for n in (100, 200)
    ]
    assert abs(errors[0]) < 1e-3
    assert abs(errors[0]) / abs(errors[1]) > 3.0


def test_a_sample_does_not_depend_on_its_neighbours():
    """The controller is not linear: states have iterations of their own."""

    def values_of(target):
        return fb.simulate(controlled_arm(target, 50.0, 15.0), duration=0.2, step=2e-3).values

    targets = 0.3 + 0.1 * np.arange(11)
    batch = values_of(targets)
    order = np.random.default_rng(0).permutation(11)
    np.testing.assert_array_equal(values_of(targets[order]), batch[order])
    for k in (0, 4, 10):
        np.testing.assert_array_equal(values_of(targets[k]), batch[k])


def test_states_of_laws_on_beams_and_their_discretization_error():
    """A filtered force on a cantilever; the error of the step falls with its square."""
    beam = fb.Beam(length=0.5, height=0.01, width=0.01, density=2700.0, youngs_modulus=7e10,
                   poissons_ratio=0.3, elements=2, retardation_time=1e-4)  # fmt: skip
    model = fb.Mechanism(
        bodies={"b": beam},
        joints={"clamp": fb.Weld("b.start", (0.0, 0.0))},
        loads={"f": fb.ForceLaw(["b.end"], filter_force, (20.0, 0.01), states={"s": 0.0})},
        sensors={"tip": fb.Position("b.end"), "s": fb.LawState("f", "s", "N")},
    )
    grid = {"duration": 0.05, "step": 2.5e-4}
    estimate = fb.discretization_error(model, **grid)
    exact = fb.simulate(model, **grid, substeps=32)
    coarse = fb.simulate(model, **grid)
    error = (coarse - exact).sel(output="s")
    assert np.abs(error).max() > 0
    ratio = np.sqrt((error**2).mean() / (estimate["step_error"].sel(output="s") ** 2).mean())
    assert 0.7 < float(ratio) < 1.4


def test_a_line_between_two_points_pulls_and_turns_as_a_spring_does():
    bar = {"length": 0.4, "height": 0.02, "width": 0.02, "density": 2000.0}

    def double_pendulum(load):
        return fb.Mechanism(
            bodies={"a": fb.RigidBody.bar(**bar), "b": fb.RigidBody.bar(start=(0.4, 0.0), **bar)},
            joints={"A": fb.Revolute("a.start", (0, 0)), "B": fb.Revolute("b.start", "a.end")},
            loads={"g": fb.Gravity(), **load},
            sensors={"a": fb.Angle("a"), "b": fb.Angle("b")},
        )

    grid = {"duration": 0.5, "step": 1e-3}
    spring = double_pendulum({
        "s": fb.Spring("a.end", (0.1, 0.5), stiffness=40.0, rest_length=0.3, damping=0.5),
        "t": fb.TorsionSpring("a", "b", stiffness=1.0, rest_angle=0.0, damping=0.1),
    })  # fmt: skip
    lines = double_pendulum({
        "law": fb.ForceLaw(["a.end", (0.1, 0.5), "a", "b"], springs, between=[(0, 1), (2, 3)])
    })  # fmt: skip
    expected, line_values = (fb.simulate(model, **grid).values for model in (spring, lines))
    np.testing.assert_allclose(line_values, expected, rtol=0, atol=1e-9)


def springs(t, x, v, p, force):
    force[4, 0] = -40.0 * (x[4, 0] - 0.3) - 0.5 * v[4, 0]
    force[5, 2] = -1.0 * x[5, 2] - 0.1 * v[5, 2]


def fails(t, x, v, s, p, force, rate):
    """A state that runs away, one that never rests, or one that is not there."""
    force[0, 0] = 0.0 * s[0]
    if p[0] == RUNS_AWAY:
        rate[0] = 1e9 * (1.0 + s[0] ** 2) if t > 0.05 else 0.0
    elif p[0] == NEVER_RESTS:
        rate[0] = 1.0
        force[0, 0] = s[0]
    else:
        rate[0] = s[int(1 + t)]


RUNS_AWAY = 0.0
NEVER_RESTS = 1.0
OUT_OF_RANGE = 2.0


@pytest.mark.parametrize(
    ("kind", "start", "message"),
    [
        (RUNS_AWAY, 0.0, "the law of load 'f' has no states that agree with their rates"),
        (NEVER_RESTS, "steady", "the law of load 'f' has no states that agree with their rates"),
        (OUT_OF_RANGE, 0.0, "the law of load 'f' raised IndexError"),
    ],
)
def test_laws_without_states_fail_by_name(kind, start, message):
    model = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0)},
        loads={"f": fb.ForceLaw(["m"], fails, (kind,), states={"s": start})},
        sensors={"x": fb.Position("m")},
    )
    with pytest.raises(
        (fb.errors.AssemblyError, fb.errors.SimulationError), match=re.escape(message)
    ):
        fb.simulate(model, duration=0.1, step=1e-3)


def test_a_state_that_never_rests_has_no_equilibrium():
    model = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0)},
        loads={"f": fb.ForceLaw(["m"], fails, (NEVER_RESTS,), states={"s": 0.0}),
               "k": fb.Spring("m", (0.0, 0.0), stiffness=10.0, rest_length=0.0)},
        sensors={"x": fb.Position("m")},
    )  # fmt: skip
    with pytest.raises(fb.errors.AssemblyError, match="no equilibrium was found"):
        fb.equilibrium(model)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"states": ["s"]}, "ForceLaw states must be a mapping from names"),
        ({"states": {"": 0.0}}, "the name of a state must be non-empty text; got ''"),
        ({"states": {3: 0.0}}, "the name of a state must be non-empty text; got 3"),
        ({"states": {"s": np.nan}}, "ForceLaw state 's' must be finite numbers or \"steady\""),
        ({"states": {"s": "rest"}}, "ForceLaw state 's' must be finite numbers or \"steady\""),
        ({"states": {}}, "does not compile"),
        ({"between": [(0, 1)]}, "must be a list of pairs of different numbers of points, 0 to 0"),
        ({"between": 3}, "ForceLaw between must be a list of pairs"),
        ({"within": [(0, 2)]}, "ForceLaw within must be a list of pairs"),
    ],
)
def test_bad_states_are_refused_by_name(changes, message):
    with pytest.raises(fb.errors.InputError, match=re.escape(message)):
        fb.ForceLaw(**{"points": ["m"], "law": follows, "parameters": (1.0, 1.0),
                       "states": {"s": 0.0}} | changes)  # fmt: skip


def test_a_state_that_does_not_exist_is_refused_by_name():
    with pytest.raises(
        fb.errors.InputError, match=r"state of load 'f' 'z' is not in the mechanism"
    ):
        fb.Mechanism(
            bodies=follower().bodies, loads=follower().loads, sensors={"z": fb.LawState("f", "z")}
        )


@pytest.mark.parametrize("first", [0.0, 1.0, "steady"])
def test_a_state_that_fades_rests_at_zero(first):
    mechanism = fb.Mechanism(
        bodies={"bar": fb.RigidBody(mass=1.0, inertia=1.0, points={"tip": (1.0, 0.0)})},
        joints={"pin": fb.Revolute("bar", (0.0, 0.0))},
        loads={
            "spring": fb.TorsionSpring("bar", (0.0, 0.0), stiffness=10.0),
            "law": fb.ForceLaw(["bar.tip"], filter_force, (0.0, 1.0), states={"s": first}),
        },
        sensors={"s": fb.LawState("law", "s"), "tip": fb.Position("bar.tip")},
    )
    assert fb.equilibrium(mechanism).values == pytest.approx([0.0, 1.0, 0.0], abs=1e-9)
