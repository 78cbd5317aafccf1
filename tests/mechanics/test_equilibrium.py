"""Static equilibrium against closed forms."""

import re

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

import flexband as fb
from flexband.mechanics.linearization import balance, eigenmodes
from tests.mechanics.models import pendulum


def test_hanging_chain_of_springs_in_series():
    k = np.array([100.0, 200.0, 400.0])
    m = 1.5
    model = fb.Mechanism(
        bodies={
            "a": fb.PointMass(mass=m, position=(0.0, -1.0)),
            "b": fb.PointMass(mass=m, position=(0.0, -2.0)),
        },
        loads={
            "upper": fb.Spring("a", (0.0, 0.0), k, 1.0),
            "lower": fb.Spring("b", "a", 50.0, 1.0),
            "gravity": fb.Gravity(),
        },
        sensors={"a": fb.Position("a"), "b": fb.Position("b")},
    )
    rest = fb.equilibrium(model)
    a = -1.0 - 2 * m * 9.81 / k
    np.testing.assert_allclose(rest.sel(output="a_Y"), a, rtol=1e-8)
    np.testing.assert_allclose(rest.sel(output="b_Y"), a - 1.0 - m * 9.81 / 50.0, rtol=1e-8)
    assert rest.unit.sel(output="a_Y") == "m"


def test_pendulum_comes_to_rest_below_its_pin_with_its_weight_in_the_pin():
    rest = fb.equilibrium(pendulum(-0.3))
    np.testing.assert_allclose(rest, [0.0, -1.0, 0.0, 9.81 * 0.9], atol=1e-6)


def test_a_mechanism_that_cannot_rest_is_refused():
    model = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0)}, loads={"f": fb.Force("m", x=1.0)},
        sensors={"m": fb.Position("m")},
    )  # fmt: skip
    with pytest.raises(fb.errors.AssemblyError, match="no equilibrium was found"):
        fb.equilibrium(model)


def test_bad_requests_are_refused():
    model = fb.Mechanism(bodies={"m": fb.PointMass(mass=1.0)})
    with pytest.raises(fb.errors.InputError, match="steps must be 1 or more; got 0"):
        fb.equilibrium(model, steps=0)


def mass_on_spring(spring, **parts):
    """A mass of 1 kg on a spring under gravity."""
    return fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0, **parts)},
        loads={"s": spring, "gravity": fb.Gravity()},
        sensors={"m": fb.Position("m"), "s": fb.SpringForce("s")},
    )


def test_a_spring_that_starts_without_length_is_stretched():
    """It pulls in no direction, or pushes: the mass falls until the spring carries its weight."""
    for pull, rest_length in ((5.0, 0.0), (0.0, 0.3), (9.0, 0.0)):
        rest = fb.equilibrium(
            mass_on_spring(fb.Spring("m", (0.0, 0.0), 20.0, rest_length, pull=pull))
        )
        exact = [0.0, -(9.81 - pull) / 20.0 - rest_length]
        np.testing.assert_allclose(rest[:2], exact, atol=1e-9)
        assert rest["stable"]


def test_a_spring_holds_what_is_lighter_than_its_pull_where_it_is():
    rest = fb.equilibrium(mass_on_spring(fb.Spring("m", (0.0, 0.0), 20.0, 0.0, pull=15.0)))
    np.testing.assert_allclose(rest[:2], 0.0, atol=1e-9)
    assert rest["stable"]


def test_a_mass_falls_far_onto_a_soft_spring():
    rest = fb.equilibrium(
        mass_on_spring(fb.Spring("m", (0.0, 0.0), 0.01, 1.0), position=(0.0, -1.0))
    )
    np.testing.assert_allclose(rest.sel(output="m_Y"), -982.0, rtol=1e-9)


def taut(x, y):
    """A mass between two rods on one line, which lock it to second order only."""
    return fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0)},
        joints={"a": fb.Distance("m", (-1.0, 0.0), 1.0), "b": fb.Distance("m", (1.0, 0.0), 1.0)},
        loads={"f": fb.Force("m", x=x, y=y)},
        sensors={"a": fb.Reaction("a"), "b": fb.Reaction("b")},
    )


