"""Parts with friction: rolling, pins in holes, gears, freewheels, and what is refused."""

import numpy as np
import pytest

import flexband as fb

g = 9.81
RUBBER = fb.contact.KeepsRestitution(stiffness=1e7, exponent=1.0, restitution=0.5)


def at(result, output):
    return result.sel(output=output).values


def disc(speed, *, radius=0.1, friction=0.2, **loads):
    body = fb.RigidBody(
        mass=1.0, inertia=0.5 * radius**2, position=(0.0, radius - g / 1e7), velocity=(speed, 0.0)
    )
    floor = fb.contact.CircleOnLine(radius=radius)
    contact = fb.contact.Contact("disc", (0.0, 0.0), floor, RUBBER, True, friction)
    return fb.Mechanism(
        bodies={"disc": body},
        loads={"gravity": fb.Gravity(), "floor": contact, **loads},
        sensors={
            "x": fb.Position("disc"),
            "turn": fb.AngularVelocity("disc"),
            "floor": fb.contact.FrictionForce("floor"),
        },
    )


@pytest.mark.parametrize(("inside", "sign"), [(True, 1.0), (False, -1.0)])
def test_a_disc_rolls_in_a_bowl_and_from_a_ball(inside, sign):
    """With the distance c of the centres, 1.5 c φ̈ = ∓g sin φ."""
    radius = 0.1
    other_radius = 1.0
    start = 0.3
    distance = other_radius - radius if inside else other_radius + radius
    kind = fb.contact.CircleInCircle if inside else fb.contact.CircleOnCircle
    place = distance * np.sin(start), -sign * distance * np.cos(start)
    mechanism = fb.Mechanism(
        bodies={"disc": fb.RigidBody(mass=1.0, inertia=0.5 * radius**2, position=place)},
        loads={
            "gravity": fb.Gravity(),
            "rolls": fb.contact.Contact(
                "disc", (0.0, 0.0), kind(radii=(radius, other_radius)), RUBBER, True, 2.0
            ),
        },
        sensors={"x": fb.Position("disc"), "v": fb.Velocity("disc")},
    )
    motion = fb.simulate(mechanism, duration=0.3, step=0.01)
    speed = np.hypot(at(motion, "v_X"), at(motion, "v_Y"))[-1]
    drop = at(motion, "x_Y")[0] - at(motion, "x_Y")[-1]
    assert speed == pytest.approx(np.sqrt(4 / 3 * g * drop), rel=2e-4)


def test_a_pin_with_play_slows_down_as_one_without():
    """A flywheel on a pin in a hole loses r sin(arctan µ) m g in both models."""
    moment = 0.01 * np.sin(np.arctan(0.1)) * 2.0 * g
    speeds = []
    for pin in (
        {"radius": 0.01},
        {"radius": 0.01, "clearance": 1e-4, "law": RUBBER},
    ):
        wheel = fb.Mechanism(
            bodies={"wheel": fb.RigidBody(mass=2.0, inertia=0.02, rate=-2.0)},
            joints={"pin": fb.Revolute("wheel", (0.0, 0.0), friction=0.1, **pin)},
            loads={"gravity": fb.Gravity(), "air": fb.ViscousFriction("wheel", (0.0, 0.0), 20.0)},
            sensors={"turn": fb.AngularVelocity("wheel")},
        )
        motion = fb.simulate(wheel, duration=1.0, step=0.1)
        speeds.append(at(motion, "turn")[-1] - at(motion, "turn")[5])
    assert speeds[0] == pytest.approx(moment / 0.02 * 0.5, rel=1e-4)
    assert speeds[1] == pytest.approx(speeds[0], rel=0.02)  # the hole is 1 % larger than the pin


