"""Estimated errors of step and mesh, against motions and deflections in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import ellipj, ellipk

import flexband as fb
from tests.mechanics.models import hardening_spring, parallelogram, pendulum

ROPE = {"mass_per_length": 0.12, "axial_stiffness": 450.0, "bending_stiffness": 4e-3}


def window_rms(error, width):
    """The root mean square of an error over `width` times before and after each time."""
    windows = [error[max(k - width, 0) : k + width + 1] for k in range(len(error))]
    return np.array([np.sqrt(np.mean(part**2)) for part in windows])


def pendulum_height(times):
    """The height −cos φ of the tip of the horizontal pendulum: sin φ/2 = sn(ωt + K, ½)/√2."""
    square = 1.5 * 9.81 / (1 + 0.02**2 / 4)  # of a bar with a height of 0.02 m
    sn, *_ = ellipj(np.sqrt(square) * times + ellipk(0.5), 0.5)
    return sn**2 - 1


@pytest.mark.parametrize("radius", [0.6, 1.0])
def test_the_error_of_the_step_against_a_pendulum_in_closed_form(radius):
    """At every time and for the whole motion; the error falls with the square of the step."""
    integrator = fb.GeneralizedAlpha(spectral_radius=radius)
    errors = []
    for step in (1e-2, 5e-3):
        options = {"duration": 2.0, "step": step, "integrator": integrator}
        estimate = fb.discretization_error(pendulum(), **options).sel(output="tip_Y")
        motion = fb.simulate(pendulum(), **options).sel(output="tip_Y")
        true = window_rms(motion.values - pendulum_height(motion.time.values), round(0.05 / step))
        np.testing.assert_allclose(estimate["error"][20:], true[20:], rtol=0.05)
        assert not estimate["mesh_error"].any()
        relative = np.sqrt(np.mean((motion - pendulum_height(motion.time)) ** 2)) / motion.std()
        assert float(estimate["relative_error"]) == pytest.approx(float(relative), rel=0.02)
        errors.append(float(relative))
    assert errors[0] / errors[1] == pytest.approx(4.0, rel=0.02)


def slow_cantilever(elements, integration):
    """A cantilever whose tip is loaded so slowly that it hardly vibrates."""
    beam = fb.Beam(
        length=0.5, height=0.025, width=0.02, density=1000.0, youngs_modulus=2e11,
        poissons_ratio=0.3, elements=elements, integration=integration,
    )  # fmt: skip
    return fb.Mechanism(
        bodies={"b": beam},
        joints={"clamp": fb.Weld("b.start", (0.0, 0.0))},
        loads={"P": fb.Force("b.end", y=lambda t: -10.0 * (1 - np.cos(np.pi * t / 0.2)))},
        sensors={"tip": fb.Position("b.end")},
    )


def test_the_error_of_the_mesh_against_the_deflection_of_beam_theory():
    """PL³/3EI + PL/kGA at the full load, with continuum elements of order two."""
    bending = 0.5**3 / 3 / (0.02 * 0.025**3 / 12)
    shear = 0.5 * 2.6 * 15.3 / 13 / (0.02 * 0.025)
    exact = -20.0 * (bending + shear) / 2e11
    time = {"duration": 0.2, "step": 1e-3}
    for elements in (4, 8):
        model = slow_cantilever(elements, fb.sections.SelectiveIntegration())
        tip = float(fb.simulate(model, **time).sel(output="tip_Y")[-1])
        estimate = fb.discretization_error(model, **time).sel(output="tip_Y").isel(time=-1)
        assert float(estimate["mesh_error"]) == pytest.approx(abs(tip - exact), rel=0.05)
        assert float(estimate["step_error"]) < 0.02 * float(estimate["mesh_error"])


def test_errors_of_the_mesh_of_default_elements_have_order_four():
    def falling_cable(elements):
        cable = fb.Cable(length=1.0, elements=elements, **ROPE)
        return fb.Mechanism(
            bodies={"c": cable},
            joints={"pin": fb.Revolute("c.start", (0.0, 0.0))},
            loads={"gravity": fb.Gravity()},
            sensors={"U": fb.ElasticEnergy()},
        )

    mesh_errors = [
        fb.discretization_error(falling_cable(n), duration=0.3, step=1e-3).attrs[
            "relative_mesh_error"
        ]
        for n in (16, 32)
    ]
    assert np.log2(mesh_errors[0] / mesh_errors[1]) == pytest.approx(4.0, abs=0.3)


def test_every_sample_has_its_error_and_what_rests_has_none():
    """Masses on springs, guided along X, that move as 1 + 0.2 cos ωt."""
    stiffness = np.array([1e3, 4e3, 16e3])
    model = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0, position=(1.2, 0.0))},
        joints={"guide": fb.Slot("m", (0.0, 0.0))},
        loads={"k": fb.Spring("m", (0.0, 0.0), stiffness, 1.0)},
        sensors={"r": fb.Position("m")},
    )
    time = {"duration": 0.4, "step": 1e-3}
    motion = fb.simulate(model, **time)
    errors = fb.discretization_error(model, **time)
    assert errors["error"].dims == motion.dims == ("sample", "output", "time")
    assert errors["error"].coords.identical(motion.coords)
    exact = 1 + 0.2 * np.cos(np.sqrt(stiffness)[:, None] * motion.time.values)
    true = motion.sel(output="r_X") - exact
    position_errors = errors.sel(output="r_X")
    for k in range(3):
        np.testing.assert_allclose(
            position_errors["error"][k], window_rms(true[k].values, 10), rtol=0.1
        )
    relative = np.sqrt((true**2).mean("time")) / motion.sel(output="r_X").std("time")
    np.testing.assert_allclose(position_errors["relative_error"], relative, rtol=0.05)
    assert errors["relative_error"].sel(output="r_Y").max() < 1e-9
    assert errors.attrs["worst_output"] == "r_X"
    assert errors.attrs["relative_error"] == float(errors["relative_error"].max())
    assert errors.attrs["window"] == pytest.approx(0.02)


def test_a_sample_that_was_completed_with_half_the_step_is_compared_with_a_quarter():
    speeds = np.array([0.1, 7.5, 0.2])
    motion = fb.simulate(hardening_spring(speeds), duration=0.2, step=0.02)
    assert motion.attrs["halved_step"] == [1]
    step_errors = fb.discretization_error(hardening_spring(speeds), duration=0.2, step=0.02)[
        "step_error"
    ]
    single_run = fb.discretization_error(hardening_spring(7.5), duration=0.2, step=0.02)[
        "step_error"
    ]
    exact = fb.discretization_error(hardening_spring(7.5), duration=0.2, step=0.01)["step_error"]
    np.testing.assert_array_equal(step_errors[1], single_run)
    assert float(single_run.max()) == pytest.approx(float(exact.max()), rel=0.5)


def test_rounding_of_a_body_that_does_not_turn_is_no_error():
    model = replace(parallelogram(2), sensors={"turn": fb.Angle("coupler")})
    errors = fb.discretization_error(model, duration=0.1, step=1e-3)
    assert errors["error"].max() < 1e-12
    assert errors.attrs["relative_error"] < 1e-6


def test_only_the_motion_itself_warns():
    wheel = fb.RigidBody(mass=1.0, inertia=0.5, rate=900.0)
    pin = {"pin": fb.Revolute("wheel", (0.0, 0.0))}
    model = fb.Mechanism(bodies={"wheel": wheel}, joints=pin, sensors={"a": fb.Angle("wheel")})
    with pytest.warns(fb.errors.FlexbandWarning, match="rad per step") as records:
        errors = fb.discretization_error(model, duration=0.02, step=1e-3)
    assert len(records) == 1
    assert errors.attrs["relative_error"] > 0.05
    sensorless = fb.Mechanism(bodies={"wheel": replace(wheel, rate=1.0)}, joints=pin)
    with pytest.raises(fb.errors.InputError, match="no sensors"):
        fb.discretization_error(sensorless, duration=0.02, step=1e-3)
