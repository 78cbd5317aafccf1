"""Steps that every sample chooses, and events, against exact motions."""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import expm

import flexband as fb
from flexband.mechanics.time_functions.tabulation import tabulate

TOLERANCES = (1e-5, 1e-6, 1e-7, 1e-8)


def integrator_of(tolerance, **options):
    return fb.GeneralizedAlpha(step_tolerance=tolerance, **options)


def relay_force(t, x, v, p, force, mode, gap):
    """A force of constant size towards X = 0."""
    gap[0] = x[0, 0]
    force[0, 0] = -p[0] * mode[0]


def relay(force=4.0):
    return fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0, position=(0.1, 0.0))},
        loads={"f": fb.ForceLaw(["m"], relay_force, (force,), events=["centre"])},
        sensors={"x": fb.Position("m"), "v": fb.Velocity("m")},
    )


def test_a_force_that_jumps_at_events_gives_parabolas():
    motion = fb.simulate(relay(), duration=1.0, step=0.01)
    quarter = np.sqrt(2 * 0.1 / 4.0)
    half = np.round(motion["time"].values / (2 * quarter))
    since = motion["time"].values - 2 * quarter * half
    exact = (-1) ** half * (0.1 - 2.0 * since**2)
    np.testing.assert_allclose(motion.sel(output="x_X"), exact, rtol=0, atol=1e-5)


def test_a_sample_does_not_depend_on_its_neighbours():
    """Each alone, with seven clones, and permuted, with steps and events of its own."""
    forces = 4.0 + 0.1 * np.arange(11)
    grid = {"duration": 0.5, "step": 0.01}
    batch = fb.simulate(relay(forces), **grid).values
    order = np.random.default_rng(0).permutation(11)
    np.testing.assert_array_equal(fb.simulate(relay(forces[order]), **grid), batch[order])
    for k in (0, 3, 10):
        np.testing.assert_array_equal(fb.simulate(relay(forces[k]), **grid), batch[k])
        clones = fb.simulate(relay(np.full(8, forces[k])), **grid).values
        np.testing.assert_array_equal(clones, np.broadcast_to(batch[k], clones.shape))


G = 9.81
STIFFNESS = 1e7


def bounces(t, x, v, p, force, mode, gap):
    gap[0] = x[0, 1]
    force[0, 1] = -G
    if mode[0] < 0:
        force[0, 1] -= p[0] * x[0, 1]


def ball(stiffness=STIFFNESS):
    return fb.Mechanism(
        bodies={"ball": fb.PointMass(mass=1.0, position=(0.0, 0.1))},
        loads={"floor": fb.ForceLaw(["ball"], bounces, (stiffness,), events=["floor"])},
        sensors={"x": fb.Position("ball")},
    )


def exact_bounces(times):
    """Heights [m] of the flights, NaN in contact."""
    fall = np.sqrt(0.2 / G)
    w = np.sqrt(STIFFNESS)
    contact = 2 * (np.pi - np.arctan(G * fall * w / G)) / w
    since = (times + fall) % (2 * fall + contact) - fall
    return np.where(since < fall, 0.1 - 0.5 * G * since**2, np.nan)


def test_a_ball_on_a_stiff_floor_bounces_as_it_should_at_any_tolerance():
    errors = []
    for tolerance in TOLERANCES:
        integrator = integrator_of(tolerance, spectral_radius=0.9)
        motion = fb.simulate(ball(), duration=1.0, step=0.01, integrator=integrator)
        exact = exact_bounces(motion["time"].values)
        errors.append(np.nanmax(np.abs(motion.sel(output="x_Y").values - exact)))
    assert errors[-1] < 2e-5
    assert errors[0] < 2e-3
    assert errors[-1] < errors[0] / 30


def mass_on_spring(force):
    """A mass on a spring, 10 rad/s, that a force pushes."""
    return fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0, position=(1.0, 0.0))},
        joints={"guide": fb.Slot("m", (0.0, 0.0))},
        loads={"k": fb.Spring("m", (-1.0, 0.0), stiffness=100.0, rest_length=2.0),
               "f": fb.Force("m", x=force)},
        sensors={"x": fb.Position("m"), "a": fb.Acceleration("m")},
    )  # fmt: skip


def test_loads_between_the_times_of_the_result_act_as_they_are():
    """A sine of 20 periods per step, and a jump between two times; exact by superposition."""
    w = 2 * np.pi * 200.0

    def force(t):
        return 50.0 * np.sin(w * np.asarray(t))

    motion = fb.simulate(
        mass_on_spring(force), duration=0.5, step=0.1, integrator=integrator_of(1e-11)
    )
    t = motion["time"].values
    exact = 50.0 / (100.0 - w**2) * (np.sin(w * t) - w / 10.0 * np.sin(10.0 * t))
    np.testing.assert_allclose(motion.sel(output="x_X") - 1, exact, rtol=0, atol=2e-7)

    jump = fb.table([0.0, 0.123, 0.123, 1.0], [0.0, 0.0, 20.0, 20.0])
    motion = fb.simulate(
        mass_on_spring(jump), duration=0.5, step=0.1, integrator=integrator_of(1e-9)
    )
    exact = np.where(t > 0.123, 0.2 * (1 - np.cos(10.0 * (t - 0.123))), 0.0)
    np.testing.assert_allclose(motion.sel(output="x_X") - 1, exact, rtol=0, atol=2e-6)
    np.testing.assert_allclose(
        motion.sel(output="a_X"), 20.0 * (t > 0.123) - 100 * exact, atol=1e-3
    )