@pytest.mark.parametrize("efficiency", [0.9, 0.5])
@pytest.mark.parametrize("driver", ["wheel", "pinion"])
def test_the_efficiency_of_gears_is_that_of_power(efficiency, driver):
    """Held in balance, the driven gear has the efficiency times the moment of ideal gears."""
    drive_radius = 0.2 if driver == "wheel" else 0.1
    load_radius = 0.1 if driver == "wheel" else 0.2
    driven_gear, sign = ("pinion", 1.0) if driver == "wheel" else ("wheel", -1.0)
    train = fb.Mechanism(
        bodies={
            "wheel": fb.RigidBody(mass=1.0, inertia=1e-2, rate=1.0),
            "pinion": fb.RigidBody(mass=1.0, inertia=1e-2, position=(0.3, 0.0), rate=-2.0),
        },
        joints={
            "a": fb.Revolute("wheel", (0.0, 0.0)),
            "b": fb.Revolute("pinion", (0.3, 0.0)),
            "mesh": fb.Gear("wheel", "pinion", 0.2, 0.1, efficiency=efficiency),
        },
        loads={
            "drive": fb.Moment(driver, sign),
            "load": fb.Moment(driven_gear, sign * efficiency * load_radius / drive_radius),
        },
        sensors={"turn": fb.AngularVelocity("wheel")},
    )
    integrator = fb.GeneralizedAlpha(step_tolerance=1e-9, spectral_radius=1.0)
    motion = fb.simulate(train, duration=0.5, step=0.05, integrator=integrator)
    np.testing.assert_allclose(at(motion, "turn"), 1.0, rtol=1e-7)


def test_a_freewheel_lets_go_and_holds():
    """Under the moment 1 − t it turns by 2/3 rad until 2 s, and holds what is more than that."""
    shaft = fb.Mechanism(
        bodies={"shaft": fb.RigidBody(mass=1.0, inertia=0.5)},
        joints={"axle": fb.Revolute("shaft", (0.0, 0.0))},
        loads={
            "freewheel": fb.contact.OneWayClutch("shaft", (0.0, 0.0)),
            "moment": fb.Moment("shaft", lambda t: 1.0 - t),
        },
        sensors={
            "turn": fb.Angle("shaft"),
            "freewheel": fb.contact.FrictionForce("freewheel", angular=True),
        },
    )
    motion = fb.simulate(shaft, duration=4.0, step=0.5)
    assert at(motion, "turn")[2] == pytest.approx(2 / 3, rel=1e-4)
    np.testing.assert_allclose(at(motion, "turn")[5:], 4 / 3, rtol=1e-4)
    np.testing.assert_allclose(at(motion, "freewheel")[[5, 8]], [1.5, 3.0], rtol=1e-9)


def test_bristles_bend_until_they_slide():
    """Pulled with the speed u from z = 0, z = g/σ₀ (1 − exp(−σ₀ u t/g)); the line turns."""
    u = 0.02
    numbers = {"stiffness": 1e4, "damping": 30.0, "viscous": 5.0, "stribeck_speed": 0.05}
    guide = {"angle": 0.7, "points": {"end": (0.3, 0.0)}}
    mechanism = fb.Mechanism(
        bodies={
            "m": fb.PointMass(mass=1.0, position=(0.3, 0.1)),
            "bed": fb.RigidBody(mass=1.0, inertia=1.0, **guide),
        },
        joints={
            "bed": fb.Weld("bed", (0.0, 0.0), 0.7),
            "drive": fb.PrescribedTravel("m", "bed", lambda t: 0.3 + u * np.asarray(t)),
            "line": fb.Slot("m", "bed"),
        },
        loads={"felt": fb.contact.LuGre("m", "bed", 2.0, 3.0, **numbers)},
        sensors={"z": fb.LawState("felt", "z", "m"), "F": fb.Reaction("drive")},
    )
    motion = fb.simulate(mechanism, duration=0.05, step=1e-4)
    t = motion["time"].values
    level = 2.0 + np.exp(-((u / 0.05) ** 2))
    decay = np.exp(-1e4 * u * t / level)
    np.testing.assert_allclose(at(motion, "z"), level / 1e4 * (1 - decay), atol=2e-8)
    force = np.hypot(at(motion, "F_X"), at(motion, "F_Y"))
    exact = level * (1 - decay) + 30.0 * u * decay + 5.0 * u
    np.testing.assert_allclose(force[5:], exact[5:], rtol=1e-3)


