"""Bodies that are placed in touch, exactly or within rounding, start."""

import numpy as np
import pytest

import flexband as fb
from flexband import contact


def wheel(height, radius=0.1, friction=0.5):
    """A wheel that gravity and a moment roll along a floor."""
    law = contact.KeepsRestitution(stiffness=1e7, restitution=0.5)
    floor = contact.CircleOnLine(radius=radius)
    return fb.Mechanism(
        bodies={"b": fb.RigidBody(mass=1.0, inertia=0.4 * radius**2, position=(0.0, height))},
        sensors={"p": fb.Position("b"), "w": fb.AngularVelocity("b")},
        loads={
            "g": fb.Gravity(x=2.0),
            "M": fb.Moment("b", -2.0 * radius),
            "floor": contact.Contact("b", (0.0, 0.0), floor, law, friction=friction),
        },
    )


@pytest.mark.filterwarnings("ignore:.*may miss turns")
@pytest.mark.parametrize("step", [1e-3, 0.05, 0.5])
@pytest.mark.parametrize("radius", [0.01, 0.1, 1.0])
@pytest.mark.parametrize("apart", [0.0, 1e-16, -1e-16, 3e-10, -3e-10])
def test_a_wheel_in_touch_rolls(step, radius, apart):
    """With the acceleration (2 + 2)/(1 + 0.4) m/s²."""
    model = wheel(radius * (1.0 + apart), radius)
    motion = fb.simulate(model, duration=0.5, step=step)
    x, y, rate = motion.values[:, -1]
    assert x == pytest.approx(0.5 * 4.0 / 1.4 * 0.25, rel=1e-4)
    assert rate == pytest.approx(-4.0 / 1.4 * 0.5 / radius, rel=1e-3)
    assert y == pytest.approx(radius, abs=3e-4)


@pytest.mark.parametrize("apart", [0.0, 1e-16, -1e-16, 3e-10, -3e-10])
def test_a_wheel_in_touch_slides_without_friction(apart):
    motion = fb.simulate(wheel(0.1 * (1.0 + apart), friction=None), duration=0.5, step=0.05)
    assert float(motion[0, -1]) == pytest.approx(0.25, rel=1e-9)


@pytest.mark.parametrize("apart", [0.0, 1e-12, -1e-12])
def test_a_box_on_two_corners_slides(apart):
    """With 3 − µ g m/s², and what friction misses while the corners are pressed in at first."""
    push = 3.0
    law = contact.KeepsRestitution(stiffness=1e7, restitution=0.5)
    corners = {"left": (-0.1, -0.05), "right": (0.1, -0.05)}
    model = fb.Mechanism(
        bodies={
            "box": fb.RigidBody(
                mass=1.0, inertia=0.004, position=(0.0, 0.05 + apart), points=corners
            )
        },
        loads={
            "g": fb.Gravity(x=push),
            **{
                name: contact.Contact(
                    f"box.{name}", (0.0, 0.0), contact.CircleOnLine(), law, friction=0.3
                )
                for name in corners
            },
        },
        sensors={"p": fb.Position("box")},
    )
    motion = fb.simulate(model, duration=0.4, step=0.02)
    x = 0.5 * (push - 0.3 * 9.81) * motion["time"].values ** 2
    np.testing.assert_allclose(motion.sel(output="p_X"), x, rtol=0, atol=1e-3)
