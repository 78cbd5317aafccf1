"""Motions that go on from the end of another one, against exact impacts and the whole motion."""

from dataclasses import replace

import numpy as np
import pytest

import flexband as fb
from flexband import contact
from flexband.errors import AssemblyError, InputError


def carriages(mass, with_latch):
    """A carriage that reaches another one after 0.2 s, with a hook 0.1 m ahead of it."""
    return fb.Mechanism(
        bodies={
            "a": fb.RigidBody(mass=mass, inertia=1e-2, velocity=(2.0, 0.0),
                              points={"hook": (0.1, 0.0)}),
            "b": fb.PointMass(mass=3.0, position=(0.5, 0.0)),
        },
        joints={"a": fb.Slot("a", (0.0, 0.0)), "b": fb.Slot("b", (0.0, 0.0))}
        | ({"latch": fb.Revolute("a.hook", "b")} if with_latch else {}),
        sensors={"a": fb.Velocity("a"), "b": fb.Velocity("b")},
    )  # fmt: skip


def latch_motion(mass, duration=0.2):
    first = fb.simulate(carriages(mass, False), duration=duration, step=0.02, keep_state=True)
    return fb.simulate(carriages(mass, True), duration=0.1, step=0.02, start=first)


def test_two_masses_that_latch_keep_their_momentum():
    """v = m₁v₁/(m₁ + m₂), and the energy ½μv₁² is lost, μ = m₁m₂/(m₁ + m₂)."""
    mass = np.linspace(0.5, 5.0, 10)
    motion = latch_motion(mass)
    exact = 2.0 * mass / (mass + 3.0)
    for output in ("a_X", "b_X"):
        np.testing.assert_allclose(
            motion.sel(output=output).T, np.tile(exact, (6, 1)), rtol=1e-12, atol=0
        )
    np.testing.assert_allclose(
        motion.attrs["lost_energy"], 2.0 * 3.0 * mass / (mass + 3.0), rtol=1e-12
    )
    assert motion["time"].values[[0, -1]].tolist() == [0.2, 0.3]


def test_a_latch_that_is_not_met_is_refused_with_its_gap():
    with pytest.raises(AssemblyError, match=r"joint 'latch' is not met .* off by 0\.04 \(m"):
        latch_motion(1.0, duration=0.18)


def bar(angle=0.0, rate=0.0, velocity=(0.0, 0.0), **parts):
    body = fb.RigidBody(
        mass=2.0, inertia=0.15, angle=angle, rate=rate, velocity=velocity,
        points={"start": (-0.5, 0.0), "end": (0.5, 0.0)},
    )  # fmt: skip
    sensors = {"end": fb.Position("b.end"), "rate": fb.AngularVelocity("b")}
    return fb.Mechanism(bodies={"b": body}, sensors=sensors, **parts)


def test_a_bar_that_is_caught_at_its_end_turns_with_its_angular_momentum():
    """I₀ω = Iω₀ + m (r × v), r from the pin, and ½I₀ω² is left of the energy.

    Samples are caught where each of them is, as in the function of a study.
    """
    rate = np.array([2.0, -3.0, 0.0])
    v = (1.0, -0.7)
    first = fb.simulate(bar(rate=rate, velocity=v), duration=0.3, step=1e-3, keep_state=True)
    place = first.isel(time=-1)
    pin = tuple(place.sel(output=name).values for name in ("end_X", "end_Y"))
    mechanism = bar(rate=rate, velocity=v, joints={"pin": fb.Revolute("b.end", pin)})
    motion = fb.simulate(mechanism, duration=0.01, step=1e-3, start=first)
    angle = 0.3 * rate
    x = -0.5 * np.cos(angle)
    y = -0.5 * np.sin(angle)
    inertia = 0.15 + 2.0 * 0.25
    exact = (0.15 * rate + 2.0 * (x * v[1] - y * v[0])) / inertia
    after = motion.sel(output="rate").values
    np.testing.assert_allclose(after, np.tile(exact[:, None], 11), rtol=0, atol=2e-6)
    before = 0.5 * 0.15 * rate**2 + 0.5 * 2.0 * (v[0] ** 2 + v[1] ** 2)
    energy_loss = before - 0.5 * inertia * exact**2
    np.testing.assert_allclose(motion.attrs["lost_energy"], energy_loss, rtol=2e-6)


