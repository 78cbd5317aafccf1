"""Impacts against exact solutions: of free bodies, of Hertz, and of a ball that bounces."""

import numpy as np
import pytest

import flexband as fb
from flexband import contact

LAWS = (
    contact.KeepsRestitution,
    contact.HuntCrossley,
    contact.LankaraniNikravesh,
    contact.Flores,
)


def integrator_of(tolerance, **options):
    return fb.GeneralizedAlpha(step_tolerance=tolerance, **options)


@pytest.mark.parametrize(
    ("law", "effective"),
    [
        (contact.KeepsRestitution, (0.9, 0.5, 0.1)),
        (contact.LankaraniNikravesh, (0.913, 0.725, 0.665)),
        (contact.HuntCrossley, (0.909, 0.663, 0.516)),
        (contact.Flores, (0.894, 0.470, 0.069)),
    ],
)
def test_the_effective_restitution_of_laws_is_that_of_the_literature(law, effective):
    contact_law = law(stiffness=1.0, restitution=np.array([0.9, 0.5, 0.1]))
    np.testing.assert_allclose(contact_law.effective_restitution, effective, rtol=0, atol=6e-4)


def test_restitutions_near_one_are_kept():
    e = 1.0 - np.geomspace(1e-8, 0.98, 60)
    law = contact.KeepsRestitution(stiffness=1.0, restitution=e)
    np.testing.assert_allclose(law.effective_restitution, e, rtol=0, atol=1e-9)
    assert float(contact.KeepsRestitution(stiffness=1.0).damping(np.array(1.0))) == 0.0


def two_bodies(law):
    """A ball that overtakes a heavier one; both have a radius of 0.1 m."""
    return fb.Mechanism(
        bodies={
            "a": fb.PointMass(mass=1.0, position=(0.0, 0.0), velocity=(2.5, 0.0)),
            "b": fb.PointMass(mass=3.0, position=(0.3, 0.0), velocity=(0.5, 0.0)),
        },
        loads={"c": contact.Contact("a", "b", contact.CircleOnCircle(radii=(0.1, 0.1)), law)},
        sensors={
            "a": fb.Velocity("a"),
            "b": fb.Velocity("b"),
            "c": contact.Contacts("c", first=2),
        },
    )


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("exponent", [1.0, 1.5])
def test_free_bodies_part_with_the_effective_restitution(law, exponent):
    contact_law = law(
        stiffness=1e8, restitution=np.array([0.9, 0.5, 0.1]), exponent=exponent
    )  # fmt: skip
    tolerance = 1e-10 if exponent == 1.0 else 1e-9
    motion = fb.simulate(
        two_bodies(contact_law), duration=0.1, step=0.01, integrator=integrator_of(tolerance)
    ).isel(time=-1)
    e = (motion.sel(output="b_X") - motion.sel(output="a_X")) / 2.0
    np.testing.assert_allclose(e, contact_law.effective_restitution, rtol=0, atol=1e-5)
    momentum = motion.sel(output="a_X") + 3.0 * motion.sel(output="b_X")
    np.testing.assert_allclose(momentum, 4.0, rtol=1e-9)
    energy_loss = 0.5 * 0.75 * 4.0 * (1.0 - contact_law.effective_restitution**2)
    np.testing.assert_allclose(motion.sel(output="c_energy"), energy_loss, rtol=1.5e-4)
    np.testing.assert_array_equal(motion.sel(output="c_number"), 1.0)
    np.testing.assert_allclose(motion.sel(output="c_t1"), 0.05, rtol=1e-7)
    assert np.isnan(motion.sel(output="c_t2")).all()


def floor(law, **ball):
    return fb.Mechanism(
        bodies={"ball": fb.PointMass(**ball)},
        loads={"c": contact.Contact("ball", (0.0, 0.0), contact.CircleOnLine(), law)},
        sensors={
            "x": fb.Position("ball"),
            "v": fb.Velocity("ball"),
            "low": fb.sensors.Smallest(fb.Position("ball")),
            "c": contact.Contacts("c", first=10),
        },
    )


