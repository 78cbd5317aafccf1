"""Models in Exudyn, run sample by sample, against flexband in the plane and SciPy in space."""

import itertools
import runpy
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import flexband as fb

pytest.importorskip("exudyn.itemInterface")
EXAMPLE = Path(__file__).parents[2] / "examples" / "models" / "exudyn_pendulum.py"


def test_a_double_pendulum():
    module = runpy.run_path(str(EXAMPLE))
    first_length = module["LENGTH"]
    density = module["DENSITY"]

    def bar(length, start):
        mass = density * length
        points = {"start": (-length / 2, 0.0), "end": (length / 2, 0.0)}
        return fb.RigidBody(mass=mass, inertia=mass * length**2 / 12,
                            position=(start + length / 2, 0.0), points=points)  # fmt: skip

    def double_pendulum(second_length, friction):
        return fb.Mechanism(
            bodies={"first": bar(first_length, 0.0), "second": bar(second_length, first_length)},
            joints={"upper": fb.Revolute("first.start", (0.0, 0.0)),
                    "lower": fb.Revolute("first.end", "second.start")},
            loads={"gravity": fb.Gravity(),
                   "friction": fb.TorsionSpring("first", "second", stiffness=0.0,
                                                damping=friction)},
            sensors={"first": fb.Angle("first"), "second": fb.Angle("second")},
        )  # fmt: skip

    values = {"second_length": np.array([0.29, 0.31]), "friction": np.array([0.02, 0.03])}
    motion = module["response"](**values)
    step = {"step": module["STEP"], "output_step": 10 * module["STEP"]}
    expected = fb.dynamic_response(double_pendulum, duration=module["DURATION"], **step)(**values)
    assert motion.dims == ("sample", "output", "time")
    assert np.ptp(motion.values, axis=0).max() > 0.05
    np.testing.assert_allclose(motion, expected.values, atol=4e-5)
    np.testing.assert_allclose(motion["time"], expected["time"])
    assert module["study"].response is module["response"]


def example(name):
    return runpy.run_path(str(EXAMPLE.with_name(name)))


def rotate(points, angle, plane):
    """Return points turned by an angle in a plane of two axes; complex numbers are allowed."""
    i, j = plane
    result = points.astype(complex)
    result[:, i] = np.cos(angle) * points[:, i] - np.sin(angle) * points[:, j]
    result[:, j] = np.sin(angle) * points[:, i] + np.cos(angle) * points[:, j]
    return result


def test_a_robot_arm_in_space():
    """Against Lagrange's equations: eight points have the inertia of a block."""
    module = example("exudyn_robot_arm.py")
    width = module["WIDTH"]
    forearm = module["FOREARM"]
    upper = 0.5
    payload = 1.0
    corners = np.array(list(itertools.product((-(12**-0.5), 12**-0.5), repeat=3)))

    def block(length):
        return corners * (length, width, width) + (length / 2, 0.0, 0.0)

    def places(q):
        hand = rotate(np.vstack([block(forearm), [(forearm, 0.0, 0.0)]]), q[2], (0, 2))
        arm = rotate(np.vstack([block(upper), hand + np.array([upper, 0.0, 0.0])]), q[1], (0, 2))
        return rotate(np.vstack([arm, corners * width]), q[0], (0, 1))

    # Masses at the corners of the three blocks, and that of the payload at the hand.
    sizes = np.repeat([upper, forearm, width], 8) * module["DENSITY"] * width**2 / 8
    masses = np.insert(sizes, 16, payload)
    stiffness = np.array([*module["STIFFNESS"], 100.0])

    def jacobian(q):
        return np.stack([places(q + 1e-30j * e).imag / 1e-30 for e in np.eye(3)], axis=-1)

    def rate(t, state):
        q, v = np.split(state, 2)
        # Lagrange's equations; the bias is the acceleration at constant rates, less gravity.
        bias = (jacobian(q + 1e-6 * v) - jacobian(q - 1e-6 * v)) @ v / 2e-6 + (0.0, 0.0, 9.81)
        J = jacobian(q)
        moment = -stiffness * (q - module["TARGETS"]) - module["DAMPING"] * v
        moment -= np.einsum("k,kci,kc", masses, J, bias)
        return np.r_[v, np.linalg.solve(np.einsum("k,kci,kcj", masses, J, J), moment)]

    values = {"payload": np.array([payload]), "upper_length": np.array([upper]),
              "elbow_stiffness": stiffness[2:]}  # fmt: skip
    motion = module["response"](**values)[0]
    times = motion["time"].values
    solution = solve_ivp(
        rate, (0.0, times[-1]), np.zeros(6), rtol=1e-8, atol=1e-9, t_eval=times[::10]
    )
    expected = np.array([places(q)[16].real for q in solution.y[:3].T]).T
    assert np.ptp(motion.values, axis=1).min() > 0.1
    np.testing.assert_allclose(motion.values[:, ::10], expected, atol=2e-5)


def test_a_flexible_four_bar_in_space():
    """A stiff rod moves as a rigid one does; a soft one bends as finer elements say."""
    module = example("exudyn_spatial_four_bar.py")
    length = 0.3
    angle = module["rocker_angle"]
    mass = module["DENSITY"] * np.pi * module["RADIUS"] ** 2 * length

    def places(theta):
        phi = angle(theta, length)
        tip = module["CRANK"] * np.array([np.cos(theta), np.sin(theta), 0.0])
        end = module["PIVOT"] + module["ROCKER"] * np.array([0.0, np.cos(phi), np.sin(phi)])
        return np.array([tip, (tip + end) / 2, end, (phi, 0.0, 0.0)])

    def energies(theta):  # of a rate of one; Simpson's rule is exact for a rigid rod
        slope = (places(theta + 1e-5) - places(theta - 1e-5)) / 2e-5
        weights = np.array([mass / 6, 4 * mass / 6, mass / 6, 1e-3])
        return module["FLYWHEEL"] + weights @ (slope**2).sum(1), mass * 9.81 * places(theta)[1, 2]

    def rate(t, state):
        theta, omega = state
        (inertia_after, high), (inertia_before, low) = (
            energies(theta + 1e-4),
            energies(theta - 1e-4),
        )
        pull = (
            module["TORQUE"]
            - (inertia_after - inertia_before) / 2e-4 * omega**2 / 2
            - (high - low) / 2e-4
        )
        return omega, pull / energies(theta)[0]

    stiff = module["four_bar"](length, 3e11)
    times = stiff["time"].values
    solution = solve_ivp(rate, (0.0, times[-1]), (0.0, 0.0), rtol=1e-8, t_eval=times)
    np.testing.assert_allclose(stiff[0], solution.y[0], atol=1e-3)
    np.testing.assert_allclose(stiff[1], angle(stiff[0].values, length), atol=2e-5)
    soft, fine = (module["four_bar"](length, 3e9, elements)[2].values for elements in (6, 12))
    assert 1e-4 < np.ptp(soft) < 0.03
    np.testing.assert_allclose(soft, fine, atol=0.01 * np.ptp(soft))
