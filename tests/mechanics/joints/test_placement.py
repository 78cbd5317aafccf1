"""The start: angles that the user gave are kept where joints can be met by moving bodies alone."""

import numpy as np
import pytest

import flexband as fb


def bar(length, angle, **start):
    return fb.RigidBody.bar(
        length=length, height=0.02, width=0.02, density=1000.0, angle=angle, **start
    )


def at_start(**parts):
    """The outputs at time zero, name -> value(s)."""
    motion = fb.simulate(fb.Mechanism(**parts), duration=1e-3, step=1e-3)
    return dict(motion.isel(time=0).transpose("output", ...).to_pandas().T)


BODIES = {
    "bar": bar(0.5, 0.3, start=(0.02, 0.0)),
    "beam": fb.Beam(length=0.5, height=0.02, width=0.02, density=1000.0, youngs_modulus=1e9,
                    poissons_ratio=0.3, elements=4, angle=0.3, start=(0.02, 0.0)),
    "cable": fb.Cable(length=0.5, mass_per_length=1.0, axial_stiffness=1e5, bending_stiffness=1.0,
                      elements=4, angle=0.3, start=(0.0, 1.0)),
}  # fmt: skip


@pytest.mark.parametrize("kind", BODIES)
def test_a_body_beside_its_pin_keeps_its_angle(kind):
    outputs = at_start(
        bodies={"a": BODIES[kind], "b": bar(0.4, -2.0)},
        joints={"A": fb.Revolute("a.start", (0.1, 0.2)), "B": fb.Revolute("b.end", "a.end")},
        sensors={"a": fb.Angle("a.start"), "b": fb.Angle("b"), "end": fb.Position("b.end")},
    )
    assert [outputs["a"], outputs["b"]] == pytest.approx([0.3, -2.0], abs=1e-12)
    exact = [0.1 + 0.5 * np.cos(0.3), 0.2 + 0.5 * np.sin(0.3)]
    assert [outputs["end_X"], outputs["end_Y"]] == pytest.approx(exact, abs=1e-12)


def slider_crank(crank, rod, **sensors):
    """At given angles, with all places unknown."""
    return {
        "bodies": {"a": bar(0.2, crank), "b": bar(0.45, rod),
                   "s": fb.RigidBody(mass=1.0, inertia=1.0)},
        "joints": {"A": fb.Revolute("a.start", (0.0, 0.0)), "B": fb.Revolute("b.start", "a.end"),
                   "C": fb.Revolute("s", "b.end"), "g": fb.Prismatic("s", (0.0, 0.0)),
                   "d": fb.Distance("s", "p", 0.3), "o": fb.Slot("p", (0.0, 0.2))},
        "sensors": {"a": fb.Angle("a"), "b": fb.Angle("b"), "s": fb.Position("s")} | sensors,
    }  # fmt: skip


def test_angles_of_a_loop_that_closes_are_kept():
    crank = np.array([0.5, 2.0, -1.0])
    rod = -np.arcsin(0.2 * np.sin(crank) / 0.45)
    parts = slider_crank(crank, rod)
    parts["bodies"]["p"] = fb.PointMass(mass=1.0, position=(1.0, 0.7))
    outputs = at_start(**parts)
    np.testing.assert_allclose([outputs["a"], outputs["b"]], [crank, rod], atol=1e-9)
    np.testing.assert_allclose(outputs["s_X"], 0.2 * np.cos(crank) + 0.45 * np.cos(rod), atol=1e-9)


@pytest.mark.filterwarnings("ignore::flexband.errors.FlexbandWarning")
def test_what_hangs_on_a_loop_that_does_not_close_keeps_its_angle():
    """Crank and rod share the turn that closes the loop; the bar at their pin only moves."""
    parts = slider_crank(0.5, 0.0, h=fb.Angle("h"))
    parts["bodies"] |= {"p": fb.PointMass(mass=1.0, position=(1.0, 0.4)), "h": bar(0.3, -1.0)}
    parts["joints"]["H"] = fb.Revolute("h.end", "b.start")
    outputs = at_start(**parts)
    assert 0.2 * np.sin(outputs["a"]) + 0.45 * np.sin(outputs["b"]) == pytest.approx(0.0, abs=1e-9)
    assert 0.4 < outputs["a"] < 0.5
    assert outputs["h"] == pytest.approx(-1.0, abs=1e-4)


def test_gears_keep_their_angles_where_the_centres_were_given_roughly():
    outputs = at_start(
        bodies={"1": fb.RigidBody(mass=1.0, inertia=1.0, angle=0.2),
                "2": fb.RigidBody(mass=1.0, inertia=1.0, angle=-0.7, position=(0.3, 0.1))},
        joints={"A": fb.Revolute("1", (0.0, 0.0)), "B": fb.Revolute("2", (0.3, 0.0)),
                "mesh": fb.Gear("1", "2", 0.1, 0.2)},
        sensors={"1": fb.Angle("1"), "2": fb.Angle("2")},
    )  # fmt: skip
    assert [outputs["1"], outputs["2"]] == pytest.approx([0.2, -0.7], abs=1e-12)


@pytest.mark.filterwarnings("ignore::flexband.errors.FlexbandWarning")
def test_a_crank_that_is_slightly_too_long_moves_to_the_nearest_place():
    """A flat parallelogram whose crank is 1 mm too long opens by as little as the loop asks for."""
    ground = (1.0, 0.0)
    outputs = at_start(
        bodies={"a": bar(0.401, 0.0), "b": bar(1.0, 0.0, start=(0.4, 0.0)),
                "c": bar(0.4, 0.01, start=ground)},
        joints={"A": fb.Revolute("a.start", (0.0, 0.0)), "B": fb.Revolute("b.start", "a.end"),
                "C": fb.Revolute("b.end", "c.end"), "D": fb.Revolute("c.start", ground)},
        sensors={name: fb.Angle(name) for name in "abc"},
    )  # fmt: skip
    assert max(abs(outputs["a"]), abs(outputs["b"]), abs(outputs["c"] - 0.01)) < 0.08