def sledge(friction=0.3, **joints):
    return fb.Mechanism(
        bodies={"m": fb.RigidBody(mass=2.0, inertia=0.1, velocity=(1.0, 0.0))},
        joints={"guide": fb.Prismatic("m", (0.0, 0.0), length=0.5, friction=friction), **joints},
        loads={"gravity": fb.Gravity()},
        sensors={"x": fb.Position("m")},
    )


def test_friction_that_sticks_goes_on_where_it_is():
    full_motion = fb.simulate(sledge(), duration=0.6, step=0.05)
    first = fb.simulate(sledge(), duration=0.4, step=0.05, keep_state=True)
    second = fb.simulate(sledge(), duration=0.2, step=0.05, start=first)
    np.testing.assert_allclose(at(second, "x_X"), at(full_motion, "x_X")[8:], rtol=0, atol=1e-12)


def test_samples_with_friction_do_not_depend_on_each_other():
    mus = np.array([0.1, 0.3, 0.05, 0.7])
    batch = fb.simulate(sledge(mus), duration=0.4, step=0.05)
    for k, mu in enumerate(mus):
        single_run = fb.simulate(sledge(mu), duration=0.4, step=0.05)
        np.testing.assert_array_equal(batch[k], single_run)


def test_what_has_friction_sticks_in_modes():
    """A pendulum whose pin sticks has only its second degree of freedom."""

    def model(friction):
        return fb.Mechanism(
            bodies={
                "a": fb.PointMass(mass=1.0),
                "b": fb.PointMass(mass=1.0, position=(1.0, 0.0)),
            },
            joints={
                "a": fb.Slot("a", (0.0, 0.0), friction=friction),
                "b": fb.Slot("b", (0.0, 0.0)),
            },
            loads={
                "g": fb.Gravity(),
                "first": fb.Spring("a", (-1.0, 0.0), 100.0, rest_length=1.0),
                "second": fb.Spring("a", "b", 100.0, rest_length=1.0),
            },
            sensors={"x": fb.Position("b")},
        )

    smooth_modes = fb.modes(model(None), count=2, about="start")
    sticking_modes = fb.modes(model(0.2), count=1, about="start")
    assert float(smooth_modes.frequency[0]) * 2 * np.pi == pytest.approx(
        10 * (np.sqrt(5) - 1) / 2, rel=1e-6
    )
    assert float(sticking_modes.frequency[0]) * 2 * np.pi == pytest.approx(10.0, rel=1e-6)


def test_equilibrium_says_that_it_leaves_friction_out():
    with pytest.warns(fb.errors.FlexbandWarning, match="friction of 'guide' is left out"):
        rest = fb.equilibrium(
            fb.Mechanism(
                bodies={"m": fb.PointMass(mass=2.0)},
                joints={"guide": fb.Slot("m", (0.0, 0.0), axis=(0.0, 1.0), friction=0.3)},
                loads={"gravity": fb.Gravity(), "spring": fb.Spring("m", (0.0, 1.0), 1e3, 1.0)},
                sensors={"x": fb.Position("m")},
            )
        )
    assert at(rest, "x_Y") == pytest.approx(-2.0 * g / 1e3)


def test_friction_of_a_shared_reaction_is_refused():
    with pytest.raises(fb.errors.InputError, match="friction of joint 'guide' depends"):
        fb.simulate(sledge(other=fb.Slot("m", (0.0, 0.0))), duration=0.1, step=0.05)