def test_a_position_that_can_carry_no_load_is_named():
    with pytest.raises(
        fb.errors.AssemblyError, match="joint 'a' is in a position where constraints dep"
    ):
        fb.equilibrium(taut(0.0, -9.81))
    rest = fb.equilibrium(taut(2.0, 0.0))
    np.testing.assert_allclose(rest, [-1.0, 0.0, -1.0, 0.0], atol=1e-9)  # the least norm
    assert rest.attrs["not_unique"] == ["joint 'a'", "joint 'b'"]


@pytest.mark.parametrize("ratio", [1e-6, 1e-9, 1e-12])
def test_members_of_very_different_stiffness(ratio):
    """The soft one bends as if it were clamped, a = PL²/EI = 1; the stiff one stays straight."""

    def cable(part, x):
        return fb.Cable(
            length=1.0, mass_per_length=1.0, axial_stiffness=1e6 * part, bending_stiffness=part,
            elements=8, start=(x, 0.0),
        )  # fmt: skip

    def rest_under(bodies, joints, force):
        return fb.equilibrium(
            fb.Mechanism(
                bodies=bodies, joints=joints, loads={"P": fb.Force("b.end", y=-force)},
                sensors={"tip": fb.Position("b.end"), "M": fb.ReactionMoment("root")},
            )
        )  # fmt: skip

    clamped_rest = rest_under({"b": cable(1.0, 1.0)}, {"root": fb.Weld("b.start", (1.0, 0.0))}, 1.0)
    np.testing.assert_allclose(clamped_rest[:2], [2.0 - 0.0564332, -0.3017208], rtol=1.5e-3)
    bodies = {"a": cable(1.0, 0.0), "b": cable(ratio, 1.0)}
    joints = {"clamp": fb.Weld("a.start", (0.0, 0.0)), "root": fb.Weld("b.start", "a.end")}
    rest = rest_under(bodies, joints, ratio)
    np.testing.assert_allclose(rest, clamped_rest * [1.0, 1.0, ratio], rtol=10 * ratio + 1e-7)
    assert rest["stable"]


def test_huge_and_tiny_mechanisms_settle():
    size = np.array([1e-6, 1e-3, 1.0, 1e3])
    model = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=size**3, position=(0.0 * size, -size))},
        loads={"s": fb.Spring("m", (0.0, 0.0), 100.0 * size**2, size), "gravity": fb.Gravity()},
        sensors={"m": fb.Position("m")},
    )
    heights = fb.equilibrium(model).sel(output="m_Y")
    np.testing.assert_allclose(heights, -size - size * 9.81 / 100.0, rtol=1e-9)


def test_a_pendulum_upside_down_and_a_column_are_not_stable():
    """Euler's load of a clamped column, π²EI/4L², is 2.467."""
    pendulums = pendulum(np.array([-np.pi / 2, np.pi / 2]))
    with pytest.warns(
        fb.errors.FlexbandWarning, match="equilibrium of 1 of 2 samples is not stable"
    ):
        np.testing.assert_array_equal(fb.equilibrium(pendulums)["stable"], [True, False])
    cable = fb.Cable(
        length=1.0, mass_per_length=1.0, axial_stiffness=1e6, bending_stiffness=1.0, elements=8
    )
    column = fb.Mechanism(
        bodies={"c": cable},
        joints={"clamp": fb.Weld("c.start", (0.0, 0.0))},
        loads={"P": fb.Force("c.end", x=-np.array([2.466, 2.469]))},
    )
    with pytest.warns(
        fb.errors.FlexbandWarning, match="equilibrium of 1 of 2 samples is not stable"
    ):
        np.testing.assert_array_equal(fb.equilibrium(column)["stable"], [True, False])
    loaded_column = fb.Mechanism(
        bodies=column.bodies,
        joints=column.joints,
        loads={"P": fb.Force("c.end", x=-1.0152 * np.pi**2 / 4, y=1e-5)},
        sensors={"angle": fb.Angle("c.end")},
    )
    end_angle = fb.equilibrium(loaded_column)  # the elastica of P/P₁ = 1.0152 turns its end by 20°
    np.testing.assert_allclose(end_angle, np.radians(20.0), rtol=2e-2)
    assert end_angle["stable"]
    mechanism = fb.Mechanism(bodies={"c": cable})
    assert fb.equilibrium(mechanism)["stable"]