def test_a_pendulum_that_its_motor_releases_keeps_its_energy():
    """After more than a turn, and with the motor again at a later time."""
    parts = {"joints": {"O": fb.Revolute("b.start", (0.0, 0.0))}, "loads": {"g": fb.Gravity()}}
    motor = {"motor": fb.PrescribedRotation("b", lambda t: 8.0 * np.asarray(t))}
    pendulum = bar(**parts)
    motor_pendulum = bar(**parts | {"joints": parts["joints"] | motor})
    options = {"step": 5e-4, "integrator": fb.GeneralizedAlpha(spectral_radius=1.0)}
    first = fb.simulate(motor_pendulum, duration=1.0, keep_state=True, **options)
    second = fb.simulate(pendulum, duration=0.2, start=first, keep_state=True, **options)
    assert second.attrs["lost_energy"][0] == pytest.approx(0.0, abs=1e-12)
    height = second.sel(output="end_Y")
    rate = second.sel(output="rate")
    energy = 0.5 * 0.65 * rate**2 + 2.0 * 9.81 * height / 2
    np.testing.assert_allclose(energy, energy[0], rtol=1e-5)
    assert float(rate[0]) == pytest.approx(8.0, rel=1e-9)
    with pytest.raises(AssemblyError, match="joint 'motor' is not met"):
        fb.simulate(motor_pendulum, duration=0.2, start=second, **options)


def motor_and_beam():
    """A motor that turns a beam by a spring of torsion, against a controlled force and a spring."""
    beam = fb.Beam(
        length=0.5, height=0.01, width=0.01, density=7800.0, youngs_modulus=2e9,
        poissons_ratio=0.3, elements=2,
    )  # fmt: skip
    return fb.Mechanism(
        bodies={"hub": fb.RigidBody(mass=1.0, inertia=0.02), "b": beam},
        joints={
            "O": fb.Revolute("hub", (0.0, 0.0)),
            "A": fb.Revolute("b.start", (0.0, 0.0)),
            "motor": fb.PrescribedRotation("hub", lambda t: 200.0 * np.asarray(t) ** 2),
        },
        loads={
            "torsion": fb.TorsionSpring("b.start", "hub", stiffness=300.0, damping=0.1),
            "pull": fb.Spring("b.end", (1.0, 0.2), stiffness=50.0),
            "lag": fb.ForceLaw(["b.end"], lags, states={"s": 0.3}),
        },
        sensors={"tip": fb.Position("b.end"), "s": fb.LawState("lag", "s", "N")},
    )


def lags(t, x, v, s, p, force, rate):
    force[0, 0] = -s[0]
    rate[0] = (3.0 * x[0, 0] - s[0]) / 0.05


def in_contact():
    """A ball that rebounds from the floor with the speed of its approach in memory."""
    law = contact.KeepsRestitution(stiffness=2e4, restitution=0.4)
    return fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0, position=(0.0, 0.1), velocity=(0.0, -1.0))},
        loads={
            "floor": contact.Contact(
                "m", (0.0, 0.0), contact.CircleOnLine(radius=0.0, normal=(0.0, 1.0)), law
            ),
            "g": fb.Gravity(),
        },
        sensors={"x": fb.Position("m"), "v": fb.Velocity("m")},
    )


@pytest.mark.parametrize(
    ("model", "tolerance", "bound"),
    [(motor_and_beam, None, 1e-10), (motor_and_beam, 1e-7, 1e-10), (in_contact, 1e-9, 1e-12)],
)
def test_a_motion_that_goes_on_unchanged_is_the_whole_motion(model, tolerance, bound):
    options = {"step": 1e-3, "integrator": fb.GeneralizedAlpha(step_tolerance=tolerance)}
    full_motion = fb.simulate(model(), duration=0.2, **options)
    half = fb.simulate(model(), duration=0.1, keep_state=True, **options)
    rest = fb.simulate(model(), duration=0.1, start=half, **options)
    error = np.abs(full_motion.values[:, 100:] - rest.values).max()
    assert error < bound * np.ptp(full_motion.values, axis=1).max()


def test_a_contact_goes_on_with_the_speed_of_its_approach():
    """The ball is cut in two in the middle of its contact."""
    full_motion = fb.simulate(in_contact(), duration=0.2, step=1e-3)
    deepest = int(np.argmin(full_motion.sel(output="x_Y").values))
    assert full_motion.sel(output="x_Y")[deepest] < 0
    half = fb.simulate(in_contact(), duration=1e-3 * deepest, step=1e-3, keep_state=True)
    rest = fb.simulate(in_contact(), duration=0.2 - 1e-3 * deepest, step=1e-3, start=half)
    np.testing.assert_allclose(rest, full_motion[:, deepest:], rtol=0, atol=1e-12)


