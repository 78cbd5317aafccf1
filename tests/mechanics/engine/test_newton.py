"""Steps that Newton's method takes at the second attempt only."""

import numpy as np
import pytest

import flexband as fb


def cantilever(elements):
    """A steel cable of 2 m, clamped, under a sudden force of 3EI/L² at its end."""
    stiffness = 2.07e11
    second = 0.1**4 / 12
    cable = fb.Cable(
        length=2.0, mass_per_length=78.0, axial_stiffness=stiffness * 0.01,
        bending_stiffness=stiffness * second, elements=elements,
    )  # fmt: skip
    return fb.Mechanism(
        bodies={"b": cable},
        joints={"A": fb.Weld("b.start", (0.0, 0.0))},
        loads={"F": fb.Force("b.end", y=-3 * stiffness * second / 2.0**2)},
        sensors={"tip": fb.Position("b.end")},
    )


@pytest.mark.parametrize(("step", "error"), [(1e-4, 2.5e-3), (4.5e-4, 2.5e-2)])
def test_a_fine_mesh_bears_a_sudden_force(step, error):
    """Against a coarser mesh with steps that are so short that the first attempt succeeds."""
    fine = fb.simulate(cantilever(64), duration=200 * step, step=step)
    assert fine.attrs["halved_step"] == [0]
    exact = fb.simulate(cantilever(16), duration=200 * step, step=step, substeps=round(step / 1e-5))
    assert "halved_step" not in exact.attrs
    assert float(exact.sel(output="tip_Y").min()) < -1.0
    np.testing.assert_allclose(fine, exact, atol=error)


def cable_on_hub(hub_mass, hub_inertia):
    """A damped cable on a hub that starts to turn at π² rad/s after 0.1 s."""
    angle = lambda t: np.pi * np.sin(np.pi * max(0.0, t - 0.1))  # noqa: E731
    cable = fb.Cable(
        length=2.0, mass_per_length=0.78, axial_stiffness=2e7, bending_stiffness=166.7,
        elements=16, retardation_time=0.02,
    )  # fmt: skip
    return fb.Mechanism(
        bodies={"hub": fb.RigidBody(mass=hub_mass, inertia=hub_inertia), "cable": cable},
        joints={
            "A": fb.Revolute("hub", (0.0, 0.0)),
            "W": fb.Weld("cable.start", "hub"),
            "D": fb.PrescribedRotation("hub", angle),
        },
        loads={"gravity": fb.Gravity()},
        sensors={"tip": fb.Position("cable.end")},
    )


@pytest.mark.filterwarnings("ignore:.*whose rate jumps")
@pytest.mark.parametrize(("step", "substeps"), [(2e-3, 1), (1e-2, 1)])
def test_a_light_hub_of_a_damped_cable_turns_as_its_drive_says(step, substeps):
    """The motion does not depend on the hub, since it is prescribed."""
    light = fb.simulate(cable_on_hub(1e-3, 1e-8), duration=0.2, step=step)
    heavy = fb.simulate(cable_on_hub(1.0, 1.0), duration=0.2, step=step, substeps=substeps)
    np.testing.assert_allclose(light, heavy, atol=1e-7)
