"""Pins and guides with offsets, against exact kinematics, and what their bounds may be used for."""

import numpy as np
import pytest

import flexband as fb
from benchmarks.play.linkages import Dyad, Linkage
from flexband.errors import InputError
from flexband.report.text.band_tables import remarks

BAR = {"height": 0.01, "width": 0.01, "density": 7800.0}
OMEGA = 2.0


def four_bar(pin0=(0.0, 0.0), pin1=(0.0, 0.0), pin2=(0.0, 0.0), pin3=(0.0, 0.0)):
    crank, coupler, rocker = (
        fb.RigidBody.bar(length=length, start=start, angle=angle, **BAR)
        for length, start, angle in (
            (0.3, (0.0, 0.0), 0.6), (0.9, (0.25, 0.17), 0.55), (0.7, (1.0, 0.0), 1.6)
        )
    )  # fmt: skip
    return fb.Mechanism(
        bodies={"crank": crank, "coupler": coupler, "rocker": rocker},
        joints={
            "pin0": fb.Revolute((0.0, 0.0), "crank.start", offset=pin0),
            "pin1": fb.Revolute("crank.end", "coupler.start", offset=pin1),
            "pin3": fb.Revolute("coupler.end", "rocker.end", offset=pin3),
            "pin2": fb.Revolute((1.0, 0.0), "rocker.start", offset=pin2),
            "motor": fb.PrescribedRotation("crank", lambda t: 0.6 + OMEGA * t),
        },
        sensors={"out": fb.Angle("rocker"), "rate": fb.AngularVelocity("rocker")},
    )


def test_offset_pins_meet_in_the_axes_of_the_first_body():
    response = fb.dynamic_response(four_bar, duration=0.2, step=0.05)
    pairs = 0.01 * np.random.default_rng(0).uniform(-1, 1, (4, 2, 3))
    pins = {f"pin{k}": pair for k, pair in enumerate(pairs)}
    motion = response(**pins)
    dyad = Dyad(("coupler", "rocker"), (0.9, 0.7), (("crank", 0.3, 0.0), ("ground", 1.0, 0.0)))
    linkage = Linkage(0.3, [dyad], ["rocker"], 0.6 + OMEGA * motion["time"].values)
    exact = linkage.outputs_at(pins)[:, 0]
    np.testing.assert_allclose(motion.sel(output="out"), exact, rtol=1e-12)


def test_only_positions_of_a_prescribed_motion_carry_requirements():
    response = fb.dynamic_response(four_bar, duration=0.1, step=0.05)
    assert response.instantaneous() == ["out"]
    inputs = {name: fb.Play(1e-3) for name in ("pin0", "pin1", "pin2", "pin3")}
    surrogate = fb.expand(response, inputs, fb.methods.RegressionPCCI(1))
    bands = surrogate.bands()
    assert bands.attrs["constant_offsets"] == ["rate"]
    assert "For constant offsets of pins and guides: rate" in remarks(bands)
    angle = float(bands["mean"].sel(output="out").max())
    check = fb.analysis.check_requirements(surrogate, fb.Requirement("out", below=angle + 0.1))
    assert check["verdict"].values.tolist() == ["kept"]
    for judge in (
        lambda limit: fb.analysis.check_requirements(surrogate, limit),
        lambda limit: fb.analysis.allocate(surrogate, limit, {"pin0": 1.0}),
        lambda limit: fb.production_yield(surrogate, limit, {}),
    ):
        with pytest.raises(InputError, match="rate are for constant offsets of pins and guides"):
            judge(fb.Requirement("rate", below=10.0))


def test_offsets_that_are_stated_to_be_constant_carry_requirements_with_these_words():
    response = fb.dynamic_response(four_bar, duration=0.1, step=0.05)
    inputs = {"pin0": fb.Play(1e-3, one_sided=True), "pin1": fb.Play(1e-3, one_sided=True)}
    surrogate = fb.expand(response, inputs, fb.methods.RegressionPCCI(1))
    limits = [fb.Requirement("rate", below=10.0), fb.Requirement("out", below=10.0)]
    words = fb.analysis.check_requirements(surrogate, limits).attrs["verdict"]
    assert words.startswith("rate below 10, for constant offsets of pins and guides: met")
    assert ". out below 10: met" in words
    plan = fb.analysis.allocate(surrogate, limits[0], {"pin0": 1.0})
    assert plan.attrs["verdict"].endswith("For constant offsets of pins and guides")
    share = fb.production_yield(surrogate, limits, {}).attrs["verdict"]
    assert share.endswith("For constant offsets of pins and guides")
    mixed_surrogate = fb.expand(
        response, inputs | {"pin1": fb.Play(1e-3)}, fb.methods.RegressionPCCI(1)
    )
    with pytest.raises(InputError, match="rate are for constant offsets"):
        fb.analysis.check_requirements(mixed_surrogate, limits)


