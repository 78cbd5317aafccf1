"""Friction that cannot be is refused by name, with the value."""

import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import flexband as fb
from flexband.contact import Brake, CircleOnLine, Contact, Coulomb, KeepsRestitution, Stop

LAW = KeepsRestitution(stiffness=1e8)
ORIGIN = (0.0, 0.0)


def revolute(friction):
    return fb.Revolute("a", "b", friction=friction, radius=0.1)


def prismatic(friction):
    return fb.Prismatic("a", "b", friction=friction, length=0.1)


def slot(friction):
    return fb.Slot("a", "b", friction=friction)


def brake(friction):
    return Brake("a", "b", friction=friction, radius=0.1, force=1.0)


def floor_contact(friction):
    return Contact("a", "b", CircleOnLine(), LAW, friction=friction)


def stop(friction):
    return Stop("a", "b", LAW, upper=1.0, friction=friction)


PARTS = [revolute, prismatic, slot, brake, floor_contact, stop]
NAMES = {revolute: "Revolute", prismatic: "Prismatic", slot: "Slot", brake: "Brake",
         floor_contact: "Contact", stop: "Stop"}  # fmt: skip

negative = st.floats(-1e6, -1e-9) | st.just(-np.inf)
positive = st.floats(1e-6, 1e3)
invalid_numbers = negative | st.sampled_from([np.nan, np.inf])


def assert_refusal(make, *words):
    with pytest.raises(fb.errors.InputError) as error:
        make()
    for word in words:
        assert word in str(error.value)


@given(mu=invalid_numbers)
@settings(max_examples=20, deadline=None)
@pytest.mark.parametrize("part", PARTS)
def test_a_coefficient_that_is_no_number_from_0_on(part, mu):
    assert_refusal(lambda: part(mu), f"{NAMES[part]} friction", f"{mu:g}"[:4])


@given(mu=invalid_numbers, coefficient=positive)
@settings(max_examples=30, deadline=None)
def test_numbers_of_the_law_that_are_out_of_their_range(mu, coefficient):
    assert_refusal(lambda: Coulomb(kinetic=mu), "Coulomb kinetic", f"{mu:g}"[:4])
    assert_refusal(lambda: Coulomb(kinetic=coefficient, static=mu), "Coulomb static", f"{mu:g}"[:4])
    assert_refusal(
        lambda: Coulomb(kinetic=coefficient, viscous=mu), "Coulomb viscous", f"{mu:g}"[:4]
    )
    assert_refusal(
        lambda: Coulomb(kinetic=coefficient, stribeck_speed=mu), "Coulomb stribeck", f"{mu:g}"[:4]
    )


@given(kinetic=st.floats(0.01, 10.0), share=st.floats(0.0, 0.999))
@settings(max_examples=30, deadline=None)
def test_a_static_coefficient_below_the_kinetic_one(kinetic, share):
    static = share * kinetic
    assert_refusal(lambda: Coulomb(kinetic=kinetic, static=static), "Coulomb static", str(static))


@given(kinetic=positive, rise=st.floats(0.0, 10.0), speed=positive, viscous=st.floats(0.0, 1e3))
@settings(max_examples=30, deadline=None)
def test_what_is_in_range_is_taken_by_all_parts(kinetic, rise, speed, viscous):
    law = Coulomb(kinetic=kinetic, static=kinetic + rise, stribeck_speed=speed, viscous=viscous)
    for part in PARTS:
        assert part(law).friction is law
        assert part(kinetic).friction == kinetic


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: fb.Revolute("a", "b", friction=0.1), "Revolute radius [m], with friction, must"),
        (lambda: fb.Revolute("a", "b", friction=0.1, radius=0.0), "must be positive; got 0"),
        (lambda: fb.Revolute("a", "b", friction=0.1, radius=-0.2), "Revolute radius [m] must be"),
        (lambda: fb.Prismatic("a", "b", friction=0.1), "Prismatic with friction needs"),
        (lambda: fb.Prismatic("a", "b", friction=0.1, length=0.0), "length [m] must be positive"),
        (lambda: Coulomb(kinetic=0.1, stribeck_speed=0.0), "stribeck_speed [m/s] must be positive"),
        (
            lambda: Brake("a", "b", friction=0.1, radius=0.0, force=1.0),
            "Brake radius [m] must be p",
        ),
        (
            lambda: Brake("a", "b", friction=0.1, radius=0.1, force=-1.0),
            "force [N] must be zero or",
        ),
        (lambda: revolute("rough"), "Revolute friction must be"),
        (
            lambda: Coulomb(kinetic=np.array([0.1, -0.1])),
            "Coulomb kinetic must be zero or positive",
        ),
        (
            lambda: Coulomb(kinetic=np.array([0.1, 0.3]), static=np.array([0.2, 0.2])),
            "static must be at least kinetic",
        ),
        (
            lambda: Coulomb(kinetic=np.array([0.1, 0.1]), static=np.array([0.2, 0.2, 0.2])),
            "Coulomb",
        ),
    ],
)
def test_bad_parts(make, message):
    with pytest.raises(fb.errors.InputError, match=re.escape(message)):
        make()


def test_a_sensor_of_friction_names_a_part_that_has_some():
    body = {"m": fb.RigidBody(mass=1.0, inertia=1.0)}
    smooth = fb.Slot("m", ORIGIN)
    for name in ("guide", "nothing"):
        with pytest.raises(fb.errors.InputError, match=name):
            fb.Mechanism(
                bodies=body,
                joints={"guide": smooth},
                sensors={"F": fb.contact.FrictionForce(name)},
            )
