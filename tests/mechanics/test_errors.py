"""Senseless mechanisms are refused by name; failed runs are reported, never returned."""

import numpy as np
import pytest

import flexband as fb
from flexband.mechanics.forms import Form, Frame, dot

from .models import pendulum, rigid_slider_crank, slider_crank


def block(**changes):
    return fb.RigidBody.block(
        **({"length": 0.1, "height": 0.1, "width": 0.1, "density": 1000.0} | changes)
    )


def mechanism(joints=None, **parts):
    return fb.Mechanism(bodies={"a": block(), "b": block()}, joints=joints or {}, **parts)


@pytest.mark.parametrize(
    ("build", "text"),
    [
        (lambda: block(length=0.0), r"block length \[m\] must be positive; got 0"),
        (lambda: block(density=-1.0), "block density"),
        (lambda: block(position=(0.0, np.nan)), "position Y"),
        (lambda: fb.Mechanism(bodies={}), "at least one body"),
        (lambda: fb.Mechanism(bodies={"a.b": block()}), "without a dot; got 'a.b'"),
        (
            lambda: mechanism({"pin": fb.Revolute("a", "c.end")}),
            "joint 'pin': body 'c' is not in the mechanism; there is a, b",
        ),
        (
            lambda: mechanism({"pin": fb.Revolute("a.tip", "b")}),
            "joint 'pin': point 'tip' is unknown; there is center",
        ),
        (lambda: mechanism({"pin": fb.Revolute("a", (0.0, np.inf))}), "ground point Y"),
        (lambda: mechanism({"pin": fb.Revolute("a", 3.0)}), "ground point must be a pair; got 3.0"),  # type: ignore
        (
            lambda: mechanism(sensors={"F": fb.Reaction("B")}),
            "sensor 'F': joint 'B' is not in the mechanism; there is none",
        ),
        (lambda: mechanism(sensors={"x": fb.Position("c")}), "sensor 'x': body 'c'"),
        (
            lambda: mechanism(loads={"s": fb.Spring("a", "c", 1.0)}),
            "load 's': body 'c' is not in the mechanism",
        ),
        (
            lambda: mechanism({"pin": fb.Revolute((0, 0), (0, 0))}),
            "joint 'pin': it must join two bodies",
        ),
        (
            lambda: mechanism({"pin": fb.Revolute("a", "a")}),
            "it must join two bodies, or a body and the ground",
        ),
        (lambda: mechanism({"pin": "a"}), "joints\\['pin'\\] must be a joint; got 'a'"),  # type: ignore
        (lambda: fb.Mechanism(bodies={"a": "b"}), "bodies\\['a'\\] must be a body; got 'b'"),  # type: ignore
        (lambda: mechanism(loads={"g": 9.81}), "loads\\['g'\\] must be a load; got 9.81"),  # type: ignore
        (
            lambda: pendulum_driven(lambda t: 0.0, sensors={"M": fb.Reaction("motor")}),
            "sensor 'M': joint 'motor' exerts a moment and no force",
        ),
        (lambda: block(length=np.sin), "block length .* must be positive; got a function"),
        (lambda: block(position=1.0), "position must be a pair; got 1.0"),
        (lambda: fb.GeneralizedAlpha(spectral_radius=[0.1, 0.2]), "must be 1 number"),  # type: ignore
        (lambda: fb.Spring("a", "b", -1.0), "stiffness .* must be zero or positive; got -1"),
        (lambda: fb.Spring("a", "b", 1.0, rest_length=np.nan), "rest_length"),
        (lambda: fb.Prismatic("a", "b", axis=(0.0, 0.0)), "axis must have a length"),
        (lambda: fb.PrescribedRotation("a", 3.0), "function of time; got 3.0"),  # type: ignore
        (lambda: fb.Gravity(y=np.nan), "Gravity y"),
        (lambda: fb.GeneralizedAlpha(spectral_radius=1.2), "between 0 and 1; got 1.2"),
        (lambda: fb.GeneralizedAlpha(tolerance=0.0), "tolerance"),
        (lambda: fb.SelectiveIntegration(shear_factor=0.0), "shear_factor"),
    ],
)
def test_bad_models_are_refused(build, text):
    with pytest.raises(fb.InputError, match=text):
        build()


@pytest.mark.parametrize(
    ("duration", "step", "text"),
    [
        (0.0, 1e-3, "duration .* must be positive; got 0"),
        (1.0, -1e-3, "step .* must be positive; got -0.001"),
        (1.0, 0.3, "whole number of steps; got 1 with step 0.3"),
        (np.nan, 0.1, "duration"),
    ],
)
def test_bad_times_are_refused(duration, step, text):
    with pytest.raises(fb.InputError, match=text):
        fb.simulate(pendulum(), duration=duration, step=step)


