"""What is said where friction has no consistent motion, and where it is not to blame."""

import re

import numpy as np
import pytest

import flexband as fb
from flexband import contact


def rod(friction, angle, inertia, speed=-1.0):
    """A rod of 1 kg and 1 m, one end of which slides in a rough slot."""
    along = np.array([np.cos(angle), np.sin(angle)])
    return fb.Mechanism(
        bodies={
            "rod": fb.RigidBody(
                mass=1.0,
                inertia=inertia,
                position=tuple(0.5 * along),
                angle=angle,
                points={"tip": (-0.5, 0.0)},
                velocity=(speed, 0.0),
            )
        },
        joints={"slot": fb.Slot("rod.tip", (0.0, 0.0), friction=friction)},
        loads={"g": fb.Gravity()},
        sensors={"p": fb.Position("rod")},
    )


@pytest.mark.parametrize("angle", [0.6, 1.0, 1.3])
@pytest.mark.parametrize("kappa", [0.5, 0.9, 1.1, 3.0])
def test_a_rod_jams_from_kappa_1_on(kappa, angle):
    """With κ = µ sinθ cosθ l²/J / (1/m + l² cos²θ/J), and says so."""
    arm = 0.5
    J = 0.004
    ratio = np.sin(angle) * np.cos(angle) * arm**2 / J / (1.0 + (arm * np.cos(angle)) ** 2 / J)
    model = rod(kappa / ratio, angle, J)
    if kappa < 1.0:
        assert np.isfinite(fb.simulate(model, duration=1e-3, step=1e-3).values).all()
        return
    with pytest.raises(fb.errors.RunError, match="friction of 'slot' jams") as error:
        fb.simulate(model, duration=1e-3, step=1e-3)
    kappa_text = re.search(r"κ = ([\d.]+)", str(error.value))
    assert kappa_text
    assert float(kappa_text[1]) == pytest.approx(kappa, rel=6e-3)


def bars_in_line(**friction_parts):
    """Two bars in line between two pins, which a drive is to turn, and a wheel with friction."""
    bar = {"mass": 1.0, "inertia": 0.1, "points": {"a": (-0.5, 0.0), "b": (0.5, 0.0)}}
    return fb.Mechanism(
        bodies={
            "x": fb.RigidBody(position=(0.5, 0.0), **bar),
            "y": fb.RigidBody(position=(1.5, 0.0), **bar),
            "wheel": fb.RigidBody(mass=1.0, inertia=0.1, position=(0.0, 3.0)),
        },
        joints={
            "1": fb.Revolute("x.a", (0.0, 0.0)),
            "2": fb.Revolute("x.b", "y.a"),
            "3": fb.Revolute("y.b", (2.0, 0.0)),
            "drive": fb.PrescribedRotation("x", lambda t: 0.5 * t),
            "axle": friction_parts.get("axle", fb.Revolute("wheel", (0.0, 3.0))),
        },
        loads={
            "g": fb.Gravity(),
            **({"rough": friction_parts["load"]} if "load" in friction_parts else {}),
        },
        sensors={"p": fb.Position("x.b")},
    )


LAW = contact.KeepsRestitution(stiffness=1e6, restitution=0.5)


@pytest.mark.parametrize(
    "friction_parts",
    [
        {},
        {"axle": fb.Revolute("wheel", (0.0, 3.0), radius=0.1, friction=0.2)},
        {"load": contact.Clutch("wheel", (0.0, 3.0), 0.3, 0.1, 10.0)},
        {
            "load": contact.Contact(
                "wheel", (0.0, 2.5), contact.CircleOnLine(radius=0.4), LAW, friction=0.3
            )
        },
    ],
    ids=["smooth", "axle", "clutch", "contact"],
)
def test_friction_is_not_to_blame_for_joints_that_contradict_each_other(friction_parts):
    with pytest.raises(fb.errors.RunError, match="constraints contradict each other") as error:
        fb.simulate(bars_in_line(**friction_parts), duration=0.1, step=1e-3)
    assert "jam" not in str(error.value)


def test_a_rough_beam_between_pins_that_cannot_meet():
    beam = fb.Beam(
        length=1.0, height=0.01, width=0.01, density=7800.0, youngs_modulus=2e11,
        poissons_ratio=0.3, elements=2,
    )  # fmt: skip
    model = fb.Mechanism(
        bodies={"b": beam},
        joints={
            "p": fb.Revolute("b.start", (0.0, 0.0), radius=0.01, friction=0.2),
            "q": fb.Revolute("b.end", (0.0, 0.0)),
        },
        sensors={"end": fb.Position("b.end")},
    )
    with pytest.raises(fb.errors.AssemblyError, match="joint 'p' stays open"):
        fb.simulate(model, duration=0.1, step=1e-3)