def truss(load):
    """Two springs of length ℓ₀ on a height of 0.1 m: 2k (ℓ₀/ℓ − 1) y = P, at most 0.0383 N."""
    rest = np.hypot(1.0, 0.1)
    return fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0, position=(0.0, 0.1))},
        loads={
            "a": fb.Spring("m", (-1.0, 0.0), 100.0, rest),
            "b": fb.Spring("m", (1.0, 0.0), 100.0, rest),
            "P": fb.Force("m", y=-load),
        },
        sensors={"m": fb.Position("m")},
    )


def test_a_truss_snaps_through_at_its_limit_load():
    def restoring_force(y):
        return 200 * (np.hypot(1.0, 0.1) / np.hypot(1.0, y) - 1) * y

    limit = -minimize_scalar(lambda y: -restoring_force(y), bounds=(0, 0.1), method="bounded").fun
    stable_loads = np.array([0.3, 0.9, 0.999]) * limit
    y = fb.equilibrium(truss(stable_loads)).sel(output="m_Y").values
    np.testing.assert_allclose(restoring_force(y), stable_loads, rtol=1e-7)
    assert (y > 0).all()
    excess_loads = np.array([0.5, 1.003, 1.2, 3.0]) * limit
    with pytest.raises(
        fb.errors.AssemblyError, match=r"snaps through at .* of the loads; Pres"
    ) as error:
        fb.equilibrium(truss(excess_loads), steps=2)
    assert sorted(error.value.failures) == [1, 2, 3]
    for sample, (_, reason) in error.value.failures.items():
        part = float(re.search(r"at ([\d.]+) of the loads", reason).group(1))
        assert part == pytest.approx(limit / excess_loads[sample], abs=2e-3)


STRIP = {
    "length": 1.0, "height": 0.01, "width": 0.01, "density": 1000.0, "youngs_modulus": 1e9,
    "poissons_ratio": 0.3, "elements": 8,
}  # fmt: skip
EI = 1e9 * 0.01**4 / 12


def strip(**loads):
    return fb.Mechanism(
        bodies={"a": fb.Beam(**STRIP)},
        joints={"w": fb.Weld("a.start", (0.0, 0.0))},
        loads=loads,
        sensors={"phi": fb.Angle("a.end")},
    )


@pytest.mark.parametrize("steps", [1, 3])
def test_angles_count_turns_on_the_way_to_equilibrium(steps):
    """A strip under an end moment M turns its end by M L/EI."""
    turns = np.array([-7.0, 3.2, 4.6, 2 * np.pi, 9.0])
    angle = fb.equilibrium(strip(M=fb.Moment("a.end", turns * EI)), steps=steps)
    np.testing.assert_allclose(angle[:, 0], turns, rtol=1e-6)


def test_a_column_above_its_buckling_load_is_warned_of():
    P = 3 * np.pi**2 / 4 * EI
    with pytest.warns(fb.errors.FlexbandWarning, match="of 1 of 1 sample is not stable"):
        rest = fb.equilibrium(strip(P=fb.Force("a.end", x=-P)))
    assert not rest["stable"]


def test_members_that_bend_to_assemble_do_so_or_are_refused_by_name():
    """Lee's frame with prescribed travel: a coarse mesh may assemble the other way round."""
    section = {
        "section": fb.sections.GeneralSection(6.0, 2.0),
        "density": 1.0,
        "youngs_modulus": 720.0,
    }
    section |= {"poissons_ratio": 0.3}

    def frame(elements, travel):
        members = {
            "c": fb.Beam(length=120.0, elements=elements, angle=np.pi / 2, **section),
            "b": fb.Beam(length=24.0, elements=1, start=(0.0, 120.0), **section),
            "d": fb.Beam(length=96.0, elements=elements, start=(24.0, 120.0), **section),
        }
        joints = {
            "p": fb.Revolute("c.start", (0.0, 0.0)),
            "k": fb.Weld("b.start", "c.end", -np.pi / 2),
            "m": fb.Weld("d.start", "b.end"),
            "q": fb.Revolute("d.end", (120.0, 120.0)),
            "t": fb.PrescribedTravel("b.end", (24.0, 120.0), lambda t: -travel, (0.0, 1.0)),
        }
        return fb.Mechanism(bodies=members, joints=joints, sensors={"R": fb.Reaction("t")})

    with pytest.warns(fb.errors.FlexbandWarning, match="assembly turned body"):
        force = -fb.equilibrium(frame(2, 40.0)).sel(output="R_Y")
    assert force == pytest.approx(1.7794, rel=5e-3)
    with pytest.raises(
        fb.errors.AssemblyError, match="joint 'k' holds its body the wrong way round"
    ):
        fb.equilibrium(frame(2, 30.0))


