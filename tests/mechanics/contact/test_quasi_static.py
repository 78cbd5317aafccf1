"""Forces of a contact that stays closed in a slow motion, at every step of the engine."""

import numpy as np
import pytest

import flexband as fb
from flexband import contact

ANGLE = 0.35
HALF = 0.3
PLACE = HALF * np.cos(ANGLE), HALF * np.sin(ANGLE)
WEIGHT = 610.0  # about what the pin carries [N]


def lever(law, friction):
    """A beam with 30 kg at its end, whose middle rests on a pin that a drive lowers."""
    way = fb.ramp(to=-0.07, duration=0.5).integral
    return fb.Mechanism(
        bodies={
            "arm": fb.Beam(
                length=0.6, height=0.04, width=0.012, density=2700.0, youngs_modulus=70e9,
                poissons_ratio=0.33, retardation_time=5e-4, elements=4, angle=ANGLE,
            ),
            "load": fb.PointMass(mass=30.0, position=(2 * PLACE[0], 2 * PLACE[1])),
            "slide": fb.RigidBody(mass=2.0, inertia=0.01, position=PLACE),
        },
        joints={
            "foot": fb.Slot("arm.start", (0.0, 0.0)),
            "load": fb.Revolute("arm.end", "load"),
            "pin": fb.Revolute(
                "slide", "arm.0.5", clearance=5e-5, law=law, radius=0.01, friction=friction
            ),
            "guide": fb.Slot("slide", (PLACE[0], 0.0), axis=(0.0, 1.0)),
            "turn": fb.PrescribedRotation("slide", lambda t: 0.0 * t),
            "drive": fb.PrescribedTravel(
                "slide", (0.0, 0.0), lambda t: PLACE[1] - way(t), axis=(0.0, 1.0)
            ),
        },
        loads={"g": fb.Gravity()},
        sensors={
            "pin": contact.Contacts("pin", first=0),
            "F": contact.ContactForce("pin"),
            "large": fb.sensors.Largest(fb.Reaction("drive")),
            "small": fb.sensors.Smallest(fb.Reaction("drive")),
            "R": fb.Reaction("drive"),
        },
    )  # fmt: skip


@pytest.mark.parametrize("friction", [None, 0.1])
@pytest.mark.parametrize(("tolerance", "force_error"), [(1e-6, 1e-3), (1e-8, 1e-4)])
@pytest.mark.parametrize("step", [1e-4, 1e-3, 1e-2])
def test_forces_between_output_times_are_those_of_a_slow_motion(
    friction, tolerance, force_error, step
):
    """The forces rise all the time, so that the extremes are the first and the last value."""
    law = contact.KeepsRestitution(stiffness=1e9, restitution=0.5)
    motion = fb.simulate(
        lever(law, friction), duration=0.1, step=step, start="static",
        integrator=fb.GeneralizedAlpha(step_tolerance=tolerance),
    )  # fmt: skip
    F = motion.sel(output="F").values
    R = motion.sel(output="R_Y").values
    end = motion.isel(time=-1)
    assert F[0] == pytest.approx(596.63, abs=0.01)
    assert np.diff(F).min() > -force_error * WEIGHT
    for name, value in (("pin_force", F[-1]), ("large_Y", R[-1]), ("small_Y", R[0])):
        assert float(end.sel(output=name)) == pytest.approx(value, abs=force_error * WEIGHT), name
    assert 0.0 <= float(end.sel(output="pin_energy")) < 1e-6
