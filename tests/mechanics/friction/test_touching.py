"""Bodies that are placed in touch, exactly or within rounding, start."""

import dataclasses

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


@pytest.mark.parametrize("step", [1e-3, 0.05, 0.5])
@pytest.mark.parametrize("radius", [0.01, 0.1, 1.0])
@pytest.mark.parametrize("gap", [0.0, 1e-16, -1e-16, 3e-10, -3e-10])
def test_a_wheel_in_touch_rolls(step, radius, gap):
    """With the acceleration (2 + 2)/(1 + 0.4) m/s²."""
    model = wheel(radius * (1.0 + gap), radius)
    motion = fb.simulate(model, duration=0.5, step=step)
    x, y, rate = motion.values[:, -1]
    assert x == pytest.approx(0.5 * 4.0 / 1.4 * 0.25, rel=1e-4)
    assert rate == pytest.approx(-4.0 / 1.4 * 0.5 / radius, rel=1e-3)
    assert y == pytest.approx(radius, abs=3e-4)


@pytest.mark.parametrize("gap", [0.0, 1e-16, -1e-16, 3e-10, -3e-10])
def test_a_wheel_in_touch_slides_without_friction(gap):
    motion = fb.simulate(wheel(0.1 * (1.0 + gap), friction=None), duration=0.5, step=0.05)
    assert float(motion[0, -1]) == pytest.approx(0.25, rel=1e-9)


@pytest.mark.parametrize("gap", [0.0, 1e-12, -1e-12])
def test_a_box_on_two_corners_slides(gap):
    """With 3 − µ g m/s², and what friction misses while the corners are pressed in at first."""
    push = 3.0
    law = contact.KeepsRestitution(stiffness=1e7, restitution=0.5)
    corners = {"left": (-0.1, -0.05), "right": (0.1, -0.05)}
    model = fb.Mechanism(
        bodies={
            "box": fb.RigidBody(mass=1.0, inertia=0.004, position=(0.0, 0.05 + gap), points=corners)
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


def box(push, law, *, width=0.2, height=0.1, gap=0.0, friction=0.3, corners=2):
    """A box of 1 kg on rough corners in a line, with `push` as a load along the floor."""
    places = np.linspace(-0.5, 0.5, corners) * width
    points = {f"c{k}": (float(x), -0.5 * height) for k, x in enumerate(places)}
    floor = contact.CircleOnLine()
    corner_contacts = {
        name: contact.Contact(f"box.{name}", (0.1 * k, 0.0), floor, law, friction=friction)
        for k, name in enumerate(points)
    }
    inertia = (width**2 + height**2) / 12.0
    sensors = {f"N {n}": contact.ContactForce(n) for n in points}
    sensors |= {f"T {n}": contact.FrictionForce(n) for n in points}
    return fb.Mechanism(
        bodies={
            "box": fb.RigidBody(
                mass=1.0, inertia=inertia, position=(0.0, 0.5 * height + gap), points=points
            )
        },
        loads={"g": fb.Gravity(x=push), **corner_contacts},
        sensors={"p": fb.Position("box"), **sensors},
    )


@pytest.mark.parametrize("corners", [2, 3])
@pytest.mark.parametrize("gap", [0.0, 1e-12, 1e-7])
@pytest.mark.parametrize("push", [0.2, 2.8])
def test_a_box_at_rest_on_rough_corners(push, gap, corners):
    """Its corners carry the weight and the moment of the push, and friction holds the push."""
    law = contact.KeepsRestitution(stiffness=1e6, restitution=0.5, exponent=1.0)
    motion = fb.simulate(box(push, law, gap=gap, corners=corners), duration=0.4, step=0.02)
    motion = motion.isel(time=-1)
    assert abs(float(motion.sel(output="p_X"))) < 1e-4
    along, normal = (
        np.array([float(motion.sel(output=f"{a} c{k}")) for k in range(corners)]) for a in "TN"
    )
    arms = np.linspace(-0.1, 0.1, corners)
    assert along.sum() == pytest.approx(-push, rel=1e-4)
    assert normal.sum() == pytest.approx(9.81, rel=1e-5)
    assert normal @ arms == pytest.approx(0.05 * push, rel=1e-3)
    np.testing.assert_allclose(along / normal, -push / 9.81, rtol=1e-4)


@pytest.mark.parametrize(
    ("push", "options"),
    [
        (
            0.16586583,
            {"width": 0.180266, "height": 0.089737, "friction": 0.48556, "gap": 1.6e-10},
        ),
        (-2.1285671, {"width": 0.069125, "height": 0.024803, "friction": 0.48605}),
        (-1.1952388, {"width": 0.098420, "height": 0.028351, "friction": 0.23160, "gap": 1e-13}),
    ],
)
@pytest.mark.parametrize("stiffness", [1.1e5, 3e6])
@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_a_box_that_rocks_on_rough_corners_stays(push, options, stiffness, exponent):
    law = contact.KeepsRestitution(stiffness=stiffness, restitution=0.7, exponent=exponent)
    motion = fb.simulate(box(push, law, **options), duration=0.3, step=0.1)
    assert abs(float(motion.sel(output="p_X")[-1])) < 1e-2 * options["width"]


def test_a_box_starts_to_slide_where_both_corners_let_go():
    """A push that grows as 10 t holds until µ g, and then moves it as (10 t − µ g)³/600."""
    law = contact.KeepsRestitution(stiffness=1e6, restitution=0.2, exponent=1.0)
    model = box(0.0, law)
    model = dataclasses.replace(
        model, loads={**model.loads, "push": fb.Force("box", x=lambda t: 10.0 * t)}
    )
    motion = fb.simulate(model, duration=0.6, step=0.02)
    x = motion.sel(output="p_X").values
    t = motion["time"].values
    travel = np.maximum(10.0 * t - 0.3 * 9.81, 0.0) ** 3 / 600.0
    start = x[int(np.argmax(t > 0.25))]
    np.testing.assert_allclose(x - start, travel, rtol=0, atol=2e-6 + 1e-3 * travel.max())