def test_numbers_of_samples_must_fit():
    with pytest.raises(fb.InputError, match=r"different numbers of samples: \[3, 4\]"):
        fb.simulate(
            slider_crank(crank_length=np.full(3, 0.2), spring_stiffness=np.full(4, 1e3)),
            duration=0.01,
            step=1e-3,
        )
    two = rigid_slider_crank(np.full(2, 0.2), angle=lambda t: np.zeros(5))
    with pytest.raises(fb.InputError, match=r"different numbers of samples: \[2, 5\]"):
        fb.simulate(two, duration=0.01, step=1e-3)
    growing = pendulum_driven(lambda t: np.zeros(5) if t else 0.0)
    with pytest.raises(fb.InputError, match="returned 5 values; the mechanism has 1 samples"):
        fb.simulate(growing, duration=0.01, step=1e-3)


def pendulum_driven(angle, **parts):
    return fb.Mechanism(
        bodies={"a": block()},
        joints={"pin": fb.Revolute("a", (0, 0)), "motor": fb.PrescribedRotation("a", angle)},
        **parts,
    )


@pytest.mark.parametrize("angle", [2.0, 3.0, np.pi, -2.5])
def test_a_drive_that_would_start_the_wrong_way_round_is_refused(angle):
    with pytest.raises(fb.AssemblyError, match="'motor' holds its body the wrong way round"):
        fb.simulate(pendulum_driven(lambda t: angle), duration=0.01, step=1e-3)
    with pytest.raises(fb.AssemblyError, match="Jacobian loses rank; worst is joint 'motor'"):
        fb.simulate(pendulum_driven(lambda t: np.pi / 2), duration=0.01, step=1e-3)


def test_a_slide_that_would_be_held_upside_down_is_refused():
    model = fb.Mechanism(
        bodies={"a": block(angle=3.0)}, joints={"guide": fb.Prismatic("a", (0.0, 0.0))}
    )
    with pytest.raises(fb.AssemblyError, match="'guide' holds its body the wrong way round"):
        fb.simulate(model, duration=0.01, step=1e-3)


def test_a_drive_may_turn_round_many_times():
    model = pendulum_driven(lambda t: 200 * t, sensors={"a": fb.Position("a")})
    fb.simulate(model, duration=0.5, step=1e-3)


def test_times_are_those_the_user_wrote():
    motion = fb.simulate(pendulum(), duration=0.6, step=1e-3)
    assert list(motion.time.values) == [k / 1000 for k in range(601)]


def test_a_builder_must_return_a_mechanism():
    response = fb.dynamic_response(lambda length: None, duration=0.1, step=0.01)
    with pytest.raises(fb.InputError, match="must return a Mechanism; got None"):
        response(length=np.ones(2))


def test_assembly_errors_give_the_inputs():
    def locked(link_length):
        crank = fb.RigidBody.bar(length=0.2, height=0.01, width=0.01, density=1.0)
        link = fb.RigidBody.bar(
            length=link_length, height=0.01, width=0.01, density=1.0, start=(0.2, 0), angle=1.0
        )
        joints = {
            "A": fb.Revolute("crank.start", (0.0, 0.0)),
            "B": fb.Revolute("crank.end", "link.start"),
            "C": fb.Revolute("link.end", (0.3, 0.3)),
        }
        return fb.Mechanism(bodies={"crank": crank, "link": link}, joints=joints)

    response = fb.dynamic_response(locked, duration=0.01, step=1e-3)
    with pytest.raises(fb.AssemblyError, match=r"sample 1: link_length = 0.1") as caught:
        response(link_length=np.array([0.3, 0.1]))
    assert list(caught.value.failures) == [1]


def test_a_drive_that_returns_nan_is_refused():
    with pytest.raises(fb.InputError, match=r"must be finite; it is not at t = 0\.005 s"):
        fb.simulate(
            pendulum_driven(lambda t: np.nan if t > 0.004 else 0.0), duration=0.01, step=1e-3
        )


def test_a_mechanism_that_cannot_be_assembled():
    # crank 0.2 and link 0.1 do not reach a pin 0.58 away
    crank = fb.RigidBody.bar(length=0.2, height=0.01, width=0.01, density=1.0)
    link = fb.RigidBody.bar(
        length=0.1, height=0.01, width=0.01, density=1.0, start=(0.2, 0.0), angle=1.0
    )
    impossible = fb.Mechanism(
        bodies={"crank": crank, "link": link},
        joints={
            "A": fb.Revolute("crank.start", (0.0, 0.0)),
            "B": fb.Revolute("crank.end", "link.start"),
            "C": fb.Revolute("link.end", (0.3, 0.5)),
        },
    )
    with pytest.raises(fb.AssemblyError, match=r"cannot be met, worst is (joint|rigidity)"):
        fb.simulate(impossible, duration=0.01, step=1e-3)


