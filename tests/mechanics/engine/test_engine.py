"""The integrator, its start, lanes and threads, and assemblies that it refuses."""

import weakref
from dataclasses import replace

import numpy as np
import pytest
import scipy.integrate

import flexband as fb
from flexband.mechanics.assembly.structure import WorkSpace
from tests.mechanics.models import (
    block,
    parallelogram,
    pendulum,
    pendulum_driven,
    rigid_slider_crank,
    slider_crank,
    states,
)

DURATION = 0.05
STEP = 1e-3


def exact_pendulum(time):
    """Angle and rate of a uniform bar of 1 m released horizontally, by SciPy at 1e-13."""
    solution = scipy.integrate.solve_ivp(
        lambda t, y: [y[1], -9.81 * 0.5 * np.cos(y[0]) / (1 / 3 + INERTIA)],
        (0, time),
        [0.0, 0.0],
        method="DOP853",
        rtol=1e-13,
        atol=1e-13,
    )
    return solution.y[:, -1]


INERTIA = 0.02**2 / 12  # of the bar's height, over its mass


@pytest.mark.parametrize("radius", [0.5, 0.7, 1.0])
def test_generalized_alpha_is_of_second_order(radius):
    time = 0.8
    integrator = fb.GeneralizedAlpha(spectral_radius=radius)
    angle, rate = exact_pendulum(time)
    mass = 1500.0 * 0.02 * 0.03
    acceleration = -9.81 * 0.5 * np.cos(angle) / (1 / 3 + INERTIA)
    tangent, normal = np.array([[-np.sin(angle), np.cos(angle)], [-np.cos(angle), -np.sin(angle)]])
    # Force on the bar at the hinge: m (a − g); the multipliers are its opposite.
    force = mass * (0.5 * (acceleration * tangent + rate**2 * normal) - [0.0, -9.81])
    exact_q = 0.5 * np.array([np.cos(angle), np.sin(angle)])
    exact_v = 0.5 * rate * tangent
    errors = []
    for steps in (100, 200, 400):
        q, v, multipliers = states(pendulum(), steps, time / steps, integrator)
        errors.append(
            [
                np.linalg.norm(q[:2] - exact_q),
                np.linalg.norm(v[:2] - exact_v),
                np.linalg.norm(-multipliers[1:3] - force) / mass,
            ]
        )
    orders = np.log2(np.array(errors)[:-1] / np.array(errors)[1:])
    np.testing.assert_allclose(orders, 2.0, atol=0.1)


def test_rigid_slider_crank_kinematics():
    motion = fb.simulate(rigid_slider_crank(), duration=0.6, step=1e-3)
    angle = 4 * np.pi * motion.time.values
    exact = 0.2 * np.cos(angle) + np.sqrt(0.45**2 - (0.2 * np.sin(angle)) ** 2)
    assert np.abs(motion.sel(output="slider_X") - exact).max() < 1e-9
    assert np.abs(motion.sel(output="slider_Y")).max() < 1e-9
    assert np.abs(motion.sel(output="pin_X") - 0.2 * np.cos(angle)).max() < 1e-9


def test_start_has_the_exact_rigid_velocities_and_no_stress():
    q, v, _ = states(slider_crank(angle=lambda t: 0.9 + 4 * np.pi * t), 0, 1e-3)
    start = q[4:6]
    end = q[22:24]  # the crank has four coordinates
    assert np.linalg.norm(end - start) == pytest.approx(0.45, abs=1e-12)
    np.testing.assert_allclose(start, 0.2 * np.array([np.cos(0.9), np.sin(0.9)]), atol=1e-12)
    np.testing.assert_allclose(
        v[4:6], 0.8 * np.pi * np.array([-np.sin(0.9), np.cos(0.9)]), atol=1e-10
    )
    turn = -0.8 * np.pi * np.cos(0.9) / (end[0] - start[0])  # rate of the rigid link
    for node in range(4):
        rx = q[6 + 6 * node : 8 + 6 * node]
        vx = v[6 + 6 * node : 8 + 6 * node]
        np.testing.assert_allclose(vx, turn * np.array([-rx[1], rx[0]]), atol=1e-7)


