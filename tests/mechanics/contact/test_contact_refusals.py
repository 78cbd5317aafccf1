"""Contacts that cannot be are refused by name."""

import re

import numpy as np
import pytest

import flexband as fb
from flexband import contact

LAW = contact.KeepsRestitution(stiffness=1e8)


@pytest.mark.parametrize("law", [contact.KeepsRestitution, contact.HuntCrossley, contact.Flores])
@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"stiffness": -1.0}, "stiffness must be positive; got -1"),
        ({"stiffness": np.array([1.0, 0.0])}, "stiffness must be positive"),
        ({"stiffness": 1.0, "restitution": -0.1}, "restitution must be zero or positive"),
        ({"stiffness": 1.0, "exponent": 0.5}, "exponent must be 1 or more; got 0.5"),
        ({"stiffness": 1.0, "least_speed": 0.0}, "least_speed must be positive"),
    ],
)
def test_bad_laws(law, options, message):
    with pytest.raises(fb.errors.InputError, match=re.escape(f"{law.__name__} {message}")):
        law(**options)


@pytest.mark.parametrize(
    ("law", "lower_limit"),
    [(contact.KeepsRestitution, "0.01"), (contact.HuntCrossley, "0"), (contact.Flores, "0.01")],
)
def test_restitutions_above_one(law, lower_limit):
    message = f"{law.__name__} restitution must be from {lower_limit} to 1; got 1.1"
    with pytest.raises(fb.errors.InputError, match=re.escape(message)):
        law(stiffness=1.0, restitution=np.array([0.5, 1.1]))


@pytest.mark.parametrize("law", [contact.KeepsRestitution, contact.Flores])
def test_restitutions_that_need_endless_damping(law):
    with pytest.raises(fb.errors.InputError, match=r"must be from 0\.01 to 1; got 0"):
        law(stiffness=1.0, restitution=0.0)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: contact.CircleInCircle(radii=(0.2, 0.1)), "of a circle and of a larger hole"),
        (lambda: contact.CircleInCircle(radii=(0.1, 0.1)), "of a circle and of a larger hole"),
        (lambda: contact.CircleInCircle(radii=(-0.1, 0.1)), "radii [m] must be positive"),
        (lambda: contact.CircleOnCircle(radii=(0.0, 0.0)), "must not both be 0"),
        (lambda: contact.CircleOnLine(radius=-1.0), "radius [m] must be zero or positive"),
        (lambda: contact.CircleOnLine(normal=(0.0, 0.0)), "normal must have a length"),
        (lambda: contact.CircleOnLine(ends=(1.0, 0.0)), "ends [m] must increase"),
        (lambda: contact.Stop("a.p", "a.q", LAW, upper=1.0), "are both of body 'a'"),
        (lambda: contact.Stop((0.0, 0.0), (1.0, 0.0), LAW, upper=1.0), "are both of the ground"),
        (lambda: contact.Stop("a", "b", LAW), "needs finite limits"),
        (lambda: contact.Stop("a", "b", LAW, lower=1.0, upper=0.0), "must be below the upper"),
        (lambda: contact.AngularStop("a", "b", LAW, lower=np.nan), "lower must be finite numbers"),
        (lambda: contact.AngularStop("a", "b", 1e5, upper=1.0), "law must be a normal law"),
        (lambda: fb.Revolute("a", "b", clearance=0.0, law=LAW), "clearance [m] must be positive"),
        (lambda: fb.Revolute("a", "b", clearance=-1e-3, law=LAW), "clearance [m] must be positi"),
        (lambda: fb.Revolute("a", "b", clearance=1e-3), "needs both of clearance and law"),
        (lambda: fb.Revolute("a", "b", law=LAW), "needs both of clearance and law"),
        (lambda: fb.Prismatic("a", "b", clearance=1e-3, law=LAW), "both of clearance and length"),
    ],
)
def test_bad_parts(make, message):
    with pytest.raises(fb.errors.InputError, match=re.escape(message)):
        make()


def test_bodies_that_overlap_at_the_start_are_refused_with_their_depth():
    heights = np.array([0.1, -0.02])
    model = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0, position=(0.0, heights))},
        loads={"floor": contact.Contact("m", (0.0, 0.0), contact.CircleOnLine(), LAW)},
        sensors={"x": fb.Position("m")},
    )
    with pytest.raises(
        fb.errors.RunError, match=r"sample 1, .*contact 'floor' is closed at the start, by 0\.02"
    ):
        fb.simulate(model, duration=0.1, step=0.01)


def test_a_part_without_contacts_has_no_gap():
    with pytest.raises(fb.errors.InputError, match="part with contacts 'k' is not in the mech"):
        fb.Mechanism(
            bodies={"m": fb.PointMass(mass=1.0)},
            loads={"k": fb.Gravity()},
            sensors={"gap": contact.Gap("k")},
        )


class OwnLine(contact.Geometry):
    """A line along a body, written by a user."""

    kernel = contact.CircleOnLine.kernel
    parameters = contact.CircleOnLine().parameters


@pytest.mark.parametrize("geometry", [contact.CircleOnLine(), OwnLine()])
def test_a_line_on_a_flexible_member_is_refused(geometry):
    beam = fb.Beam(
        length=1.0, height=0.01, width=0.01, density=7800.0, youngs_modulus=2e11,
        poissons_ratio=0.3, elements=2,
    )  # fmt: skip
    model = {
        "bodies": {"beam": beam, "ball": fb.PointMass(mass=1.0, position=(0.5, 0.1))},
        "loads": {"k": contact.Contact("ball", "beam.end", geometry, LAW)},
        "sensors": {"x": fb.Position("ball")},
    }
    name = type(geometry).__name__
    with pytest.raises(fb.errors.InputError, match=f"the line of a Contact of a {name} does not"):
        fb.simulate(fb.Mechanism(**model), duration=0.01, step=0.01)
    circles = contact.CircleOnCircle(radii=(0.01, 0.01))
    on_a_circle = contact.Contact("ball", "beam.end", circles, LAW)
    fb.simulate(fb.Mechanism(**model | {"loads": {"k": on_a_circle}}), duration=0.01, step=0.01)
