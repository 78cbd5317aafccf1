"""Tangent, factorization, integrator, initial conditions and lanes."""

import numpy as np
import pytest
import scipy.integrate
from hypothesis import given
from hypothesis import strategies as st

import flexband as fb
from flexband.mechanics.kernels.factorization import analyse

from .models import Dense, pendulum, rigid_slider_crank, slider_crank, states

DURATION, STEP = 0.05, 1e-3


@pytest.mark.parametrize("integration", [fb.FullIntegration(), fb.SelectiveIntegration()])
def test_tangent_is_the_derivative_of_the_residual(integration):
    dense = Dense(slider_crank(integration=integration, youngs_modulus=1e6))
    rng = np.random.default_rng(0)
    size = dense.structure.pattern.unknowns
    unknowns = np.concatenate([dense.start, np.zeros(size - len(dense.start))])
    unknowns += 0.05 * rng.standard_normal(size)
    n = dense.structure.state.coordinates
    step = 1e-5  # central differences: the error is third derivatives times step²/6
    exact = np.stack(
        [
            (dense.residual(unknowns + step * e) - dense.residual(unknowns - step * e)) / (2 * step)
            for e in np.eye(size)
        ],
        axis=1,
    )
    exact[:n, :n] += dense.mass()
    np.testing.assert_allclose(dense.tangent(unknowns), exact, atol=1e-8 * np.abs(exact).max())


def test_factorization_solves_the_saddle_point_system():
    dense = Dense(slider_crank(youngs_modulus=1e4))
    size = dense.structure.pattern.unknowns
    unknowns = np.concatenate([dense.start, np.zeros(size - len(dense.start))])
    right = np.random.default_rng(0).standard_normal(size)
    matrix = dense.tangent(unknowns)
    np.testing.assert_allclose(
        dense.solved(unknowns, right), np.linalg.solve(matrix, right), rtol=1e-7
    )


@given(st.integers(1, 6), st.integers(0, 10_000))
def test_a_multiplier_comes_after_its_coordinates(multipliers, seed):
    rng = np.random.default_rng(seed)
    coordinates = 12
    couples = {(i, i) for i in range(1, coordinates + 1)}
    couples |= {tuple(sorted(rng.integers(1, coordinates + 1, 2))) for _ in range(15)}
    for k in range(multipliers):
        own = rng.choice(np.arange(1, coordinates + 1), 3, replace=False)
        couples |= {(int(i), coordinates + 1 + k) for i in own}
    count = coordinates + multipliers
    pairs = [(i, i + 1 if i < count else 0) for i in range(1, count + 1, 2)]
    pattern, _ = analyse(pairs, coordinates, couples)
    ordered = np.stack([pattern.first, pattern.second], axis=1)
    place = {int(i): k for k, pair in enumerate(ordered) for i in pair}
    assert sorted(place.keys() - {0}) == list(range(1, count + 1))
    for i, j in couples:
        if j > coordinates:
            assert place[i] < place[j]


def test_a_chain_costs_in_proportion_to_its_length():
    def products(elements):
        dense = Dense(slider_crank(elements=elements))
        return len(dense.structure.pattern.product_v)

    assert products(64) - products(32) == 2 * (products(32) - products(16))


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
    time, integrator = 0.8, fb.GeneralizedAlpha(spectral_radius=radius)
    angle, rate = exact_pendulum(time)
    mass = 1500.0 * 0.02 * 0.03
    acceleration = -9.81 * 0.5 * np.cos(angle) / (1 / 3 + INERTIA)
    tangent, normal = np.array([[-np.sin(angle), np.cos(angle)], [-np.cos(angle), -np.sin(angle)]])
    # Force on the bar at the hinge: m (a − g); the multipliers are its opposite.
    force = mass * (0.5 * (acceleration * tangent + rate**2 * normal) - [0.0, -9.81])
    exact_q, exact_v = 0.5 * np.array([np.cos(angle), np.sin(angle)]), 0.5 * rate * tangent
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
    start, end = q[4:6], q[22:24]  # the crank has four coordinates
    assert np.linalg.norm(end - start) == pytest.approx(0.45, abs=1e-12)
    np.testing.assert_allclose(start, 0.2 * np.array([np.cos(0.9), np.sin(0.9)]), atol=1e-12)
    np.testing.assert_allclose(
        v[4:6], 0.8 * np.pi * np.array([-np.sin(0.9), np.cos(0.9)]), atol=1e-10
    )
    turn = -0.8 * np.pi * np.cos(0.9) / (end[0] - start[0])  # rate of the rigid link
    for node in range(4):
        rx, vx = q[6 + 6 * node : 8 + 6 * node], v[6 + 6 * node : 8 + 6 * node]
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
    mass, c, s = 2000.0 * 0.4 * 0.02**2, np.cos(0.7), np.sin(0.7)
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
    all_at_once = fb.simulate(slider_crank(**values), duration=DURATION, step=STEP, threads=2)
    one_thread = fb.simulate(slider_crank(**values), duration=DURATION, step=STEP, threads=1)
    np.testing.assert_array_equal(all_at_once, one_thread)
    order = np.random.default_rng(0).permutation(29)
    mixed = fb.simulate(
        slider_crank(**{k: v[order] for k, v in values.items()}), duration=DURATION, step=STEP
    )
    np.testing.assert_array_equal(all_at_once[order], mixed)
    few = fb.simulate(
        slider_crank(**{k: v[11:14] for k, v in values.items()}), duration=DURATION, step=STEP
    )
    np.testing.assert_array_equal(all_at_once[11:14], few)
    alone = fb.simulate(
        slider_crank(**{k: v[17] for k, v in values.items()}), duration=DURATION, step=STEP
    )
    np.testing.assert_array_equal(all_at_once[17], alone)