def test_an_impact_without_damping_is_that_of_hertz():
    """The duration is 2.94328 δ/v, the depth δ = (5mv²/4K)^(2/5), the force K δ^1.5."""
    m = 2.0
    K = np.array([1e8, 1e10])
    v = 1.5
    model = floor(
        contact.KeepsRestitution(stiffness=K), mass=m, position=(0.0, 0.01), velocity=(0.0, -v)
    )
    integrator = integrator_of(1e-9, spectral_radius=1.0)
    motion = fb.simulate(model, duration=0.02, step=0.002, integrator=integrator).isel(time=-1)
    depth = (5.0 * m * v * v / (4.0 * K)) ** 0.4
    speed = motion.sel(output="v_Y").values
    contact_time = 0.02 - motion.sel(output="x_Y").values / speed - 0.01 / v
    np.testing.assert_allclose(speed, v, rtol=1e-5)
    np.testing.assert_allclose(contact_time, 2.94328 * depth / v, rtol=1e-4)
    np.testing.assert_allclose(motion.sel(output="low_Y"), -depth, rtol=2e-4)
    np.testing.assert_allclose(motion.sel(output="c_force"), K * depth**1.5, rtol=3e-4)


def test_a_ball_bounces_at_the_instants_of_its_restitution():
    """The first ten in the stiff limit, v ← e v, for each law with its own e′."""
    g = 9.81
    height = 1.0
    for law in LAWS:
        contact_law = law(stiffness=1e12, restitution=np.array([0.7, 0.8]))
        model = floor(contact_law, mass=1.0, position=(0.0, height))
        model = fb.Mechanism(
            bodies=model.bodies,
            loads={**model.loads, "g": fb.Gravity(y=-g)},
            sensors={"c": model.sensors["c"]},
        )
        motion = fb.simulate(model, duration=4.5, step=0.1, integrator=integrator_of(1e-8))
        first = np.sqrt(2.0 * height / g)
        e = contact_law.effective_restitution[:, None]
        flights = 2.0 * first * e ** np.arange(1, 10)
        instants = first + np.concatenate([np.zeros((2, 1)), np.cumsum(flights, axis=1)], axis=1)
        outputs = [f"c_t{k}" for k in range(1, 11)]
        in_run = instants < 4.5
        impact_times = motion.isel(time=-1).sel(output=outputs).values
        np.testing.assert_allclose(impact_times[in_run], instants[in_run], rtol=1e-3)
        assert in_run.sum() >= 15


@pytest.mark.parametrize("rate", [2.0, -2.0])
def test_an_angular_stop_turns_a_bar_back(rate):
    """Two bars on one pivot, of inertias J and 3J: they part with e, and their momentum is kept."""
    e = np.array([0.9, 0.5])
    law = contact.KeepsRestitution(stiffness=1e8, restitution=e)
    model = fb.Mechanism(
        bodies={"a": fb.RigidBody(mass=1.0, inertia=0.2, rate=rate),
                "b": fb.RigidBody(mass=1.0, inertia=0.6)},
        joints={"A": fb.Revolute("a", (0.0, 0.0)), "B": fb.Revolute("b", (0.0, 0.0))},
        loads={"stop": contact.AngularStop("a", "b", law, lower=-0.1, upper=0.1)},
        sensors={"a": fb.AngularVelocity("a"), "b": fb.AngularVelocity("b"),
                 "c": contact.Contacts("stop", first=1, angular=True)},
    )  # fmt: skip
    motion = fb.simulate(model, duration=0.1, step=0.01, integrator=integrator_of(1e-10)).isel(
        time=-1
    )
    a = motion.sel(output="a").values
    b = motion.sel(output="b").values
    np.testing.assert_allclose(b - a, e * rate, rtol=1e-5)
    np.testing.assert_allclose(0.2 * a + 0.6 * b, 0.2 * rate, rtol=1e-7)
    np.testing.assert_allclose(motion.sel(output="c_t1"), 0.05, rtol=1e-6)