@pytest.mark.parametrize("closed_at_start", [False, True])
def test_a_closed_stop_that_is_moved_deeper_is_refused_with_its_depth(closed_at_start):
    """A mass that is pressed against a stop goes on against one that is 10 mm nearer."""

    def mass_on_stop(upper):
        rubber = contact.KeepsRestitution(stiffness=1e6, exponent=1.0, restitution=0.5)
        stop = contact.Stop("m", (0.0, 0.0), rubber, upper=upper, closed_at_start=closed_at_start)
        return fb.Mechanism(
            bodies={"m": fb.PointMass(mass=1.0, velocity=(1.0, 0.0))},
            joints={"guide": fb.Slot("m", (0.0, 0.0))},
            loads={"stop": stop, "force": fb.Force("m", 100.0, 0.0)},
            sensors={"x": fb.Position("m")},
        )

    first = fb.simulate(mass_on_stop(0.01), duration=0.2, step=0.02, keep_state=True)
    assert first.sel(output="x_X").values[-1] > 0.01
    second = fb.simulate(mass_on_stop(0.01), duration=0.1, step=0.02, start=first)
    assert np.isfinite(second.values).all()
    if closed_at_start:
        fb.simulate(mass_on_stop(0.0), duration=0.1, step=0.02, start=first)
    else:
        with pytest.raises(
            AssemblyError, match=r"contact 'stop' is closed at the start, by 0\.010"
        ):
            fb.simulate(mass_on_stop(0.0), duration=0.1, step=0.02, start=first)


def test_samples_go_on_alone_as_with_others():
    mass = np.linspace(0.5, 5.0, 9)
    batch = latch_motion(mass)
    single_run = latch_motion(mass[8])
    assert np.array_equal(batch[8], single_run)
    assert batch.attrs["lost_energy"][8] == single_run.attrs["lost_energy"][0]


def test_one_sample_of_parameters_goes_on_from_many_states():
    first = fb.simulate(
        carriages(np.array([1.0, 2.0]), False), duration=0.2, step=0.02, keep_state=True
    )
    motion = fb.simulate(carriages(1.0, True), duration=0.1, step=0.02, start=first)
    np.testing.assert_allclose(motion.sel(output="a_X")[:, -1], [0.5, 0.5], rtol=1e-12)


def rebound(mass):
    """Return the speed after the latch: a function of the inputs that calls simulate twice."""
    return np.reshape(latch_motion(mass).sel(output="a_X").isel(time=-1).values, (-1, 1))


def test_a_study_of_two_simulations():
    inputs = {"mass": fb.Interval(1.0, 2.0)}
    bands = fb.propagate(rebound, inputs, fb.PCCI(random_order=1, interval_order=6))
    np.testing.assert_allclose(bands["mean"].values.ravel(), [0.5, 0.8], rtol=1e-6)


def test_refusals():
    first = fb.simulate(carriages(1.0, False), duration=0.2, step=0.02, keep_state=True)
    model = carriages(1.0, True)

    def goes_on(mechanism=model, **options):
        return fb.simulate(mechanism, duration=0.1, step=0.02, **{"start": first, **options})

    with pytest.raises(InputError, match="got a result without a state"):
        goes_on(start=first.drop_attrs())
    with pytest.raises(InputError, match=r"the whole result .* until t = 0\.2 s; got a part"):
        goes_on(start=first.isel(time=slice(3)))
    with pytest.raises(InputError, match="period"):
        goes_on(period=0.1)
    with pytest.raises(InputError, match="keep_state must be True or False"):
        goes_on(keep_state=1)
    larger_model = replace(model, bodies={**model.bodies, "c": fb.PointMass(mass=1.0)})
    with pytest.raises(InputError, match="body 'c' must be in the motion that goes on; there is a"):
        goes_on(larger_model)
    bodies = {**model.bodies, "b": fb.RigidBody(mass=3.0, inertia=1.0)}
    with pytest.raises(InputError, match="body 'b' must have the same mesh"):
        goes_on(replace(model, bodies=bodies))
    two_samples = fb.simulate(
        carriages(np.array([1.0, 2.0]), False), duration=0.2, step=0.02, keep_state=True
    )
    with pytest.raises(InputError, match="as many samples as the mechanism, 3, or one; got 2"):
        goes_on(carriages(np.array([1.0, 2.0, 3.0]), True), start=two_samples)
    with pytest.raises(InputError, match="write a function that calls simulate twice"):
        fb.dynamic_response(carriages, duration=0.1, step=0.02, start=first)
