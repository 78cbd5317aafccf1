"""The beam element against exact integrals, an independent energy and published beams."""

import warnings

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import eigh, null_space

import flexband as fb
from flexband.mechanics.assembly.system import assemble
from flexband.mechanics.kernels.elements.hermite import hermite, hermite_slope
from tests.mechanics.models import FINE, Dense, beam, motion_of, states


def shape_matrix(x, y, length):
    """Omar and Shabana's S of one element, as polynomials in x and y."""
    xi = x / length
    eta = y / length
    s = [
        1 - 3 * xi**2 + 2 * xi**3,
        length * (xi - 2 * xi**2 + xi**3),
        length * (eta - xi * eta),
        3 * xi**2 - 2 * xi**3,
        length * (-(xi**2) + xi**3),
        length * xi * eta,
    ]
    return np.kron(np.array(s), np.eye(2)).reshape(2, 12) if np.ndim(x) == 0 else s


def quadrature(length, height, nx=6, ny=4):
    a, wa = np.polynomial.legendre.leggauss(nx)
    b, wb = np.polynomial.legendre.leggauss(ny)
    for x, wx in zip((a + 1) * length / 2, wa * length / 2, strict=True):
        for y, wy in zip(b * height / 2, wb * height / 2, strict=True):
            yield x, y, wx * wy


def gradients(x, y, length):
    """∂S/∂x and ∂S/∂y, by complex steps."""
    step = 1e-30
    dx = shape_matrix(x + 1j * step, y + 0j, length).imag / step
    dy = shape_matrix(x + 0j, y + 1j * step, length).imag / step
    return dx, dy


def energy(e, body, selective):
    """½∫ EᵀDE dV of one element by brute force, plane stress, real or complex coordinates."""
    E = body.youngs_modulus
    nu = body.poissons_ratio
    width = body.width
    D = E / (1 - nu**2) * np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]])
    k = 10 * (1 + nu) / (12 + 11 * nu)
    D0 = np.diag([E, E, k * E / (2 * (1 + nu))])
    Dnu = E * nu / (1 - nu**2) * np.array([[nu, 1, 0], [1, nu, 0], [0, 0, 0]])

    def strain(x, y):
        Sx, Sy = gradients(x, y, body.length)
        rx = Sx @ e
        ry = Sy @ e
        return np.array([(rx @ rx - 1) / 2, (ry @ ry - 1) / 2, rx @ ry])

    total = 0.0
    for x, y, w in quadrature(body.length, body.height):
        s = strain(x, y)
        s0 = strain(x, 0.0)
        if selective:
            total += 0.5 * w * width * (s @ D0 @ s + s0 @ Dnu @ s0)
        else:
            total += 0.5 * w * width * (s @ D @ s)
    return total


@pytest.mark.parametrize("selective", [False, True])
def test_elastic_force_is_the_derivative_of_the_energy(selective):
    integration = fb.sections.SelectiveIntegration() if selective else fb.sections.FullIntegration()
    body = beam(1, integration)
    dense = Dense(fb.Mechanism(bodies={"beam": body}))
    rng = np.random.default_rng(1)
    q = dense.start + 0.1 * rng.standard_normal(12)
    exact = [energy(q + 1e-30j * e, body, selective).imag / 1e-30 for e in np.eye(12)]
    np.testing.assert_allclose(dense.residual(q), exact, rtol=1e-12, atol=1e-12 * np.max(exact))


def test_mass_matrix_is_the_exact_integral():
    body = beam(1)
    exact = np.zeros((12, 12))
    for x, y, w in quadrature(body.length, body.height):
        S = shape_matrix(x, y, body.length)
        exact += w * body.width * body.density * S.T @ S
    mass = Dense(fb.Mechanism(bodies={"beam": body})).mass()
    np.testing.assert_allclose(mass, exact, rtol=1e-12, atol=1e-13 * exact.max())


def test_mass_of_varying_density():
    body = beam(3, density=lambda x: 1000 + 500 * x)
    dense = Dense(fb.Mechanism(bodies={"beam": body}))
    along = np.tile([1.0, 0, 0, 0, 0, 0], 4)
    exact = 0.02 * (1000 * 1.3 + 250 * 1.3**2)
    assert along @ dense.mass() @ along == pytest.approx(exact, rel=1e-14)