def test_a_prescribed_motion_has_its_accelerations():
    crank = fb.RigidBody(mass=1.0, inertia=0.1, points={"end": (0.5, 0.0)})
    model = fb.Mechanism(
        bodies={"crank": crank, "m": fb.PointMass(mass=2.0, position=(0.5, 0.0))},
        joints={"A": fb.Revolute("crank", (0.0, 0.0)), "B": fb.Revolute("m", "crank.end"),
                "motor": fb.PrescribedRotation("crank", lambda t: 30.0 * t + 5.0 * np.sin(8 * t))},
        sensors={"x": fb.Position("m"), "M": fb.ReactionMoment("motor"), "R": fb.Reaction("B")},
    )  # fmt: skip
    motion = fb.simulate(model, duration=0.5, step=0.025, integrator=integrator_of(1e-8))
    t = motion["time"].values
    angle = 30.0 * t + 5.0 * np.sin(8 * t)
    rate = 30.0 + 40.0 * np.cos(8 * t)
    np.testing.assert_allclose(motion.sel(output="x_X"), 0.5 * np.cos(angle), atol=1e-8)
    size = np.hypot(*motion.sel(output=["R_X", "R_Y"]).values)
    exact = np.hypot(rate**2, -320.0 * np.sin(8 * t))
    np.testing.assert_allclose(size, exact, rtol=0, atol=1e-6 * exact.max())
    np.testing.assert_allclose(motion.sel(output="M"), -320.0 * np.sin(8 * t) * 0.6, atol=2e-4)


def follows(t, x, v, s, p, force, rate):
    force[0, 0] = -s[0]
    rate[0] = (100.0 * x[0, 0] - s[0]) / 0.05


def test_states_of_laws_change_their_steps_with_the_motion():
    model = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0, position=(0.1, 0.0))},
        loads={"f": fb.ForceLaw(["m"], follows, states={"s": 0.0})},
        sensors={"x": fb.Position("m"), "s": fb.LawState("f", "s", "N")},
    )
    matrix = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, -1.0], [2000.0, 0.0, -20.0]])
    exact = (expm(matrix) @ [0.1, 0.0, 0.0])[[0, 2]]
    errors = []
    for tolerance in (1e-6, 1e-8):
        motion = fb.simulate(model, duration=1.0, step=0.1, integrator=integrator_of(tolerance))
        errors.append(np.abs(motion.sel(output=["x_X", "s"]).values[:, -1] - exact))
    assert np.all(errors[1] < 1e-3 * np.abs(exact))
    assert np.all(errors[1] < errors[0] / 8)


def test_the_noise_of_steps_is_within_the_tolerance():
    """Changes of an input by 1e-9 of it change steps, and the result by less than its error."""
    stiffness = STIFFNESS * (1 + 1e-9 * np.arange(8))
    motion = fb.simulate(ball(stiffness), duration=0.5, step=0.05, integrator=integrator_of(1e-7))
    heights = motion.sel(output="x_Y").values
    exact = exact_bounces(motion["time"].values)
    error = np.nanmax(np.abs(heights - exact))
    assert np.ptp(heights, axis=0).max() <= 0.1 * error


def test_the_error_of_chosen_steps_is_estimated_from_a_tenth_of_the_tolerance():
    grid = {"duration": 0.5, "step": 0.01}
    body = replace(mass_on_spring(0.0).bodies["m"], velocity=(1.0, 0.0))
    model = replace(mass_on_spring(0.0), bodies={"m": body})
    estimate = fb.discretization_error(model, integrator=integrator_of(1e-6), **grid)
    motion = fb.simulate(model, integrator=integrator_of(1e-6), **grid)
    exact = 1 + 0.1 * np.sin(10.0 * motion["time"].values)
    error = np.sqrt(np.mean((motion.sel(output="x_X").values - exact) ** 2))
    rms_estimate = np.sqrt(np.mean(estimate["error"].sel(output="x_X").values ** 2))
    assert 0.6 < rms_estimate / error < 1.5


def test_an_equilibrium_has_the_mode_of_its_gaps():
    """A mass that starts above a floor rests on it."""
    model = replace(ball(1e4), sensors={"x": fb.Position("ball")})
    rest = fb.equilibrium(model)
    assert float(rest.sel(output="x_Y")) == pytest.approx(-G / 1e4, rel=1e-9)


def chatters(t, x, v, p, force, mode, gap):
    """A friction force without a state that sticks: it switches as often as steps allow."""
    gap[0] = v[0, 0]
    force[0, 0] = -10.0 * mode[0]


