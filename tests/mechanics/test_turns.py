"""Angles count turns from those that bodies are given, in one sample and in a study."""

import numpy as np
import pytest

import flexband as fb
from flexband.sensors import Average, Integral, Largest, Smallest

TAU = 2 * np.pi
LEVER = {"e": (0.5, 0.0)}


def about(point, turn):
    """Return a point of the ground after all has turned about the origin."""
    c = np.cos(turn)
    s = np.sin(turn)
    return c * point[0] - s * point[1], s * point[0] + c * point[1]


def chain(kind, numbers, turn):
    """Return two levers or a lever and a beam with loads on their angles, turned as a whole."""
    first, bend, rest, stiffness, side = numbers
    end = about((0.5 * np.cos(first), 0.5 * np.sin(first)), turn)
    bodies = {
        "a": fb.RigidBody(mass=1.0, inertia=0.1, angle=first + turn, points=LEVER),
        "b": fb.Beam(
            length=0.4, height=0.02, width=0.02, density=2700.0, youngs_modulus=5e8,
            poissons_ratio=0.3, elements=2, start=end, angle=first + bend + turn,
        )
        if kind == "beam"
        else fb.RigidBody.bar(
            length=0.4, height=0.02, width=0.02, density=2700.0,
            start=end, angle=first + bend + turn,
        ),
    }  # fmt: skip
    start = "b.start"
    joints = {"o": fb.Revolute("a", (0.0, 0.0)), "j": fb.Revolute(start, "a.e")}
    pull = about((3.0, -7.0), turn)
    loads = {
        "g": fb.Gravity(*pull),
        "ground": fb.TorsionSpring("a", stiffness=stiffness, rest_angle=first + rest + turn),
        "between": fb.TorsionSpring(start, "a", stiffness=2.0, rest_angle=bend - rest),
    }
    match kind:
        case "table":
            table = fb.loads.Characteristic([-1.0, 0.5, 3.0], place=[-1.0, 0.0, 2.0])
            loads["motor"] = fb.TorsionSpring("a", torque=table, rest_angle=first + turn + side)
        case "bushing":
            loads["rubber"] = fb.loads.Bushing(
                start, "a.e", stiffness=(0.0, 0.0, 5.0), rest=(0.0, 0.0, bend + rest)
            )
        case "stop":
            law = fb.contact.KeepsRestitution(stiffness=50.0, restitution=0.6, exponent=1.0)
            limits = {"lower": first + turn - 0.2, "upper": first + turn + 0.1}
            loads["stop"] = fb.contact.AngularStop("a", (0.0, 0.0), law, **limits)
        case "brake":
            loads["brake"] = fb.contact.Brake("a", (0.0, 0.0), force=3.0, friction=0.2, radius=0.1)
        case "gear":
            joints["j"] = fb.Revolute(start, about((0.3, 0.0), turn))
            joints["gear"] = fb.Gear("a", start, 0.1, 0.2)
        case "drive":
            way = fb.ramp(to=0.2, duration=0.2)
            joints["drive"] = fb.PrescribedRotation("a", lambda t: first + turn + way(t))
        case "moment" | "beam":
            loads["M"] = fb.Moment("b.end", 0.05)
    sensors = {
        "a": fb.Angle("a"), "b": fb.Angle("b.end"), "most": Largest(fb.Angle("b.end")),
        "least": Smallest(fb.Angle("a")), "mean": Average(fb.Angle("a"), (0.0, 0.1)),
        "M": fb.SpringMoment("ground"), "p": fb.Position("b.end"),
    }  # fmt: skip
    return fb.Mechanism(bodies=bodies, joints=joints, loads=loads, sensors=sensors)


pytestmark = pytest.mark.filterwarnings("ignore:.*is it degrees")
KINDS = ["plain", "table", "bushing", "stop", "brake", "gear", "drive", "moment", "beam"]


@pytest.mark.parametrize("kind", KINDS)
def test_a_mechanism_that_is_turned_as_a_whole_moves_alike(kind):
    """23 draws of each kind, whole turns included, as samples of one batch."""
    rng = np.random.default_rng(KINDS.index(kind))
    count = 23
    numbers = rng.uniform([-3, -3, -0.3, 1, -0.5], [3, 3, 0.3, 20, 0.5], (count, 5)).T
    turn = np.where(np.arange(count) % 3, rng.uniform(-3, 3, count), 0.0)
    turn += TAU * rng.integers(-1, 2, count)
    step = 2e-4 if kind == "beam" else 1e-3
    if kind == "gear":  # gears have the line of centres that their radii need
        numbers[1] = rng.uniform(-1, 1, count)
    reference, rotated_motion = (
        fb.simulate(chain(kind, numbers, angle), duration=0.1, step=step) for angle in (0.0, turn)
    )
    names = ["a", "b", "most", "least", "mean", "M_angle"]
    shift = rotated_motion.sel(output=names) - reference.sel(output=names)
    tolerance = 2e-6 if kind in ("stop", "brake") else 1e-8
    np.testing.assert_allclose(
        shift, np.broadcast_to(turn[:, None, None], shift.shape), rtol=0, atol=tolerance
    )
    np.testing.assert_allclose(
        rotated_motion.sel(output="M_M"), reference.sel(output="M_M"), rtol=0, atol=30 * tolerance
    )
    x, y = (reference.sel(output=name).values.T for name in ("p_X", "p_Y"))
    np.testing.assert_allclose(
        rotated_motion.sel(output=["p_X", "p_Y"]).transpose("output", "time", "sample"),
        about((x, y), turn), rtol=0, atol=tolerance,
    )  # fmt: skip