@pytest.mark.parametrize("radius", [0.5, 0.7, 1.0])
@pytest.mark.parametrize("modulus", [69e9, 1e9])
def test_newton_is_converged(radius, modulus):
    """All outputs within 1e-6 of their range of those at a tolerance near rounding."""

    def run(**options):
        integrator = fb.GeneralizedAlpha(spectral_radius=radius, **options)
        model = slider_crank(youngs_modulus=modulus)
        return fb.simulate(model, duration=0.2, step=STEP, integrator=integrator)

    loose, tight = run(), run(tolerance=1e-14)
    scale = np.abs(tight).max("time")
    assert (np.abs(loose - tight).max("time") <= 1e-6 * scale + 1e-12).all()


def test_undamped_integrator_keeps_ringing_and_a_damped_one_does_not():
    late = {}
    for radius in (0.5, 1.0):
        motion = fb.simulate(
            slider_crank(angle=lambda t: 4 * np.pi * t),
            duration=0.6,
            step=1e-3,
            integrator=fb.GeneralizedAlpha(spectral_radius=radius),
        ).sel(output="F_X")
        late[radius] = np.abs(np.diff(motion.values[-100:], n=2)).max()
    assert late[1.0] > 20 * late[0.5]


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


def test_spring_is_relaxed_at_the_start_unless_told():
    still = fb.simulate(slider_crank(angle=lambda t: 0.0), duration=0.05, step=1e-3)
    assert np.abs(still.sel(output=["F_X", "F_Y"])).max() < 1e-6


def test_points_along_a_beam_of_uncertain_length():
    lengths = np.array([0.4, 0.5])
    still = {"height": 0.01, "width": 0.01, "density": 1.0, "elements": 3}
    beam = fb.Beam(length=lengths, youngs_modulus=1e9, poissons_ratio=0.3, angle=0.3, **still)
    model = fb.Mechanism(bodies={"b": beam}, sensors={"m": fb.Position("b.middle")})
    start = fb.simulate(model, duration=0.01, step=0.01).isel(time=0).values
    exact = lengths[:, None] / 2 * [np.cos(0.3), np.sin(0.3)]
    np.testing.assert_allclose(start, exact, atol=1e-15)


def test_soft_pendulum():
    """A published flexible pendulum; positions of the tip [m] of a converged solution."""
    beam = fb.Beam(
        length=0.5, height=0.002, width=0.01, density=1000.0, elements=32,
        youngs_modulus=1e8, poissons_ratio=0.3,
    )  # fmt: skip
    model = fb.Mechanism(
        bodies={"beam": beam},
        joints={"hinge": fb.Revolute("beam.start", (0.0, 0.0))},
        loads={"gravity": fb.Gravity()},
        sensors={"tip": fb.Position("beam.end"), "middle": fb.Position("beam.middle")},
    )
    motion = fb.simulate(model, duration=0.75, step=1e-3)
    tip = motion.sel(output=["tip_X", "tip_Y"]).isel(time=[250, 500, 750]).values.T
    exact = [(0.32400, -0.37488), (-0.42067, -0.26203), (-0.41177, 0.06961)]
    np.testing.assert_allclose(tip, exact, atol=2e-3)
    assert np.hypot(*motion.sel(output=["middle_X", "middle_Y"]).values).max() < 0.2501