def test_reaction_at_the_start_of_an_accelerating_drive():
    """m a of the centre of mass, exactly: a = r (θ̈ t − θ̇² n)."""
    bar = fb.RigidBody.bar(length=0.4, height=0.02, width=0.02, density=2000.0, angle=0.7)
    model = fb.Mechanism(
        bodies={"bar": bar},
        joints={
            "pin": fb.Revolute("bar.start", (0.1, 0.2)),
            "motor": fb.PrescribedRotation("bar", lambda t: 0.7 + 3.0 * t + 5.0 * t**2),
        },
        sensors={"F": fb.Reaction("pin")},
    )
    start = fb.simulate(model, duration=0.01, step=1e-3).isel(time=0).values
    mass = 2000.0 * 0.4 * 0.02**2
    c = np.cos(0.7)
    s = np.sin(0.7)
    exact = mass * 0.2 * (10.0 * np.array([-s, c]) - 9.0 * np.array([c, s]))
    np.testing.assert_allclose(start, exact, rtol=2e-7)


def samples(n, seed=3):
    rng = np.random.default_rng(seed)
    return {
        "crank_length": rng.uniform(0.194, 0.206, n),
        "spring_stiffness": rng.uniform(970.0, 1030.0, n),
        "youngs_modulus": 69e9 * (1 + 0.01 * rng.standard_normal(n)),
        "poissons_ratio": 0.34 * (1 + 0.01 * rng.standard_normal(n)),
    }


def test_results_do_not_depend_on_threads_or_on_neighbours():
    values = samples(29)
    two_threads = fb.simulate(slider_crank(**values), duration=DURATION, step=STEP, threads=2)
    one_thread = fb.simulate(slider_crank(**values), duration=DURATION, step=STEP, threads=1)
    np.testing.assert_array_equal(two_threads, one_thread)
    order = np.random.default_rng(0).permutation(29)
    shuffled_run = fb.simulate(
        slider_crank(**{k: v[order] for k, v in values.items()}), duration=DURATION, step=STEP
    )
    np.testing.assert_array_equal(two_threads[order], shuffled_run)
    three_samples = fb.simulate(
        slider_crank(**{k: v[11:14] for k, v in values.items()}), duration=DURATION, step=STEP
    )
    np.testing.assert_array_equal(two_threads[11:14], three_samples)
    single_run = fb.simulate(
        slider_crank(**{k: v[17] for k, v in values.items()}), duration=DURATION, step=STEP
    )
    np.testing.assert_array_equal(two_threads[17], single_run)


@pytest.mark.parametrize("radius", [0.5, 0.7, 1.0])
@pytest.mark.parametrize("modulus", [69e9, 1e9])
def test_newton_is_converged(radius, modulus):
    """All outputs are those at a tolerance near rounding, within 5e-6 of their range.

    The precise run takes more than one matrix per step, and so projects with another one.
    """

    def run(**options):
        integrator = fb.GeneralizedAlpha(spectral_radius=radius, **options)
        model = slider_crank(youngs_modulus=modulus)
        return fb.simulate(model, duration=0.2, step=STEP, integrator=integrator)

    default_run = run()
    precise_run = run(tolerance=1e-14)
    scale = np.abs(precise_run).max("time")
    assert (np.abs(default_run - precise_run).max("time") <= 5e-6 * scale + 1e-12).all()


def test_undamped_integrator_keeps_ringing_and_a_damped_one_does_not():
    ringing = {}
    for radius in (0.5, 1.0):
        motion = fb.simulate(
            slider_crank(angle=lambda t: 4 * np.pi * t),
            duration=0.6,
            step=1e-3,
            integrator=fb.GeneralizedAlpha(spectral_radius=radius),
        ).sel(output="F_X")
        ringing[radius] = np.abs(np.diff(motion.values[-100:], n=2)).max()
    assert ringing[1.0] > 20 * ringing[0.5]


def test_slider_rings_on_the_links_axial_stiffness_about_the_springs_force():
    model = slider_crank(angle=lambda t: 0.0, rest_length=1.0)  # pulled by 350 N, crank at rest
    integrator = fb.GeneralizedAlpha(spectral_radius=1.0)
    motion = fb.simulate(model, duration=0.2, step=5e-5, integrator=integrator).sel(output="F_X")
    ringing = motion.values - motion.values.mean()
    spectrum = np.abs(np.fft.rfft(ringing * np.hanning(len(ringing)), 2**18))
    peak = np.fft.rfftfreq(2**18, 5e-5)[np.argmax(spectrum)]
    mass = 7800 * 0.08 * 0.08 * 0.2 + 2700 * 0.45 * 1e-4 / 3
    exact = np.sqrt((69e9 * 1e-4 / 0.45 + 1000) / mass) / (2 * np.pi)
    assert peak == pytest.approx(exact, rel=1e-3)
    assert motion.values.mean() == pytest.approx(-350.0, rel=0.02)


