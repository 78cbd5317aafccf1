"""Force laws: an error stays in its sample, and compiled code is never out of date."""

import re

import numpy as np
import pytest
from numba import njit

import flexband as fb
from flexband.mechanics.assembly.system import assemble
from flexband.mechanics.engine.batch import run_samples
from flexband.mechanics.loads import compiled_laws
from flexband.mechanics.loads.compiled_laws import compiled_law
from flexband.mechanics.loads.law_shape import LawShape

FORCES = np.arange(20.0)
BAD = 3
factor = 2.0
table = np.ones(3)


def mass_with_law(law, forces=FORCES):
    """A mass of 1 kg that a law pushes with the force p[0]."""
    push = fb.ForceLaw(["m"], law, (forces,))
    return fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0)},
        loads={"push": push},
        sensors={"x": fb.Position("m"), "a": fb.Acceleration("m")},
    )


def raises(t, x, v, p, force):
    force[0, 0] = p[0]
    if p[0] == BAD and t > 0.5:
        raise ValueError("too late")


def out_of_range(t, x, v, p, force):
    force[0, 0] = p[0]
    if p[0] == BAD:
        force[int(1e6 * t), 0] = 1.0


def not_a_number(t, x, v, p, force):
    force[0, 0] = p[0]
    if p[0] == BAD and t > 0.5:
        force[0, 1] = np.sqrt(-t)


def infinite(t, x, v, p, force):
    force[0, 0] = p[0]
    if p[0] == BAD:
        force[0, 1] = 1.0 / (t - t)


@njit
def entry_of(values, k):
    return values[k]


def out_of_range_below(t, x, v, p, force):
    force[0, 0] = p[0]
    if p[0] == BAD:
        force[0, 1] = entry_of(p, 10 + int(1e5 * t))


FAILURES = [
    (raises, 0.5, "raised ValueError: too late"),
    (out_of_range, 0.0, "raised IndexError: index "),
    (out_of_range_below, 0.0, "raised IndexError: index "),
    (not_a_number, 0.5, "is not finite"),
    (infinite, 0.0, "is not finite"),
]


@pytest.mark.parametrize(("law", "time", "reason"), FAILURES)
def test_a_law_that_fails_fails_its_sample_with_the_reason(law, time, reason):
    entry_of(np.ones(1), 0)  # compiled before, without checks
    with pytest.raises((fb.errors.AssemblyError, fb.errors.SimulationError)) as error:
        fb.simulate(mass_with_law(law), duration=1.0, step=0.01)
    assert set(error.value.failures) == {BAD}
    failure_time, text = error.value.failures[BAD]
    assert failure_time == pytest.approx(time, abs=0.011)
    assert text.startswith(f"the law of load 'push' {reason}")


def test_the_neighbours_of_a_sample_that_fails_are_right():
    times = np.linspace(0.0, 1.0, 101)
    batch = run_samples(assemble(mass_with_law(raises)), times, fb.GeneralizedAlpha())
    neighbours = np.delete(np.arange(20), BAD)
    exact = 0.5 * FORCES[neighbours, None] * times**2
    np.testing.assert_allclose(batch.outputs[neighbours, 0], exact, rtol=0, atol=1e-11)
    assert not batch.failures[neighbours, 0].any()


@pytest.mark.parametrize(
    "solve",
    [
        fb.equilibrium,
        fb.describe,
        lambda mechanism: fb.modes(mechanism, 1, about="start"),
    ],
)
def test_every_solver_reports_a_law_that_fails(solve):
    forces = np.where(FORCES == BAD, FORCES, 0.0)[: BAD + 1]
    with pytest.raises(
        fb.errors.AssemblyError, match=r"sample 3.*the law of load 'push' is not finite"
    ):
        solve(mass_with_law(infinite, forces))


def returns_a_number(t, x, v, p, force):
    return p[0]


def complex_force(t, x, v, p, force):
    force[0, 0] = 1j * p[0]


@njit
def endless(n):
    return 0.0 if n < 0.0 else endless(n + 1.0)


def calls_itself(t, x, v, p, force):
    force[0, 0] = endless(p[0])


@pytest.mark.parametrize(
    ("law", "message"),
    [
        (returns_a_number, "must fill `force` and return nothing; it returns float64"),
        (complex_force, "does not compile"),
        (calls_itself, "must not call itself"),
        (print, "does not compile: it is not a Python function"),
        (lambda t: None, "does not compile"),
        ("law", "must be a function"),
    ],
)
def test_a_law_that_cannot_run_is_refused(law, message):
    with pytest.raises(fb.errors.InputError, match=re.escape(message)):
        fb.ForceLaw(["m"], law, (1.0,))


def scaled_force(t, x, v, p, force):
    force[0, 0] = factor * table[1] * p[0]


def test_a_law_whose_globals_change_is_compiled_anew(monkeypatch):
    mechanism = mass_with_law(scaled_force, 1.0)

    def force():
        return float(fb.simulate(mechanism, duration=0.1, step=0.1).sel(output="a_X")[-1])

    assert force() == pytest.approx(2.0, abs=1e-12)
    monkeypatch.setitem(globals(), "factor", 3.0)
    assert force() == pytest.approx(3.0, abs=1e-12)
    monkeypatch.setitem(globals(), "table", np.array([0.0, 5.0]))
    assert force() == pytest.approx(15.0, abs=1e-12)
    table[1] = 7.0
    assert force() == pytest.approx(21.0, abs=1e-12)


def test_the_same_law_made_again_is_compiled_once():
    def build_law(size):
        def law(t, x, v, p, force):
            force[0, 0] = size

        return law

    count = len(compiled_laws._laws)
    first = compiled_law(build_law(1.0), LawShape(1, 0))
    for _ in range(50):
        assert compiled_law(build_law(1.0), LawShape(1, 0)) is first
    assert len(compiled_laws._laws) == count + 1
    assert compiled_law(build_law(2.0), LawShape(1, 0)) is not first


def test_many_laws_are_warned_of():
    count = len(compiled_laws._laws) + 1
    with pytest.warns(fb.errors.FlexbandWarning, match="should be parameters of a ForceLaw"):
        compiled_law(lambda t, x, v, p, force: None, LawShape(2, 0), many=count)


def fills_its_gap(t, x, v, p, force, mode, gap):
    gap[0] = p[0] - t


def leaves_its_gap(t, x, v, p, force, mode, gap):
    force[0, 0] = mode[0]


def test_gap_that_a_law_leaves_is_zero():
    """Laws share the memory that they fill: one that left its gap took that of the law before."""
    loads = {
        "a": fb.ForceLaw(["m"], fills_its_gap, (0.5,), events=["time"]),
        "b": fb.ForceLaw(["m"], leaves_its_gap, events=["none"]),
    }
    mechanism = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0)}, loads=loads, sensors={"a": fb.Acceleration("m")}
    )
    motion = fb.simulate(mechanism, duration=1.0, step=0.1).sel(output="a_X")
    assert np.ptp(motion.values) == 0.0
