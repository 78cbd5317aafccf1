"""What assembly changes in the given start is reported, and large changes are warned of."""

import numpy as np
import pytest

import flexband as fb
from flexband.mechanics.assembly.packing import AT_START, pack
from flexband.mechanics.assembly.system import assemble
from flexband.mechanics.engine.batch import begin
from flexband.mechanics.engine.corrections import Corrections, corrections, report


def bar(length, angle, **start):
    return fb.RigidBody.bar(
        length=length, height=0.02, width=0.02, density=1000.0, angle=angle, **start
    )


def dyad(first, second):
    """Two bars of 1 m and 0.7 m from pins that are 1.2 m apart to a common pin."""
    return fb.Mechanism(
        bodies={"a": bar(1.0, first), "b": bar(0.7, second, start=(1.2, 0.0))},
        joints={"A": fb.Revolute("a.start", (0.0, 0.0)), "B": fb.Revolute("b.start", (1.2, 0.0)),
                "C": fb.Revolute("a.end", "b.end")},
        sensors={"a": fb.Angle("a"), "b": fb.Angle("b")},
    )  # fmt: skip


ANGLE = np.arccos((1.0 + 1.2**2 - 0.7**2) / (2 * 1.2))
SECOND_ANGLE = np.pi - np.arcsin(np.sin(ANGLE) / 0.7)
"""The angles at which both bars meet above their pins."""


def analyses(model):
    """The results of both analyses."""
    return fb.simulate(model, duration=1e-3, step=1e-3), fb.equilibrium(model)


def test_a_start_that_fits_needs_no_report():
    for result in analyses(dyad(ANGLE, SECOND_ANGLE)):
        assert not result.attrs.keys() & {"assembly", "largest_turn", "largest_move"}


def test_small_changes_are_reported_and_large_ones_warned_of():
    angles = ANGLE + np.array([0.0, 0.01, -0.02])
    motion = fb.simulate(dyad(angles, SECOND_ANGLE), duration=1e-3, step=1e-3)
    turns = np.abs(motion.isel(time=0) - np.stack([angles, np.full(3, SECOND_ANGLE)], axis=1))
    assert motion.attrs["largest_turn"] == pytest.approx(float(turns.max()), rel=1e-6)
    assert 0.005 < motion.attrs["largest_turn"] < 0.02 + 1e-9
    assert "assembly turned body" in motion.attrs["assembly"]
    assert "(sample 2)" in motion.attrs["assembly"]
    for analysis in (lambda m: fb.simulate(m, duration=1e-3, step=1e-3), fb.equilibrium):
        with pytest.warns(
            fb.errors.FlexbandWarning, match=r"turned body '.' by .* rad .* given angle"
        ):
            analysis(dyad(ANGLE + 0.2, SECOND_ANGLE))


def test_moves_alone_are_reported_but_not_warned_of():
    model = fb.Mechanism(
        bodies={"a": bar(0.5, 0.3, start=(0.02, 0.0))},
        joints={"A": fb.Revolute("a.start", (0.0, 0.0))},
        sensors={"angle": fb.Angle("a")},
    )
    motion = fb.simulate(model, duration=1e-3, step=1e-3)
    assert motion.attrs["largest_move"] == pytest.approx(0.02, abs=1e-12)
    assert motion.attrs["assembly"] == "assembly moved body 'a' by 0.02 m from its given place"
    assert motion.attrs["assembly"] in fb.describe(model)


def test_another_branch_is_warned_of():
    """The state in which the bars meet above their pins, if they were given below them."""
    below = assemble(dyad(-ANGLE + 0.05, -SECOND_ANGLE))
    states = [
        begin(system, pack(system, AT_START)(0))[0].z
        for system in (assemble(dyad(ANGLE, SECOND_ANGLE)), below)
    ]
    other_branch, same_branch = (corrections(below, z, np.zeros(1, dtype=int)) for z in states)
    assert other_branch.reversed.all()
    assert not same_branch.reversed.any()
    quiet = Corrections(*(np.zeros((2, 1)) for _ in range(4)), other_branch.reversed)
    with pytest.warns(fb.errors.FlexbandWarning, match="a loop closed in another branch"):
        attributes = report(below, quiet)
    assert attributes["assembly"].startswith("a loop closed in another branch")


@pytest.mark.parametrize("length", [1.0, 0.7])
def test_velocities_that_joints_forbid_are_warned_of(length):
    """A crank whose coupler was not given a velocity is slowed down by it."""
    crank = bar(0.2, 0.7, rate=10.0)
    model = fb.Mechanism(
        bodies={"crank": crank, "rod": bar(length, -0.1), "s": fb.PointMass(mass=1.0)},
        joints={"A": fb.Revolute("crank.start", (0.0, 0.0)),
                "B": fb.Revolute("rod.start", "crank.end"),
                "C": fb.Revolute("s", "rod.end")},
        sensors={"rate": fb.AngularVelocity("crank")},
    )  # fmt: skip
    with pytest.warns(fb.errors.FlexbandWarning) as records:
        motion = fb.simulate(model, duration=1e-3, step=1e-3)
    percentage = 100 * abs(motion.isel(time=0).item() - 10.0) / 10.0
    text = f"joints change the given rate of body 'crank' by {percentage:.3g} %"
    assert any(text in str(warning.message) for warning in records)
