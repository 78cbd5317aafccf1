"""Warnings of members that are strained beyond linear elasticity."""

import warnings

import numpy as np
import pytest

import flexband as fb
from flexband.errors import StrainWarning
from flexband.mechanics.assembly.structure import KEPT
from flexband.mechanics.engine.straining import kept_steps

LENGTH = 0.5
HEIGHT = 0.02
MODULUS = 1e7
AREA = HEIGHT**2
SECOND = HEIGHT**4 / 12


def cantilever(loads, **changes):
    properties = {"length": LENGTH, "height": HEIGHT, "width": HEIGHT, "density": 1000.0,
           "youngs_modulus": MODULUS, "poissons_ratio": 0.4, "elements": 4,
           "retardation_time": 1e-2}  # fmt: skip
    return fb.Mechanism(
        bodies={"b": fb.Beam(**(properties | changes))},
        joints={"clamp": fb.Weld("b.start", (0.0, 0.0))},
        loads=loads,
        sensors={"end": fb.Position("b.end")},
    )


def strain_warnings(compute):
    with warnings.catch_warnings(record=True) as records:
        warnings.simplefilter("always")
        compute()
    return [str(w.message) for w in records if w.category is StrainWarning]


def tension_bar(strain, **changes):
    return cantilever({"F": fb.Force("b.end", x=MODULUS * AREA * np.asarray(strain))}, **changes)


def test_a_member_that_is_stretched_at_rest_is_warned_of():
    assert strain_warnings(lambda: fb.equilibrium(tension_bar(0.08))) == []
    (text,) = strain_warnings(lambda: fb.equilibrium(tension_bar(0.25)))
    assert text.startswith("'b' is stretched by 25 %, beyond linear elasticity, whose strains")
    (text,) = strain_warnings(lambda: fb.equilibrium(tension_bar(np.array([0.05, 0.2, 0.15]))))
    assert text.startswith("in sample 1, 'b' is stretched by 20 %, ")


def test_a_member_whose_surface_is_strained_by_bending_is_warned_of():
    def bending_bar(strain, **changes):
        moment = MODULUS * SECOND * strain / (HEIGHT / 2)
        return cantilever({"M": fb.Moment("b.end", moment)}, elements=16, **changes)

    assert strain_warnings(lambda: fb.equilibrium(bending_bar(0.08), steps=20)) == []
    (text,) = strain_warnings(lambda: fb.equilibrium(bending_bar(0.12), steps=20))
    assert text.startswith("'b' is bent so much that its surface is strained by 12 %, ")
    arc = cantilever({}, elements=16, curvature=0.2 / (HEIGHT / 2))
    assert strain_warnings(lambda: fb.equilibrium(arc)) == []
    assert strain_warnings(lambda: fb.simulate(arc, duration=0.01, step=1e-3)) == []


def test_the_largest_strain_of_a_motion_is_told_with_its_time():
    def ramp(t):
        return MODULUS * AREA * 0.3 * t

    mechanism = cantilever({"F": fb.Force("b.end", x=ramp)})
    (text,) = strain_warnings(lambda: fb.simulate(mechanism, duration=1.0, step=5e-3))
    strain = float(text.split()[4])
    time = float(text.split()[10])
    assert time == pytest.approx(1.0, abs=0.05)
    assert strain == pytest.approx(30 * time, abs=1.5)
    assert strain_warnings(lambda: fb.simulate(mechanism, duration=0.3, step=5e-3)) == []


def test_a_four_bar_that_cannot_be_closed_stretches_its_coupler():
    def crank_angle(t):
        return np.pi / 3 + 0.6 * np.pi * t

    steel = {"height": 0.012, "width": 0.01, "density": 7800.0}
    mechanism = fb.Mechanism(
        bodies={
            "crank": fb.RigidBody.bar(length=0.22, angle=crank_angle(0.0), **steel),
            "coupler": fb.Beam(length=0.3, height=0.006, width=0.01, density=1140.0, elements=4,
                               youngs_modulus=1e8, poissons_ratio=0.39, retardation_time=5e-4,
                               start=(0.11, 0.19), angle=0.0),
            "rocker": fb.RigidBody.bar(length=0.2, start=(0.32, 0.0), angle=1.1, **steel),
        },
        joints={
            "A": fb.Revolute("crank.start", (0.0, 0.0)),
            "B": fb.Revolute("coupler.start", "crank.end"),
            "C": fb.Revolute("coupler.end", "rocker.end"),
            "D": fb.Revolute("rocker.start", (0.32, 0.0)),
            "motor": fb.PrescribedRotation("crank", crank_angle),
        },
        sensors={"bend": fb.Deflection("coupler")},
    )  # fmt: skip
    (text,) = strain_warnings(lambda: fb.simulate(mechanism, duration=3.5, step=2e-3))
    assert text.startswith("'coupler' is stretched by 13 % at about t = 1.")


def test_a_study_tells_it_once():
    def builder(strain):
        return tension_bar(strain)

    response = fb.static_response(builder)
    inputs = {"strain": fb.Uniform(0.15, 0.25)}
    method = fb.MonteCarlo(30, 2)
    assert len(strain_warnings(lambda: fb.propagate(response, inputs, method, batch=8))) == 1


def test_new_runs_that_verify_a_study_do_not_tell_it_again():
    def builder(strain):
        return tension_bar(strain)

    response = fb.static_response(builder)
    inputs = {"strain": fb.Interval(0.15, 0.25)}
    expansions = []
    assert (
        len(strain_warnings(lambda: expansions.append(fb.expand(response, inputs, fb.PCCI(1, 3)))))
        == 1
    )
    assert strain_warnings(lambda: fb.verify(expansions[0], response, runs=4).verification) == []


def test_states_are_kept_at_scattered_steps_of_a_run():
    for steps in (1, 5, KEPT, 500, 123457):
        at = kept_steps(steps)
        assert at.min() >= 1
        assert at.max() <= steps
        assert np.all(np.diff(at) >= 0)
        assert np.diff(at).max() <= 2 * steps / KEPT + 1