@pytest.mark.parametrize(
    "part",
    [
        {"loads": {"brake": fb.contact.Brake("m", (0.0, 0.0), 0.3, 0.1, 1.0)}},
        {"joints": {"brake": fb.Revolute("m", (0.0, 0.0), friction=0.3, radius=0.1)}},
    ],
)
def test_a_point_mass_does_not_turn_against_friction(part):
    with pytest.raises(fb.errors.InputError, match="friction of 'brake' must be against something"):
        fb.simulate(
            fb.Mechanism(
                bodies={"m": fb.PointMass(mass=1.0)}, sensors={"x": fb.Position("m")}, **part
            ),
            duration=0.1,
            step=0.05,
        )


@pytest.mark.filterwarnings("ignore::flexband.errors.ResolutionWarning")
def test_a_belt_whose_speed_jumps_drags_with_its_friction():
    def path(t):
        return np.where(t < 0.05, t, 0.05 + 2 * (t - 0.05))

    mechanism = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0), "belt": fb.PointMass(mass=1.0)},
        joints={
            "motor": fb.PrescribedPath("belt", path, lambda t: 0.0),
            "felt": fb.Slot("m", "belt", friction=0.3),
        },
        loads={"weight": fb.Force("m", 0.0, -1.0)},
        sensors={"x": fb.Position("m")},
    )
    motion = fb.simulate(mechanism, duration=0.1, step=0.01)
    np.testing.assert_allclose(motion[0], 0.15 * motion["time"] ** 2, rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("build", "message"),
    [
        (lambda: fb.contact.Coulomb(kinetic=-0.1), "Coulomb kinetic must be .*-0.1"),
        (lambda: fb.contact.Coulomb(kinetic=0.3, static=0.2), "at least kinetic; got 0.2 and 0.3"),
        (lambda: fb.contact.Coulomb(kinetic=0.3, stribeck_speed=0.0), "stribeck_speed .*got 0"),
        (lambda: fb.contact.Coulomb(kinetic=0.3, viscous=-1.0), "viscous .*-1"),
        (lambda: fb.Revolute("a", "b", friction=0.1), "radius .*with friction.*got 0"),
        (lambda: fb.Revolute("a", "b", radius=0.1, friction=-0.1), "Revolute friction .*-0.1"),
        (lambda: fb.Prismatic("a", "b", friction=0.1), "needs the length of the slider"),
        (lambda: fb.Slot("a", "b", friction="rough"), "Slot friction .*rough"),
        (lambda: fb.Gear("a", "b", 0.1, 0.1, efficiency=1.2), "at most 1; got 1.2"),
        (lambda: fb.Rack("a", "b", 0.1, efficiency=0.0), "Rack efficiency .*got 0"),
        (lambda: fb.contact.Brake("a", "b", 0.3, 0.1, -1.0), "Brake force .*-1"),
        (lambda: fb.contact.Clutch("a", "b", 0.3, 0.0, 1.0), "Clutch radius .*got 0"),
        (lambda: fb.contact.OneWayClutch("a", "b", sense=2), "1 or -1; got 2"),
        (lambda: fb.contact.LuGre("a", "b", 2.0, 1.0, 1e4), "at least kinetic; got 1.0 and 2.0"),
        (lambda: fb.contact.LuGre("a", "b", 0.0, 1.0, 1e4), "LuGre kinetic .*got 0"),
        (lambda: fb.contact.LuGre("a", "b", 1.0, 1.0, -1.0), "LuGre stiffness .*-1"),
        (
            lambda: disc(1.0, wall=fb.contact.Contact(
                "disc", (0.0, 0.0), fb.contact.CircleOnLine(ends=(0.0, 1.0)), RUBBER, True, 0.1)),
            "ends .*must be None with friction",
        ),
    ],
)  # fmt: skip
def test_what_friction_cannot_be_is_refused(build, message):
    with pytest.raises(fb.errors.InputError, match=message):
        build()