@given(st.floats(0, 1), st.integers(0, 3))
def test_shape_functions_reproduce_cubics(xi, power):
    nodes = [0.0**power, power * 0.0 ** max(power - 1, 0) if power else 0.0, 1.0, float(power)]
    assert hermite(xi) @ nodes == pytest.approx(xi**power, abs=1e-14)
    slope = power * xi ** (power - 1) if power else 0.0
    assert hermite_slope(xi) @ nodes == pytest.approx(slope, abs=1e-13)


@given(st.floats(-10, 10), st.floats(-5, 5), st.floats(-5, 5), st.booleans())
def test_rigid_motion_leaves_the_beam_unstrained(angle, x, y, selective):
    integration = fb.sections.SelectiveIntegration() if selective else fb.sections.FullIntegration()
    body = beam(2, integration, angle=angle, start=(x, y))
    dense = Dense(fb.Mechanism(bodies={"beam": body}))
    assert np.abs(dense.residual(dense.start)).max() < 1e-14 * 70e9 * 0.02 * 20


def static_tip(elements, integration, load):
    """Tip displacement of a clamped beam of Nachbagauer (2011) by Newton's method."""
    body = fb.Beam(
        length=2.0,
        height=0.5,
        width=0.1,
        density=1.0,
        youngs_modulus=2.07e11,
        poissons_ratio=0.3,
        elements=elements,
        integration=integration,
    )
    dense = Dense(fb.Mechanism(bodies={"beam": body}))
    zero_mass = dense.mass()
    q = dense.start.copy()
    force = np.zeros(len(q))
    force[-5] = -load
    for _ in range(20):
        K = (dense.tangent(q) - zero_mass)[6:, 6:]
        step = np.linalg.solve(K, (force - dense.residual(q))[6:])
        q[6:] += step
        if np.abs(step).max() < 1e-14:
            break
    return -q[-5]


@pytest.mark.parametrize(
    ("integration", "exact"),
    [
        (fb.sections.FullIntegration(), {1: 5.5545e-4, 4: 7.2287e-4, 16: 7.3386e-4}),
        (fb.sections.SelectiveIntegration(), {1: 6.1256e-4, 4: 7.9674e-4, 16: 8.0888e-4}),
    ],
)
def test_thick_cantilever(integration, exact):
    for elements, deflection in exact.items():
        assert static_tip(elements, integration, 62_500.0) == pytest.approx(deflection, rel=5e-4)


def frequencies(integration, elements, nu):
    """First frequencies of a pinned–pinned beam [rad/s] from M and K."""
    body = beam(elements, integration, length=2.0, height=0.02, poissons_ratio=nu)
    dense = Dense(fb.Mechanism(bodies={"beam": body}))
    constraints = np.zeros((3, len(dense.start)))
    constraints[0, 0] = constraints[1, 1] = constraints[2, -5] = 1.0
    basis = null_space(constraints)
    M = dense.mass()
    K = dense.tangent(dense.start) - M
    return np.sqrt(eigh(basis.T @ K @ basis, basis.T @ M @ basis, eigvals_only=True))


def test_pinned_pinned_frequency_is_euler_bernoullis():
    E = 70e9
    rho = 2700.0
    h = 0.02
    L = 2.0
    exact = np.pi**2 * np.sqrt(E * h**2 / 12 / rho) / L**2
    # Rotary inertia and shear lower the first frequency by 1.6e-4 of it at this slenderness.
    shear = 1 - 0.5 * (np.pi * h / L) ** 2 / 12 * (1 + 2 * 1.3 * 1.2)
    errors = [
        frequencies(fb.sections.SelectiveIntegration(), n, 0.3)[0] / (exact * shear) - 1
        for n in (16, 32, 64)
    ]
    assert 0 < errors[-1] < 1.2e-4
    np.testing.assert_allclose(errors[0] / errors[1], 4.0, rtol=0.05)  # second order in the mesh
    np.testing.assert_allclose(errors[1] / errors[2], 4.0, rtol=0.05)
    full_integration = frequencies(fb.sections.FullIntegration(), 64, 0.3)[0]
    assert full_integration == pytest.approx(exact * shear / np.sqrt(1 - 0.3**2), rel=2e-4)