def test_constraints_that_contradict_each_other():
    twice = fb.Mechanism(
        bodies={"a": fb.RigidBody.bar(length=0.2, height=0.01, width=0.01, density=1.0)},
        joints={
            "A": fb.Revolute("a.start", (0.0, 0.0)),
            "B": fb.Revolute("a.end", (0.25, 0.0)),
        },
    )
    with pytest.raises(fb.AssemblyError, match=r"contradict each other.* joint 'B'"):
        fb.simulate(twice, duration=0.01, step=1e-3)


def test_a_rough_guess_is_assembled():
    crank = fb.RigidBody.bar(length=0.2, height=0.01, width=0.01, density=7800.0, angle=0.2)
    link = fb.Beam(
        length=0.45, height=0.01, width=0.01, density=2700.0, youngs_modulus=69e9,
        poissons_ratio=0.34, elements=3, start=(0.19, 0.05), angle=-0.15,
    )  # fmt: skip
    slider = block(position=(0.6, 0.02), angle=0.1)
    model = fb.Mechanism(
        bodies={"crank": crank, "link": link, "slider": slider},
        joints={
            "A": fb.Revolute("crank.start", (0.0, 0.0)),
            "B": fb.Revolute("link.start", "crank.end"),
            "C": fb.Revolute("slider", "link.end"),
            "guide": fb.Prismatic("slider", (0.0, 0.0)),
            "motor": fb.PrescribedRotation("crank", lambda t: 0.3),
        },
        sensors={"x": fb.Position("slider"), "F": fb.Reaction("A")},
    )
    motion = fb.simulate(model, duration=0.01, step=1e-3)
    exact = 0.2 * np.cos(0.3) + np.sqrt(0.45**2 - (0.2 * np.sin(0.3)) ** 2)
    np.testing.assert_allclose(motion.sel(output="x_X"), exact, atol=1e-9)
    assert np.abs(motion.sel(output=["F_X", "F_Y"])).max() < 1e-3  # no stress, no load


def test_a_diverging_run_is_reported_with_inputs_and_time():
    def locking(crank_length, link_length):
        return rigid_slider_crank(crank_length, link_length)

    response = fb.dynamic_response(locking, duration=0.3, step=1e-3)
    lengths = np.array([0.2, 0.2, 0.2])
    with pytest.raises(fb.SimulationError) as caught:
        response(crank_length=lengths, link_length=np.array([0.45, 0.15, 0.45]))
    assert list(caught.value.failures) == [1]
    time = caught.value.failures[1][0]
    assert time == pytest.approx(np.arcsin(0.75) / (4 * np.pi), abs=2e-3)  # where it locks
    assert "1 of 3 runs failed" in str(caught.value)
    assert "link_length = 0.15" in str(caught.value)


def test_a_spring_may_pass_through_length_zero():
    hung = fb.Mechanism(
        bodies={"a": block()},
        loads={"spring": fb.Spring("a", (0.0, 0.0), 10.0, rest_length=0.0), "g": fb.Gravity()},
        sensors={"a": fb.Position("a")},
    )
    motion = fb.simulate(hung, duration=1.0, step=1e-3)  # k = 10 N/m, m = 1 kg
    exact = 0.981 * (np.cos(np.sqrt(10.0) * motion.time) - 1)
    np.testing.assert_allclose(motion.sel(output="a_Y"), exact, atol=1e-5)


def test_drives_may_differ_between_samples():
    speeds = np.array([3.0, 4.0, 5.0])
    both = fb.simulate(rigid_slider_crank(angle=lambda t: speeds * t), duration=0.1, step=1e-3)
    for k, speed in enumerate(speeds):
        one = fb.simulate(rigid_slider_crank(angle=lambda t, w=speed: w * t),
                          duration=0.1, step=1e-3)  # fmt: skip
        np.testing.assert_allclose(both[k], one, rtol=0, atol=1e-9 * np.abs(one).max())


def test_forms_are_an_algebra():
    x, y = Form.variable(1), Form.variable(2)
    product = (x + 2.0 * y) * (x - y)
    assert {k[:2]: float(v) for k, v in product.terms.items()} == {
        (1, 1): 1.0,
        (1, 2): 1.0,
        (2, 2): -2.0,
    }
    with pytest.raises(ValueError, match="at most two variables"):
        product * x
    frame = Frame.of_node(1)
    assert set(dot(frame.x, frame.y).terms) == {(3, 5, None), (4, 6, None)}