def test_a_rough_guess_is_assembled():
    crank = fb.RigidBody.bar(length=0.2, height=0.01, width=0.01, density=7800.0, angle=0.2)
    link = fb.Beam(
        length=0.45, height=0.01, width=0.01, density=2700.0, youngs_modulus=69e9,
        poissons_ratio=0.34, elements=3, start=(0.19, 0.05), angle=-0.15,
    )  # fmt: skip
    slider = block(position=(0.6, 0.02), angle=0.15)
    model = fb.Mechanism(
        bodies={"crank": crank, "link": link, "slider": slider},
        joints={
            "A": fb.Revolute("crank.start", (0.0, 0.0)),
            "B": fb.Revolute("link.start", "crank.end"),
            "C": fb.Revolute("slider", "link.end"),
            "guide": fb.Prismatic("slider", (0.0, 0.0)),
            "motor": fb.PrescribedRotation("crank", lambda t: 0.3),
        },
        sensors={"x": fb.Position("slider"), "F": fb.Reaction("A")},
    )
    with pytest.warns(fb.errors.FlexbandWarning, match=r"turned body 'slider' by 0\.15 rad"):
        motion = fb.simulate(model, duration=0.01, step=1e-3)
    exact = 0.2 * np.cos(0.3) + np.sqrt(0.45**2 - (0.2 * np.sin(0.3)) ** 2)
    np.testing.assert_allclose(motion.sel(output="x_X"), exact, atol=1e-9)
    assert np.abs(motion.sel(output=["F_X", "F_Y"])).max() < 1e-3  # no stress, no load


@pytest.mark.parametrize("angle", [2.0, 3.0, np.pi, -2.5])
def test_a_drive_that_would_start_the_wrong_way_round_is_refused(angle):
    with pytest.raises(fb.errors.AssemblyError, match="'motor' holds its body the wrong way round"):
        fb.simulate(pendulum_driven(lambda t: angle), duration=0.01, step=1e-3)
    with pytest.warns(fb.errors.FlexbandWarning, match=r"turned body 'a' by 1\.57 rad"):
        fb.simulate(pendulum_driven(lambda t: np.pi / 2), duration=0.01, step=1e-3)


def test_a_slide_that_would_be_held_upside_down_is_refused():
    model = fb.Mechanism(
        bodies={"a": block(angle=3.0)},
        joints={"guide": fb.Prismatic("a", (0.0, 0.0))},
        sensors={"x": fb.Position("a")},
    )
    with pytest.raises(fb.errors.AssemblyError, match="'guide' holds its body the wrong way round"):
        fb.simulate(model, duration=0.01, step=1e-3)


def test_a_mechanism_that_cannot_be_assembled():
    # crank 0.2 and link 0.1 do not reach a pin 0.58 away
    crank = fb.RigidBody.bar(length=0.2, height=0.01, width=0.01, density=1.0)
    link = fb.RigidBody.bar(
        length=0.1, height=0.01, width=0.01, density=1.0, start=(0.2, 0.0), angle=1.0
    )
    mechanism = fb.Mechanism(
        bodies={"crank": crank, "link": link},
        joints={
            "A": fb.Revolute("crank.start", (0.0, 0.0)),
            "B": fb.Revolute("crank.end", "link.start"),
            "C": fb.Revolute("link.end", (0.3, 0.5)),
        },
        sensors={"angle": fb.Angle("link")},
    )
    with pytest.raises(fb.errors.AssemblyError, match="the constraints cannot be met") as error:
        fb.simulate(mechanism, duration=0.01, step=1e-3)
    gap = np.hypot(0.3, 0.5) - 0.3  # least squares share it among the joints
    assert f"stays open by {gap / 3:.3g} m, all joints together by {gap:.3g} m" in str(error.value)
    assert "places of joints of 'crank', 'link', or their `start` and `angle`" in str(error.value)
    assert "`fb.draw(mechanism, sample=0)` shows the guess" in str(error.value)


@pytest.mark.filterwarnings("ignore:overflow encountered")
@pytest.mark.filterwarnings("ignore:invalid value encountered")
def test_a_gap_whose_square_is_too_large_for_a_number():
    model = fb.Mechanism(
        bodies={"a": fb.RigidBody(mass=1.0, inertia=1.0, points={"tip": (1.0, 0.0)})},
        joints={
            "pin": fb.Revolute("a", (0.0, 0.0)),
            "rod": fb.Distance("a.tip", (0.0, 1.0), length=1e-300),
        },
        sensors={"angle": fb.Angle("a")},
    )
    with pytest.raises(fb.errors.AssemblyError, match="joint 'rod' stays open"):
        fb.simulate(model, duration=0.01, step=1e-3)