def test_function_and_array_of_the_same_material_agree():
    q = Dense(fb.Mechanism(bodies={"b": beam(2)})).start * 1.01
    number = Dense(fb.Mechanism(bodies={"b": beam(2)})).residual(q)
    function = beam(2, youngs_modulus=lambda x: 70e9 + 0 * x, poissons_ratio=np.full(8, 0.3))
    np.testing.assert_array_equal(Dense(fb.Mechanism(bodies={"b": function})).residual(q), number)


@pytest.mark.parametrize(
    ("change", "text"),
    [
        ({"length": -0.45}, r"length \[m\] must be positive; got -0.45"),
        ({"length": np.array([0.4, 0.0])}, r"got 0 \(sample 1\)"),
        ({"density": 0.0}, "density"),
        ({"youngs_modulus": float("nan")}, "youngs_modulus"),
        ({"poissons_ratio": 0.5}, "above -1 and below 0.5; got 0.5"),
        ({"poissons_ratio": -1.0}, "got -1"),
        ({"elements": 0}, "elements must be 1 or more; got 0"),
        ({"elements": 2.5}, "whole number"),
        ({"height": "thick"}, "height"),
        ({"start": (np.inf, 0.0)}, "start X"),
    ],
)
def test_bad_numbers_are_refused(change, text):
    with pytest.raises(fb.errors.InputError, match=text):
        beam(**change)


def test_bad_material_functions_are_refused_by_body():
    bad = beam(youngs_modulus=lambda x: 1e9 - 2e9 * x)
    with pytest.raises(fb.errors.InputError, match="body 'arm': Beam youngs_modulus"):
        Dense(fb.Mechanism(bodies={"arm": bad}))
    with pytest.raises(fb.errors.InputError, match="must return values of that shape"):
        Dense(fb.Mechanism(bodies={"arm": beam(density=lambda x: np.ones(7))}))


def test_a_free_flexible_body_keeps_momentum():
    """Linear and angular momentum, with velocities given at the start."""
    body = beam(
        elements=4, height=0.05, youngs_modulus=1e7, velocity=(1.0, 2.0), rate=30.0, angle=0.3
    )
    model = fb.Mechanism(
        bodies={"b": body},
        sensors={"T": fb.KineticEnergy()},
    )
    motion = fb.simulate(model, duration=0.3, step=1e-4, integrator=FINE)
    mass = 2700 * 0.05 * 0.1 * 1.3
    length = 1.3
    start_energy = (
        0.5
        * mass
        * (
            (1.0 - 30.0 * length / 2 * np.sin(0.3)) ** 2
            + (2.0 + 30.0 * length / 2 * np.cos(0.3)) ** 2
        )
        + 0.5 * mass * (length**2 + 0.05**2) / 12 * 30.0**2
    )
    assert float(motion.sel(output="T")[0]) == pytest.approx(start_energy, rel=1e-8)
    q, v, _ = states(model, 3000, 1e-4, FINE)
    q0, v0, _ = states(model, 0, 1e-4, FINE)
    n = assemble(model).structure.state.coordinates
    M = np.zeros((n, n))
    for (i, j), value in model.model.mass.items():
        M[i - 1, j - 1] = M[j - 1, i - 1] = np.squeeze(value)
    move = np.zeros((2, n))
    move[0, 0::6] = move[1, 1::6] = 1.0
    np.testing.assert_allclose(move @ M @ v, move @ M @ v0, rtol=1e-9)
    quarter_turn = lambda s: np.stack([-s[1::2], s[0::2]], axis=1).ravel()  # noqa: E731
    assert quarter_turn(q) @ M @ v == pytest.approx(quarter_turn(q0) @ M @ v0, rel=1e-6)