def test_equal_supports_carry_equal_parts():
    """A plate hangs on three bars, which is one more than it needs."""
    bars = {
        f"c{k}": fb.RigidBody.bar(
            length=1.0, height=0.02, width=0.02, density=1000.0, start=(k, 0.0), angle=-1.2
        )
        for k in range(3)
    }
    plate = fb.RigidBody(
        mass=3.0, inertia=1.0, points={str(k): (float(k), 0.0) for k in range(3)},
        center=(1.0, 0.0), position=(np.cos(1.2), -np.sin(1.2)),
    )  # fmt: skip
    joints = {f"g{k}": fb.Revolute(f"c{k}.start", (float(k), 0.0)) for k in range(3)}
    joints |= {f"t{k}": fb.Revolute(f"c{k}.end", f"p.{k}") for k in range(3)}
    model = fb.Mechanism(
        bodies=bars | {"p": plate}, joints=joints, loads={"gravity": fb.Gravity()},
        sensors={f"F{k}": fb.Reaction(f"t{k}") for k in range(3)},
    )  # fmt: skip
    rest = fb.equilibrium(model)
    np.testing.assert_allclose(rest, [0.0, -9.81] * 3, atol=1e-8)
    assert rest.attrs["not_unique"] == [f"joint {name!r}" for name in joints]


def test_a_stiffness_that_is_lost_in_rounding_errors_is_refused():
    member = {"length": 1.0, "height": 0.05, "width": 0.05, "density": 1e3, "poissons_ratio": 0.3}
    model = fb.Mechanism(
        bodies={
            "soft": fb.Beam(**member, elements=4, youngs_modulus=1e7),
            "stiff": fb.Beam(**member, elements=4, youngs_modulus=1e22, start=(1.0, 0.0)),
        },
        joints={
            "wall": fb.Weld("soft.start", (0.0, 0.0)),
            "weld": fb.Weld("stiff.start", "soft.end"),
        },
        loads={"force": fb.Force("stiff.end", 0.0, -0.1)},
        sensors={"tip": fb.Position("stiff.end")},
    )
    with pytest.raises(fb.errors.AssemblyError, match="no equilibrium was found"):
        fb.equilibrium(model)


def test_stiffness_at_a_rest_is_reduced_and_factored_once(monkeypatch):
    calls = []

    def count_call(matrix):
        calls.append(len(matrix))
        return factorize(matrix)

    factorize = balance._factor
    monkeypatch.setattr(balance, "_factor", count_call)
    rubber = {"height": 0.01, "width": 0.01, "density": 1e3, "youngs_modulus": 1e9}
    rubber["poissons_ratio"] = 0.3
    frame = fb.Mechanism(
        bodies={
            "a": fb.Beam(length=1.0, elements=32, angle=np.pi / 2, **rubber),
            "b": fb.Beam(length=1.0, elements=32, start=(0.0, 1.0), **rubber),
        },
        joints={
            "w": fb.Weld("a.start", (0.0, 0.0), np.pi / 2),
            "k": fb.Weld("b.start", "a.end", -np.pi / 2),
        },
        loads={"F": fb.Force("b.end", y=-0.8)},
        sensors={"tip": fb.Position("b.end"), "R": fb.Reaction("w")},
    )
    fb.equilibrium(frame)  # compiles
    calls.clear()
    rest = fb.equilibrium(frame)
    assert len(calls) == 1
    assert rest.sel(output="R_Y") == pytest.approx(0.8, rel=1e-9)
    dense = {"sparse_from": 10_000}
    monkeypatch.setattr(
        eigenmodes.reduce_matrix, "__kwdefaults__", dense
    )  # products of dense matrices
    np.testing.assert_allclose(fb.equilibrium(frame), rest, rtol=1e-9, atol=1e-12)