def test_samples_that_fail_alike_are_told_once():
    heights = np.r_[np.full(3, 1.2), np.full(7, 2.0)]
    bar = {"height": 0.01, "width": 0.01, "density": 1.0}
    model = fb.Mechanism(
        bodies={
            "a": fb.RigidBody.bar(length=1.0, angle=1.2, **bar),
            "b": fb.RigidBody.bar(length=0.5, angle=0.5, **bar),
        },
        joints={
            "A": fb.Revolute("a.start", (0.0, 0.0)),
            "B": fb.Revolute("b.start", "a.end"),
            "C": fb.Revolute("b.end", (0.0, heights)),
        },
        sensors={"angle": fb.Angle("b")},
    )
    with pytest.raises(fb.errors.AssemblyError) as error:
        fb.simulate(model, duration=0.01, step=1e-3)
    lines = str(error.value).splitlines()
    assert lines[:2] == [
        "7 of 10 runs failed",
        "samples 3, 4, 5, 6, 7 and 2 more, t = 0 s: the constraints cannot be met",
    ]
    assert len(lines) == 3
    assert "all joints together by 0.5 m" in lines[2]


def test_constraints_that_contradict_each_other():
    mechanism = fb.Mechanism(
        bodies={"a": fb.RigidBody.bar(length=0.2, height=0.01, width=0.01, density=1.0)},
        joints={
            "A": fb.Revolute("a.start", (0.0, 0.0)),
            "B": fb.Revolute("a.end", (0.25, 0.0)),
        },
        sensors={"angle": fb.Angle("a")},
    )
    with pytest.raises(fb.errors.AssemblyError, match=r"contradict each other.* joint 'B'"):
        fb.simulate(mechanism, duration=0.01, step=1e-3)


@pytest.mark.parametrize(
    ("build", "text"),
    [
        (lambda: fb.GeneralizedAlpha(spectral_radius=[0.1, 0.2]), "must be 1 number"),  # type: ignore
        (lambda: fb.GeneralizedAlpha(spectral_radius=1.2), "from 0 to 1; got 1.2"),
        (lambda: fb.GeneralizedAlpha(tolerance=0.0), "tolerance"),
    ],
)
def test_bad_integrators_are_refused(build, text):
    with pytest.raises(fb.errors.InputError, match=text):
        build()


def hits_stops(stiffness):
    law = fb.contact.KeepsRestitution(stiffness=stiffness, restitution=0.5)
    model = pendulum()
    stop = fb.contact.AngularStop("bar.end", (0.0, 0.0), law, lower=-0.1)
    return replace(model, loads={**model.loads, "stop": stop})


def engages_a_motor(stiffness):
    motor = fb.PrescribedRotation("bar", lambda t: 10.0 * t)
    switched_motor = fb.contact.Switched(motor, lambda t: t >= 2.5e-3)
    model = on_springs(stiffness)
    return replace(model, joints={**model.joints, "motor": switched_motor})


def on_springs(stiffness):
    spring = fb.Spring("bar.end", (0.0, -2.0), stiffness * 1e-3, 1.0)
    return replace(pendulum(-np.pi / 2), loads={"gravity": fb.Gravity(), "spring": spring})


def on_three_cranks(stiffness):
    model = parallelogram(3)
    return replace(model, loads={"spring": fb.Spring("coupler", (0.0, 3.0), stiffness, 1.0)})


@pytest.mark.parametrize(
    ("build", "compute"),
    [
        (on_springs, lambda model: fb.simulate(model, duration=0.005, step=1e-3, threads=1)),
        (hits_stops, lambda model: fb.simulate(model, duration=0.3, step=1e-2, threads=1)),
        (engages_a_motor, lambda model: fb.simulate(model, duration=0.005, step=1e-3, threads=1)),
        (on_springs, lambda model: fb.equilibrium(model, threads=1)),
        (on_three_cranks, lambda model: fb.equilibrium(model, threads=1)),
        (on_springs, lambda model: fb.modes(model, 1, about="start")),
    ],
)  # fmt: skip
def test_no_result_keeps_the_work_space_of_a_block(build, compute, monkeypatch):
    memory = []
    live_counts = []
    work_space = WorkSpace.from_structure

    def count_references(structure):
        work = work_space(structure)
        memory.append(weakref.ref(work.z.base))
        live_counts.append(sum(reference() is not None for reference in memory))
        return work

    monkeypatch.setattr(WorkSpace, "from_structure", count_references)
    result = compute(build(np.linspace(1e6, 1.1e6, 160)))
    assert result is not None
    assert len(memory) >= 20  # blocks of eight samples
    assert max(live_counts) <= 12  # an equilibrium takes one for each sample of its block