def test_kelvin_voigt_damps_a_mode_by_half_its_retardation_times_frequency():
    """A heavy mass on the axial stiffness of a light bar: logarithmic decrement."""
    length = 1.0
    area = 1e-4
    modulus = 1e9
    mass = 50.0
    tau = 2e-4
    rod = fb.Beam(
        length=length, height=0.01, width=0.01, density=10.0, youngs_modulus=modulus,
        poissons_ratio=0.0, elements=2, retardation_time=np.array([0.0, tau]),
    )  # fmt: skip
    motion = motion_of(
        duration=0.6,
        step=2e-4,
        bodies={"rod": rod, "m": fb.PointMass(mass=mass, position=(length, 0.0))},
        joints={
            "clamp": fb.Weld("rod.start", (0.0, 0.0)),
            "pin": fb.Revolute("rod.end", "m"),
            "line": fb.Slot("m", (0.0, 0.0)),
        },
        loads={"kick": fb.Force("m", x=lambda t: 200.0 if t < 5e-3 else 0.0)},
        sensors={"m": fb.Position("m")},
    )
    x = motion.sel(output="m_X").values - length
    omega = np.sqrt(modulus * area / length / mass)
    zeta = tau * omega / 2
    t = motion.time.values
    after_kick = t > 0.01
    for k, ratio in enumerate((0.0, zeta)):
        decay = np.exp(-ratio * omega * t[after_kick])
        w = omega * np.sqrt(1 - ratio**2)
        basis = np.stack(
            [decay * np.cos(w * t[after_kick]), decay * np.sin(w * t[after_kick])], axis=1
        )
        weights, *_ = np.linalg.lstsq(basis, x[k, after_kick], rcond=None)
        size = np.hypot(*weights)
        np.testing.assert_allclose(x[k, after_kick], basis @ weights, atol=0.003 * size)
    assert size > 1e-4


def test_damping_leaves_a_turning_beam_alone():
    """A free beam that turns as a rigid body has no strain rates: it keeps its energy."""
    properties = {"height": 0.05, "rate": 20.0, "velocity": (1.0, -1.0), "elements": 3}
    stiff = beam(retardation_time=np.array([0.0, 1e-3]), **properties)
    motion = motion_of(bodies={"b": stiff}, sensors={"T": fb.KineticEnergy()}, duration=0.2)
    energy = motion.sel(output="T").values
    np.testing.assert_allclose(energy[1, 20:], energy[1, -1], rtol=1e-4)
    np.testing.assert_allclose(energy[1, -1], energy[0].mean(), rtol=1e-3)


def test_points_along_a_beam_of_uncertain_length():
    lengths = np.array([0.4, 0.5])
    properties = {"height": 0.01, "width": 0.01, "density": 1.0, "elements": 3}
    beam = fb.Beam(length=lengths, youngs_modulus=1e9, poissons_ratio=0.3, angle=0.3, **properties)
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


def test_a_bad_shear_factor_is_refused():
    with pytest.raises(fb.errors.InputError, match="shear_factor"):
        fb.sections.SelectiveIntegration(shear_factor=0.0)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"youngs_modulus": 210.0}, "about 2e.02 Pa .* softer"),  # GPa
        ({"youngs_modulus": 210e3}, "softer than any"),  # MPa
        ({"density": 7.85}, "about 7.8 kg/m³ is stiffer"),  # g/cm³
        ({"height": 10.0, "width": 10.0}, "about 1e.01 m high"),  # mm
        ({"length": 500.0}, "about 500 m long, 5e.04 times its thickness of 0.01 m"),  # mm
    ],
)
def test_numbers_in_other_units_are_remarked(changes, text):
    steel = {"length": 0.5, "height": 0.01, "width": 0.01, "density": 7850.0}
    steel |= {"youngs_modulus": 210e9, "poissons_ratio": 0.3, "elements": 2}
    rubber = {"density": 1100.0, "youngs_modulus": 1e6}
    blade = {"length": 80.0, "height": 0.3}
    wire = {"length": 40.0}
    for valid_changes in ({}, rubber, blade, wire):
        with warnings.catch_warnings(action="error"):
            assemble(fb.Mechanism(bodies={"beam": fb.Beam(**(steel | valid_changes))}))
    with pytest.warns(fb.errors.FlexbandWarning, match=text):
        assemble(fb.Mechanism(bodies={"beam": fb.Beam(**(steel | changes))}))


def test_a_rigid_body_in_millimetres_is_remarked():
    with pytest.warns(
        fb.errors.FlexbandWarning, match="smallest side of a rigid body is about 1e.01 m"
    ):
        fb.RigidBody.block(length=200.0, height=10.0, width=10.0, density=7850.0)
    with pytest.warns(
        fb.errors.FlexbandWarning, match="a rigid body is about 200 m long, 2e.04 times"
    ):
        fb.RigidBody.bar(length=200.0, height=0.01, width=0.02, density=7850.0)