def test_a_sample_has_the_same_bits_alone():
    rng = np.random.default_rng(5)
    numbers = rng.uniform([-3, -3, -0.3, 1, -0.5], [3, 3, 0.3, 20, 0.5], (6, 5)).T
    batch = fb.simulate(chain("table", numbers, 0.0), duration=0.1, step=1e-3)
    for k in range(6):
        single_run = fb.simulate(chain("table", numbers[:, k], 0.0), duration=0.1, step=1e-3)
        np.testing.assert_array_equal(single_run, batch[k])


def test_a_spring_is_wound_by_the_angles_that_are_drawn():
    """At 3.2 rad against a rest of 3.0 rad, and at 180° ± 6° against one of 170°."""
    angles = np.array([3.2, *np.radians([174.0, 177.0, 183.0, 186.0])])
    rest = np.array([3.0, *np.radians([170.0] * 4)])
    lever = fb.Mechanism(
        bodies={"l": fb.RigidBody(mass=1.0, inertia=0.5, angle=angles)},
        joints={"o": fb.Revolute("l", (0.0, 0.0))},
        loads={"t": fb.TorsionSpring("l", stiffness=2.0, rest_angle=rest)},
        sensors={"w": fb.AngularVelocity("l"), "t": fb.SpringMoment("t")},
    )
    motion = fb.simulate(lever, duration=1.0, step=1e-3)
    twist = angles - rest
    np.testing.assert_allclose(motion.sel(output="t_M", time=0.0), -2.0 * twist, atol=1e-12)
    np.testing.assert_allclose(motion[:, 0, -1], -2.0 * twist * np.sin(2.0), rtol=1e-5)


def test_stops_are_where_the_angles_are_drawn():
    """Between 150° and 190°, on both sides of half a revolution."""
    law = fb.contact.KeepsRestitution(stiffness=1e4, restitution=1.0, exponent=1.0)

    def disc(angles):
        stop = fb.contact.AngularStop(
            "d", (0.0, 0.0), law, lower=np.radians(150.0), upper=np.radians(190.0)
        )
        return fb.Mechanism(
            bodies={"d": fb.RigidBody(mass=1.0, inertia=1.0, angle=angles, rate=1.0)},
            joints={"o": fb.Revolute("d", (0.0, 0.0))},
            loads={"s": stop},
            sensors={"a": fb.Angle("d"), "most": Largest(fb.Angle("d"))},
        )

    motion = fb.simulate(disc(np.radians([160.0, 179.0, 185.0])), duration=1.5, step=1e-3)
    np.testing.assert_allclose(motion.sel(output="most")[:, -1], np.radians(190.0), atol=0.011)
    assert (motion.sel(output="a") > np.radians(149.0)).all()
    with pytest.raises(
        fb.errors.AssemblyError, match=r"'s' is closed at the start, by 5\.67 rad: an"
    ):
        fb.simulate(disc(np.radians(-175.0)), duration=0.1, step=1e-3)


def rotor(**parts):
    return fb.Mechanism(
        bodies={"c": fb.RigidBody(mass=1.0, inertia=1.0, angle=0.5)},
        joints={"o": fb.Revolute("c", (0.0, 0.0))},
        **parts,
    )


