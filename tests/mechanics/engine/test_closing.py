"""Loops with flexible members close from rough guesses, and where the exact ones do."""

import numpy as np
import pytest

import flexband as fb

CRANK = 0.06
COUPLER = 0.24
ROCKER = 0.14
GROUND = 0.25  # m
STEEL = {"height": 0.015, "width": 0.010, "density": 7850.0}
ALUMINIUM = {
    "height": 0.003, "width": 0.015, "density": 2700.0, "youngs_modulus": 70e9,
    "poissons_ratio": 0.33, "elements": 4,
}  # fmt: skip
AT_ONCE = {"duration": 1e-4, "step": 1e-4}

pytestmark = pytest.mark.filterwarnings("ignore:assembly turned")


def exact(turn):
    """Angles of the coupler and the rocker at this angle of the crank, by the law of cosines."""
    x = GROUND - CRANK * np.cos(turn)
    y = -CRANK * np.sin(turn)
    diagonal = np.hypot(x, y)
    lean = np.arctan2(y, x)
    inner = np.arccos((COUPLER**2 + diagonal**2 - ROCKER**2) / (2 * COUPLER * diagonal))
    coupler = lean + inner
    joint = CRANK * np.exp(1j * turn) + COUPLER * np.exp(1j * coupler) - GROUND
    return coupler, np.angle(joint)


def four_bar(coupler, rocker, parts=None, joints=None):
    """A crank at 0.5 rad, a beam and a rocker that start at these angles."""
    return fb.Mechanism(
        bodies={
            "crank": fb.RigidBody.bar(length=CRANK, angle=0.5, **STEEL),
            "coupler": fb.Beam(length=COUPLER, start=(0.05, 0.03), angle=coupler, **ALUMINIUM),
            "rocker": fb.RigidBody.bar(length=ROCKER, start=(GROUND, 0.0), angle=rocker, **STEEL),
        } | (parts or {}),
        joints={
            "A": fb.Revolute("crank.start", (0.0, 0.0)),
            "B": fb.Revolute("coupler.start", "crank.end"),
            "C": fb.Revolute("coupler.end", "rocker.end"),
            "D": fb.Revolute("rocker.start", (GROUND, 0.0)),
            "motor": fb.PrescribedRotation("crank", lambda t: 0.5 + 20 * np.pi * t),
        } | (joints or {}),
        sensors={"coupler": fb.Angle("coupler"), "rocker": fb.Angle("rocker"),
                 "energy": fb.ElasticEnergy()},
    )  # fmt: skip


def test_a_flexible_coupler_closes_from_rough_guesses():
    true = np.array(exact(0.5))
    rng = np.random.default_rng(0)
    guess = true[:, None] + rng.uniform(-0.5, 0.5, (2, 200))
    motion = fb.simulate(four_bar(*guess), **AT_ONCE).isel(time=0)
    np.testing.assert_allclose(motion.sel(output="coupler"), true[0], atol=1e-10)
    np.testing.assert_allclose(motion.sel(output="rocker"), true[1], atol=1e-10)
    assert motion.sel(output="energy").max() < 1e-12  # J


def test_a_sample_closes_as_it_does_alone():
    rng = np.random.default_rng(1)
    guess = np.array(exact(0.5))[:, None] + rng.uniform(-0.3, 0.3, (2, 11))
    batch = fb.simulate(four_bar(*guess), **AT_ONCE)
    for sample in (0, 7, 10):
        single_run = fb.simulate(four_bar(*guess[:, sample]), **AT_ONCE)
        np.testing.assert_array_equal(batch[sample], single_run)


def test_members_beyond_a_heavy_slider_stay_unbent():
    """A ram of 0.5 kg behind the rocker, whose place is known in closed form."""
    ram = fb.RigidBody.block(
        length=0.04, height=0.04, width=0.04, density=7850.0, position=(0.55, 0.1)
    )
    link = fb.RigidBody.bar(length=0.3, start=(0.27, 0.14), angle=0.1, **STEEL)
    model = four_bar(
        0.3,
        1.3,
        {"link": link, "ram": ram},
        {
            "E": fb.Revolute("link.start", "rocker.end"),
            "F": fb.Revolute("ram", "link.end"),
            "guide": fb.Prismatic("ram", (0.0, 0.1)),
        },
    )
    motion = fb.simulate(model, **AT_ONCE).isel(time=0)
    assert float(motion.sel(output="rocker")) == pytest.approx(exact(0.5)[1], abs=1e-10)
    assert motion.sel(output="energy") < 1e-12  # J