def test_a_free_motion_has_no_instantaneous_outputs():
    mechanism = four_bar()
    joints = {name: joint for name, joint in mechanism.joints.items() if name != "motor"}
    motorless = fb.Mechanism(bodies=mechanism.bodies, joints=joints, sensors=mechanism.sensors)
    assert fb.dynamic_response(lambda: motorless, duration=0.1, step=0.05).instantaneous() == []


def test_a_slider_is_moved_and_turned_in_its_guide():
    axis = (2.0, 1.0)
    angle = np.arctan2(1.0, 2.0)
    block = fb.RigidBody.block(length=0.2, height=0.1, **{k: BAR[k] for k in ("width", "density")})

    def slide(slider):
        return fb.Mechanism(
            bodies={"block": block},
            joints={
                "guide": fb.Prismatic("block", (0.0, 0.0), axis, offset=slider),
                "drive": fb.PrescribedTravel("block", (0.0, 0.0), lambda t: 0.1 + t, axis=axis),
            },
            sensors={"at": fb.Position("block"), "turn": fb.Angle("block")},
        )

    response = fb.dynamic_response(slide, duration=0.1, step=0.05)
    offsets = np.array([[0.01, -0.02], [0.005, 0.0]])
    motion = response(slider=offsets)
    np.testing.assert_allclose(motion.sel(output="turn")[:, -1], offsets[1], atol=1e-12)
    x, y = motion.sel(output=["at_X", "at_Y"]).values[:, :, -1].T
    np.testing.assert_allclose(-np.sin(angle) * x + np.cos(angle) * y, offsets[0], atol=1e-12)
    inputs = {"slider": fb.GuidePlay(0.002, length=0.2)}
    bands = fb.propagate(response, inputs, fb.ImprovedPCCI(0, 2))
    np.testing.assert_allclose(bands["mean"].sel(output="turn")[:, -1], [-0.02, 0.02], rtol=1e-6)
    assert "constant_offsets" not in bands.attrs


def test_a_pin_is_moved_across_its_slot():
    pin = fb.PointMass(mass=1.0, position=(0.1, 0.0))
    motion = fb.simulate(
        fb.Mechanism(
            bodies={"pin": pin},
            joints={
                "slot": fb.Slot("pin", (0.0, 0.0), offset=np.array([0.0, 0.02])),
                "drive": fb.PrescribedTravel("pin", (0.0, 0.0), lambda t: 0.1 + t),
            },
            sensors={"pin": fb.Position("pin")},
        ),
        duration=0.1,
        step=0.05,
    )
    np.testing.assert_allclose(motion.sel(output="pin_Y")[:, -1], [0.0, 0.02], atol=1e-14)


LAW = fb.contact.KeepsRestitution(stiffness=1e3, restitution=0.5)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: fb.Revolute("a", "b", offset=(1.0, 2.0, 3.0)), "Revolute offset must be a pair"),
        (lambda: fb.Revolute("a", "b", offset=0.1), "Revolute offset must be a pair"),
        (lambda: fb.Revolute("a", "b", offset=(np.nan, 0.0)), "Revolute offset must be finite"),
        (
            lambda: fb.Revolute("a", "b", clearance=0.1, law=LAW, offset=(0.1, 0.0)),
            "Revolute needs one of clearance and offset",
        ),
        (lambda: fb.Prismatic("a", "b", offset="xyz"), "Prismatic offset must be a pair"),
        (lambda: fb.Slot("a", "b", offset=(0.1, 0.0)), "Slot offset"),
    ],
)
def test_bad_offsets_are_refused(make, message):
    with pytest.raises(InputError, match=message):
        make()