def test_the_engine_counts_turns_between_the_times_of_a_result():
    """Spun up to 40 rad/s in 0.2 s, with an output every 0.1 s; then with a new spring."""
    integrator = fb.GeneralizedAlpha(step_tolerance=1e-9)
    sensors = {"a": fb.Angle("c"), "i": Integral(fb.Angle("c")), "l": Largest(fb.Angle("c"))}
    spin = {"M": fb.Moment("c", lambda t: 200.0 * (t < 0.2))}
    options = {"duration": 0.3, "step": 0.1, "integrator": integrator}
    motion = fb.simulate(rotor(loads=spin, sensors=sensors), keep_state=True, **options)
    np.testing.assert_allclose(motion[0], [0.5, 1.5, 4.5, 8.5], rtol=1e-5)
    assert motion.sel(output="l").values[-1] == pytest.approx(8.5, rel=1e-5)
    integral = 0.15 + 200 * 0.2**3 / 6 + 0.1 * 4.0 + 0.5 * 40 * 0.1**2
    assert motion.sel(output="i").values[-1] == pytest.approx(integral, rel=1e-4)
    speed = {"v": fb.AngularVelocity("c")}
    first = fb.simulate(rotor(loads=spin, sensors=speed), keep_state=True, **options)
    spring = {"t": fb.TorsionSpring("c", stiffness=1e-9, rest_angle=8.0)}
    sensors = {"a": fb.Angle("c"), "t": fb.SpringMoment("t")}
    second = fb.simulate(rotor(loads=spring, sensors=sensors), start=first, **options)
    np.testing.assert_allclose(second[0], [8.5, 12.5, 16.5, 20.5], rtol=1e-5)
    np.testing.assert_allclose(second.sel(output="t_M"), -1e-9 * (second[0] - 8.0), rtol=1e-9)


def test_bodies_that_are_drawn_turns_apart_wind_up_a_spring_and_a_warning_says_so():
    pair = fb.Mechanism(
        bodies={
            k: fb.RigidBody(mass=1.0, inertia=1.0, angle=a) for k, a in (("a", 3.1), ("b", -3.1))
        },
        joints={k: fb.Revolute(k, (0.0, 0.0)) for k in "ab"},
        loads={"t": fb.TorsionSpring("a", "b", stiffness=1.0, rest_angle=0.0)},
        sensors={"t": fb.SpringMoment("t")},
    )
    with pytest.warns(fb.errors.FlexbandWarning, match=r"load 't' starts 6\.2 rad from its rest"):
        fb.simulate(pair, duration=1e-3, step=1e-3)


@pytest.mark.parametrize(
    ("sensor", "message"),
    [
        (
            fb.Deflection("b"),
            "this Deflection at every step, .*; that of the Position of the point",
        ),
        (fb.AngularVelocity("b.end"), "; that of the Velocity of points beside it serves"),
        (fb.Reaction("o", axes="body"), "; that of the Reaction in global axes serves"),
        (fb.SectionForces("b"), "; its values at the times of the result serves"),
        (fb.sensors.Power("o"), "; Work, which is its integral, serves in its place"),
    ],
)
def test_what_serves_in_place_of_the_extremes_of_a_sensor(sensor, message):
    beam = fb.Beam(
        length=1.0, height=0.1, width=0.1, density=1.0, youngs_modulus=1e6, poissons_ratio=0.3,
        elements=2,
    )  # fmt: skip
    with pytest.raises(fb.errors.InputError, match=message):
        fb.Mechanism(
            bodies={"b": beam},
            joints={"o": fb.Revolute("b.start", (0.0, 0.0))},
            sensors={"most": Largest(sensor)},
        )


def on_rod(angle):
    """Return a lever at half a revolution that a rod of uncertain length holds."""

    def build(offset):
        start_angle = angle(offset) if callable(angle) else angle
        return fb.Mechanism(
            bodies={"l": fb.RigidBody(mass=1.0, inertia=0.1, angle=start_angle, points=LEVER)},
            joints={
                "o": fb.Revolute("l", (0.0, 0.0)),
                "rod": fb.Distance("l.e", (-0.5, 0.3), 0.3 + offset),
            },
            sensors={"a": fb.Angle("l")},
        )

    return build


@pytest.mark.filterwarnings("ignore:assembly turned")
@pytest.mark.parametrize("method", [fb.PCCI(), fb.LHSScanning(), fb.MonteCarlo()])
@pytest.mark.parametrize(
    ("angle", "turns"),
    [
        (np.pi, 0),
        (np.pi + TAU, 1),
        (-np.pi, -1),
        (np.pi - 0.3, 0),
        (0.3 - np.pi, -1),
        (lambda offset: np.pi - 2 * offset, 0),
        (lambda offset: np.arctan2(2 * offset, -1.0), 0),
        (lambda offset: np.arctan2(2 * offset, -1.0) % TAU, 0),
        (lambda offset: np.arctan2(2 * offset, -1.0) + 3.0 * offset, 0),
    ],
)
def test_samples_on_both_sides_of_half_a_revolution_stay_together(angle, turns, method):
    """With the bands of the same lever at 0, which are those of −2 (L − L₀) for a Taylor series."""
    bands = fb.propagate(
        fb.static_response(on_rod(angle)), {"offset": fb.Normal(0.0, 0.002)}, method
    )
    mean, bar = (float(bands[name].values.ravel()[0]) for name in ("mean", "error_bar_upper"))
    assert mean == pytest.approx(np.pi + TAU * turns, abs=4e-4)
    assert bar - mean == pytest.approx(0.004, rel=0.1)