def test_events_without_end_fail_by_name():
    model = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0, velocity=(1.0, 0.0))},
        loads={"f": fb.ForceLaw(["m"], chatters, events=["stop"])},
        sensors={"x": fb.Position("m")},
    )
    with pytest.raises(
        fb.errors.SimulationError, match="events follow each other without end"
    ) as error:
        fb.simulate(model, duration=0.2, step=0.01)
    ((time, _),) = error.value.failures.values()
    assert time == pytest.approx(0.1, abs=0.011)


def test_a_series_of_impacts_has_an_end_with_a_large_smallest_step():
    """A mass rattles in a gap; its steps are 10 to 100 times the smallest one."""
    K = 1e8
    v = 2.0
    gap = 1e-4
    model = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0, velocity=(v, 0.0))},
        joints={"guide": fb.Slot("m", (0.0, 0.0))},
        loads={"stop": fb.contact.Stop(
            "m", (0.0, 0.0), fb.contact.KeepsRestitution(stiffness=K), lower=-gap / 2,
            upper=gap / 2)},
        sensors={"c": fb.contact.Contacts("stop", first=1)},
    )  # fmt: skip
    lasts = 2.94328 * (5.0 * v * v / (4.0 * K)) ** 0.4 / v
    duration = 0.25 * gap / v + 15.5 * (lasts + gap / v)
    integrator = integrator_of(1e-6, smallest_step=1.5e-6)
    motion = fb.simulate(model, duration=duration, step=duration, integrator=integrator)
    assert float(motion.sel(output="c_number").values[-1]) == 16


def test_a_load_acts_within_the_only_step_of_a_result():
    w = 9.0
    motion = fb.simulate(
        mass_on_spring(lambda t: 20.0 * np.sin(w * np.asarray(t))), duration=0.5, step=0.5,
        integrator=integrator_of(1e-10),
    )  # fmt: skip
    exact = 20.0 / (100.0 - w * w) * (np.sin(w * 0.5) - w / 10.0 * np.sin(5.0))
    assert float(motion.sel(output="x_X").values[-1]) - 1 == pytest.approx(exact, abs=1e-6)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"step_tolerance": 0.0}, "step_tolerance must be positive; got 0"),
        ({"step_tolerance": -1e-6}, "step_tolerance must be positive"),
        ({"step_tolerance": 0.1}, "step_tolerance must be between 1e-13 and 0.01"),
        ({"step_tolerance": "small"}, "step_tolerance must be finite numbers"),
        ({"smallest_step": -1.0}, "smallest_step [s] must be positive"),
    ],
)
def test_bad_options_are_refused_by_name(options, message):
    with pytest.raises(fb.errors.InputError, match=re.escape(message)):
        fb.GeneralizedAlpha(**options)


@pytest.mark.parametrize("events", ["floor", [""], ["a", "a"], [3]])
def test_bad_events_are_refused_by_name(events):
    with pytest.raises(
        fb.errors.InputError, match="ForceLaw events must be a list of different names"
    ):
        fb.ForceLaw(["ball"], bounces, (1.0,), events=events)


def test_the_work_over_chosen_steps_is_what_the_energy_gains():
    """The force jumps at events between the times of the result."""
    model = replace(relay(), sensors={"W": fb.Work("f"), "T": fb.KineticEnergy()})
    work, energy = fb.simulate(model, duration=1.0, step=0.05).values
    assert energy.max() > 0.3
    np.testing.assert_allclose(work, energy, rtol=0, atol=1e-12)


def test_a_load_that_is_not_smooth_is_refused():
    def fast_sine(t):
        return np.sin(1e9 * np.asarray(t))

    with pytest.raises(fb.errors.InputError, match="is not smooth near t = "):
        fb.simulate(
            mass_on_spring(fast_sine), duration=0.1, step=0.01, integrator=integrator_of(1e-6)
        )


def test_polynomials_are_within_their_tolerance():
    """At random times in each round, whose ends are the kinks and jumps."""
    times = np.linspace(0.0, 1.0, 11)
    tolerance = 1e-7
    table = fb.table([0.0, 0.234, 0.234, 0.51, 1.0], [0.0, 1.0, -1.0, 2.0, 0.0])
    functions = [table, lambda t: np.exp(-40.0 * np.asarray(t)) * np.cos(90.0 * np.asarray(t))]
    tables = tabulate(functions, {}, 1, times, tolerance=tolerance)
    schedule = tables.schedule
    part = np.random.default_rng(0).uniform(-1, 1, 50)
    powers = part[:, None] ** np.arange(tables.polynomials.shape[2])
    for n in np.flatnonzero(schedule.parts[:, 0] > 0)[1:]:
        low, high = schedule.limits[n - 1 : n + 1, 0]
        moments = low + 0.5 * (1 + part) * (high - low)
        for k, function in enumerate(functions, start=1):
            values = powers @ tables.polynomials[n, k, :, 0]
            np.testing.assert_allclose(values, function(moments), rtol=0, atol=3 * tolerance)