def on_spring(law, **options):
    """A mass on a spring whose rest is at a stop: it returns every π/10 s."""
    model = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0, position=(1.0, 0.0))},
        joints={"guide": fb.Slot("m", (0.0, 0.0))},
        loads={
            "stop": contact.Stop("m", (0.0, 0.0), law, lower=0.0),
            "k": fb.Spring("m", (-2.0, 0.0), stiffness=100.0, rest_length=2.0),
        },
        sensors={
            "x": fb.Position("m"),
            "v": fb.Velocity("m"),
            "c": contact.Contacts("stop", first=0),
        },
    )
    motion = fb.simulate(model, duration=3.2, step=0.1, **options)
    energy = 50.0 * motion.sel(output="x_X") ** 2 + 0.5 * motion.sel(output="v_X") ** 2
    number = motion.sel(output="c_number").values[-1]
    return float(1.0 - energy.values[-1] / 50.0) / number, number


def test_impacts_without_damping_lose_an_energy_that_the_tolerance_states():
    law = contact.KeepsRestitution(stiffness=1e8)
    losses = {}
    for radius in (1.0, 0.7):
        for tolerance in (1e-6, 1e-8):
            loss, number = on_spring(
                law, integrator=integrator_of(tolerance, spectral_radius=radius)
            )
            assert number == 10
            losses[radius, tolerance] = abs(loss)
    assert losses[1.0, 1e-8] < 5e-8  # 1e-4 in 1000 impacts is 1e-7
    assert losses[0.7, 1e-8] < 5e-7
    assert losses[1.0, 1e-8] < losses[1.0, 1e-6] / 5


def test_impacts_slower_than_the_least_speed_are_damped_less():
    law = contact.KeepsRestitution(stiffness=1e6, restitution=0.5, least_speed=1.0)
    slow_impact = floor(law, mass=1.0, position=(0.0, 1e-3), velocity=(0.0, -0.01))
    fast_impact = floor(law, mass=1.0, position=(0.0, 1e-3), velocity=(0.0, -2.0))
    speeds = [
        fb.simulate(model, duration=0.5, step=0.1).isel(time=-1).sel(output="v_Y")
        for model in (slow_impact, fast_impact)
    ]
    assert 0.0098 < speeds[0] < 0.01
    assert float(speeds[1]) == pytest.approx(1.0, abs=2e-3)


def test_a_sample_does_not_depend_on_its_neighbours():
    restitution = np.linspace(0.3, 1.0, 11)

    def motion(e):
        law = contact.KeepsRestitution(stiffness=1e9, restitution=e)
        model = floor(law, mass=1.0, position=(0.0, 0.05), velocity=(0.1, -1.0))
        model = fb.Mechanism(
            bodies=model.bodies, loads={**model.loads, "g": fb.Gravity()}, sensors=model.sensors
        )
        return fb.simulate(model, duration=0.3, step=0.03).values

    batch = motion(restitution)
    order = np.random.default_rng(0).permutation(11)
    np.testing.assert_array_equal(motion(restitution[order]), batch[order])
    for k in (0, 5, 10):
        np.testing.assert_array_equal(motion(float(restitution[k])), batch[k])
        clones = motion(np.full(8, restitution[k]))
        np.testing.assert_array_equal(clones, np.broadcast_to(batch[k], clones.shape))


@pytest.mark.parametrize("step", [0.05, 0.02, 0.01, 0.005])
@pytest.mark.parametrize("speed", [2.0, 2.0 * (1 - 2e-16), 2.0 * (1 + 3e-16), 1.99])
def test_an_impact_at_an_output_time_is_one(step, speed):
    """A mass that reaches the stop at 0.05 s, where a step ends with a gap of zero."""
    mass = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0, position=(0.0, 0.0), velocity=(speed, 0.0))},
        joints={"guide": fb.Slot("m", (0.0, 0.0))},
        loads={
            "stop": fb.contact.Stop(
                "m", (0.0, 0.0),
                fb.contact.KeepsRestitution(stiffness=1e8, restitution=0.5),
                upper=0.1,
            )
        },
        sensors={"v": fb.Velocity("m")},
    )  # fmt: skip
    motion = fb.simulate(mass, duration=0.1, step=step)
    assert float(motion.sel(output="v_X")[-1]) == pytest.approx(-0.5 * speed, rel=3e-4)