def test_turns_of_gears_are_kept_where_closing_passes_half_a_turn():
    """The rocker is guessed at less than π and closes at more; rigid members close the same way."""
    turn = 2.2
    radius = 0.05
    offset = np.pi + 0.05 - exact(turn)[1]  # turns the whole mechanism
    pin = GROUND * np.cos(offset), GROUND * np.sin(offset)
    span = np.hypot(0.5 - pin[0], 0.5 - pin[1])
    beam = fb.Beam(length=COUPLER, angle=exact(turn)[0] + offset, **ALUMINIUM)
    starts = []
    for coupler in (beam, fb.RigidBody.bar(length=COUPLER, angle=beam.angle, **STEEL)):
        crank = fb.RigidBody.bar(length=CRANK, angle=turn + offset, **STEEL)
        rocker = fb.RigidBody.bar(length=ROCKER, start=pin, angle=np.pi - 0.05, **STEEL)
        wheel = fb.RigidBody.disc(radius=radius, width=0.01, density=7850.0, position=(0.5, 0.5))
        model = fb.Mechanism(
            bodies={"crank": crank, "coupler": coupler, "rocker": rocker, "wheel": wheel},
            joints={
                "A": fb.Revolute("crank.start", (0.0, 0.0)),
                "B": fb.Revolute("coupler.start", "crank.end"),
                "C": fb.Revolute("coupler.end", "rocker.end"),
                "D": fb.Revolute("rocker.start", pin),
                "W": fb.Revolute("wheel", (0.5, 0.5)),
                "gear": fb.Gear("wheel", "rocker.start", radius, span - radius),
                "motor": fb.PrescribedRotation("crank", lambda t: turn + offset + 0 * t),
            },
            sensors={"rocker": fb.Angle("rocker"), "wheel": fb.Angle("wheel")},
        )
        starts.append(fb.simulate(model, **AT_ONCE).isel(time=0))
    np.testing.assert_allclose(*starts, atol=1e-8)
    assert float(starts[0].sel(output="rocker")) % (2 * np.pi) == pytest.approx(np.pi + 0.05)


def test_a_beam_on_one_crank_too_many_closes_by_bending():
    """The middle of three cranks is 0.1 mm too long."""
    rng = np.random.default_rng(2)
    guess = np.array([1.0, 1.0, 0.0])[:, None] + rng.uniform(-0.2, 0.2, (3, 40))
    bar = fb.RigidBody.bar
    model = fb.Mechanism(
        bodies={
            "a": bar(length=0.1, angle=1.0, **STEEL),
            "b": bar(length=0.1001, angle=guess[0], start=(0.2, 0.0), **STEEL),
            "c": bar(length=0.1, angle=guess[1], start=(0.4, 0.0), **STEEL),
            "beam": fb.Beam(length=0.4, angle=guess[2], start=(0.1, 0.1), **ALUMINIUM),
        },
        joints={
            "A": fb.Revolute("a.start", (0.0, 0.0)),
            "B": fb.Revolute("b.start", (0.2, 0.0)),
            "C": fb.Revolute("c.start", (0.4, 0.0)),
            "D": fb.Revolute("beam.start", "a.end"),
            "E": fb.Revolute("beam.middle", "b.end"),
            "F": fb.Revolute("beam.end", "c.end"),
            "motor": fb.PrescribedRotation("a", lambda t: 1.0 + 0 * t),
        },
        sensors={"middle": fb.Position("beam.middle")},
    )
    motion = fb.simulate(model, **AT_ONCE).isel(time=0)
    reach = np.hypot(motion.sel(output="middle_X") - 0.2, motion.sel(output="middle_Y"))
    np.testing.assert_allclose(reach, 0.1001, atol=1e-9)


def test_two_welds_of_massless_bodies_are_refused_as_open():
    """Their rows are redundant where turns weigh a thousand times what moves do."""
    ends = {"start": (-0.5, 0.0), "end": (0.5, 0.0)}
    model = fb.Mechanism(
        bodies={
            "rod": fb.RigidBody(
                mass=0.0, inertia=0.0, points=ends, position=(-0.25, 0.0), angle=np.pi
            ),
            "pin": fb.PointMass(mass=0.0, position=(0.25, -0.25)),
        },
        joints={"a": fb.Weld("pin", "rod.end"), "b": fb.Weld("pin", "rod.start", angle=np.pi / 2)},
        sensors={"pin": fb.Position("pin")},
    )
    with pytest.raises(fb.errors.AssemblyError, match=r"joint 'a' stays open by 0\.5 m"):
        fb.simulate(model, **AT_ONCE)
