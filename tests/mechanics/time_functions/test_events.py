"""Functions of time that do something between the steps."""

import numpy as np
import pytest

import flexband as fb
from flexband.mechanics.time_functions.tabulation import tabulate

IMPULSE = 500 * 2e-4  # N s


def guided_mass(force, mass=1.0):
    return fb.Mechanism(
        bodies={"p": fb.PointMass(mass=mass)},
        joints={"s": fb.Slot("p", (0.0, 0.0))},
        loads={"f": fb.Force("p", x=force)},
        sensors={"v": fb.Velocity("p"), "x": fb.Position("p")},
    )


def driven_disc(angle):
    return fb.Mechanism(
        bodies={"d": fb.RigidBody(mass=1.0, inertia=0.02)},
        joints={"h": fb.Revolute("d", (0.0, 0.0)), "m": fb.PrescribedRotation("d", angle)},
        sensors={"M": fb.ReactionMoment("m")},
    )


def pulse(start):
    """Return sin 20t N and a pulse of 0.2 ms."""
    return lambda t: np.sin(20 * t) + 500.0 * ((t > start) & (t < start + 2e-4))


@pytest.mark.filterwarnings("ignore:output 'v_X' vibrates")
@pytest.mark.parametrize(("h", "error"), [(5e-3, 9e-4), (2.5e-3, 2e-4), (1.25e-3, 5e-5)])
def test_the_impulse_of_a_short_pulse_is_counted(h, error):
    """The rest is the error of the trapezoidal rule for sin 20t."""
    motion = fb.simulate(guided_mass(pulse(0.1003)), duration=0.2, step=h)
    speed = (1 - np.cos(4)) / 20 + IMPULSE
    assert float(motion.sel(output="v_X")[-1]) == pytest.approx(speed, abs=error * IMPULSE)


@pytest.mark.parametrize("width", [0.025, 0.036, 0.05])
def test_both_ends_of_a_pulse_of_two_points_are_located_wherever_it_is(width):
    """The function is evaluated at 64 points per step."""
    h = 1e-3
    start = h * (100 + np.linspace(0.0, 1.0, 40))

    def force(t):
        return 500.0 * ((t > start) & (t < start + width * h))

    motion = fb.simulate(guided_mass(force), duration=0.2, step=h).sel(output="v_X")
    assert motion[:, -1].values == pytest.approx(500 * width * h, rel=1e-9)


@pytest.mark.parametrize("width", [0.03, 0.38, 2.4])
def test_the_impulse_of_a_smooth_pulse_is_counted_however_short(width):
    """Each sample has a half sine at another place, which lasts a part of a step or some steps."""
    h = 1e-3
    start = 0.1 + np.linspace(0.1, 0.6, 12) * h

    def force(t):
        part = np.clip((t - start) / (width * h), 0.0, 1.0)
        return 100 * np.sin(np.pi * part) * (part < 1)

    motion = fb.simulate(guided_mass(force), duration=0.2, step=h).sel(output="v_X")
    impulse = 100 * width * h * 2 / np.pi
    assert motion[:, -1].values == pytest.approx(impulse, rel=2e-3)
    times = np.arange(201) * h
    limits = tabulate([force], {}, 12, times)[0].limits
    for k, first in enumerate(start):
        ends = [abs(limits[:, k] - end).min() for end in (first, first + width * h)]
        assert max(ends) < 1e-9 * h


@pytest.mark.parametrize("tau", [0.3, 1.0])
@pytest.mark.parametrize("start", [0.0, 0.1003])
def test_what_decays_within_a_step_after_a_jump_is_followed(tau, start):
    h = 1e-3

    def force(t):
        return np.where(t >= start, np.exp(-np.maximum(t - start, 0.0) / (tau * h)), 0.0)

    motion = fb.simulate(guided_mass(force), duration=0.2, step=h).sel(output="v_X")
    t = motion.time.values
    exact = np.where(t >= start, 1 - np.exp(-np.maximum(t - start, 0.0) / (tau * h)), 0.0)
    assert motion.values == pytest.approx(tau * h * exact, abs=5e-3 * tau * h)


def test_a_function_of_one_time_is_looked_at_too():
    def force(t):
        return 500.0 if 0.1003 < t < 0.1005 else 0.0

    motion = fb.simulate(guided_mass(force), duration=0.2, step=1.25e-3)
    assert float(motion.sel(output="v_X")[-1]) == pytest.approx(IMPULSE, rel=1e-9)
    assert float(motion.sel(output="x_X")[-1]) == pytest.approx(IMPULSE * 0.0996, rel=1e-9)


def test_a_sample_with_its_own_pulse_does_not_depend_on_the_others():
    starts = np.linspace(0.05, 0.15, 11) + 3e-4

    def motion(start_times):
        return fb.simulate(guided_mass(pulse(start_times)), duration=0.2, step=1.25e-3).sel(
            output="v_X"
        )

    batch = motion(starts).values
    assert batch[:, -1] == pytest.approx((1 - np.cos(4)) / 20 + IMPULSE, abs=1e-4 * IMPULSE)
    assert np.array_equal(batch[4:6], motion(starts[4:6]))
    assert np.array_equal(batch[::-1], motion(starts[::-1]))


@pytest.mark.parametrize("h", [2.5e-3, 1.25e-3, 6.25e-4])
def test_a_force_above_what_the_step_resolves_is_averaged_and_named(h):
    """At 1.25 and 0.625 ms all values of 800 Hz are zeros."""
    omega = 2 * np.pi * 800
    with pytest.warns(fb.errors.ResolutionWarning, match="has about 800 Hz, which steps"):
        motion = fb.simulate(
            guided_mass(lambda t: 50 * np.sin(omega * t), 0.1), duration=0.2, step=h
        )
    assert float(motion.sel(output="x_X")[-1]) == pytest.approx(500 * 0.2 / omega, rel=0.02)


@pytest.mark.parametrize("h", [5e-3, 1.25e-3])
def test_the_motion_under_a_sudden_force_is_exact(h):
    motion = fb.simulate(guided_mass(lambda t: 1.0 * (t > 0.1003)), duration=0.2, step=h)
    assert float(motion.sel(output="x_X")[-1]) == pytest.approx(0.0997**2 / 2, rel=1e-9)


@pytest.mark.parametrize("at", [0.3, 0.3005])
def test_a_drive_whose_speed_jumps_is_named(at):
    mechanism = driven_disc(lambda t: 3 * np.maximum(0.0, t - at))
    with pytest.warns(fb.errors.ResolutionWarning, match=f"joint 'm' .* rate jumps at t = {at} s"):
        fb.simulate(mechanism, duration=0.6, step=1e-3)


@pytest.mark.parametrize(
    "angle",
    [
        lambda t: 4 * np.pi * t,
        lambda t: 0.2 * np.sin(100 * t),
        lambda t: 0.5 * np.maximum(0.0, t - 0.2) ** 2,
    ],
)
@pytest.mark.filterwarnings("error")
def test_drives_with_a_continuous_speed_are_not_warned_of(angle):
    fb.simulate(driven_disc(angle), duration=0.5, step=1e-3)


def rod(angle):
    """Return a slider-crank whose crank is driven."""
    bar = {"height": 0.02, "width": 0.02, "density": 7800.0}
    return fb.Mechanism(
        bodies={
            "crank": fb.RigidBody.bar(length=0.2, **bar),
            "rod": fb.RigidBody.bar(length=0.5, start=(0.2, 0.0), **bar),
            "slider": fb.RigidBody(mass=5.0, inertia=0.01, position=(0.7, 0.0)),
        },
        joints={
            "A": fb.Revolute("crank.start", (0.0, 0.0)),
            "B": fb.Revolute("rod.start", "crank.end"),
            "C": fb.Revolute("slider", "rod.end"),
            "guide": fb.Prismatic("slider", (0.0, 0.0)),
            "motor": fb.PrescribedRotation("crank", angle),
        },
        sensors={
            "work": fb.Work("motor"),
            "energy": fb.KineticEnergy(),
            "M": fb.ReactionMoment("motor"),
            "x": fb.Position("slider"),
        },
    )


@pytest.mark.filterwarnings("ignore:.*whose rate jumps")
def test_the_energy_balance_counts_the_impulses_of_a_drive():
    """The speed of each sample jumps to 7 rad/s at its time, and back to 2 rad/s 0.2 s later."""
    start = np.array([0.0503, 0.1, 0.1237])

    def angle(t):
        return 7 * np.maximum(0.0, t - start) - 5 * np.maximum(0.0, t - start - 0.2)

    motion = fb.simulate(rod(angle), duration=0.5, step=1e-3)
    work = motion.sel(output="work")
    energy = motion.sel(output="energy")
    assert abs(work - energy).max() < 5e-5 * energy.max()
    final_angle = np.maximum(0.0, 0.5 - start) * 2 + 5 * 0.2
    x = 0.2 * np.cos(final_angle) + np.sqrt(0.25 - 0.04 * np.sin(final_angle) ** 2)
    assert motion.sel(output="x_X")[:, -1].values == pytest.approx(x, abs=1e-9)
    assert "t = 0.0503 to 0.1237 s: M " in motion.attrs["impulses"]


def test_the_impulse_of_a_drive_is_that_of_the_momentum():
    with pytest.warns(fb.errors.ResolutionWarning, match="rate jumps at t = 0.3005 s"):
        motion = fb.simulate(
            driven_disc(lambda t: 3 * np.maximum(0.0, t - 0.3005)), duration=0.6, step=1e-3
        )
    assert motion.attrs["impulses"] == "at t = 0.3005 s: M 0.06 N m s"
    assert float(abs(motion).max()) < 1e-6


@pytest.mark.parametrize("h", [0.01, 0.004])
def test_a_ramp_that_starts_at_an_uncertain_time_is_followed(h):
    """A ramp of 2 ms within a step: the impulse is F (T − t) + F w/2 after a ramp of width w."""
    start = np.linspace(0.0812, 0.1177, 7)
    width = 2e-3

    def force(t):
        return np.clip((t - start) / width, 0.0, 1.0)

    motion = fb.simulate(guided_mass(force), duration=0.2, step=h).sel(output="v_X")
    assert motion[:, -1].values == pytest.approx(0.2 - start - width / 2, abs=5e-5)


def test_a_table_states_its_kinks_and_jumps():
    """A pulse of a thousandth of a step, and one sample without it."""
    times = [0.0, 0.1003, 0.1003, 0.100301, 0.100301]
    heights = np.array([[0.0, 0.0], [0.0, 0.0], [1e5, 0.0], [1e5, 0.0], [0.0, 0.0]])
    motion = fb.simulate(guided_mass(fb.table(times, heights)), duration=0.2, step=1e-3)
    assert motion.sel(output="v_X")[:, -1].values == pytest.approx([0.1, 0.0], rel=1e-8)


def test_a_table_is_linear_between_its_values_and_constant_outside():
    f = fb.table([1.0, 2.0, 2.0, 4.0], [0.0, 1.0, 5.0, 7.0])
    at = [0.0, 1.0, 1.5, np.nextafter(2.0, 0.0), 2.0, 3.0, 4.0, 9.0]
    assert f(np.array(at)) == pytest.approx([0.0, 0.0, 0.5, 1.0, 5.0, 6.0, 7.0, 7.0])


@pytest.mark.parametrize(
    ("times", "values", "message"),
    [
        ([0.0], [1.0], "at least two"),
        ([0.0, 1.0], [1.0], r"shape \(2,\)"),
        ([0.0, 2.0, 1.0], [1.0, 2.0, 3.0], "1 s comes too late"),
        ([0.0, 1.0, 1.0, 1.0], [1.0, 2.0, 3.0, 4.0], "1 s is given more often"),
        ([0.0, np.nan], [1.0, 2.0], "finite"),
    ],
)
def test_tables_that_are_none_are_refused(times, values, message):
    with pytest.raises(fb.errors.InputError, match=message):
        fb.table(times, values)


def trapezoid(rise, fall, speed):
    """Return angle, rate and acceleration of a motor that speeds up and down between four times."""
    ends = (*rise, *fall)
    slopes = speed / np.array(
        [np.diff(rise)[0], -np.diff(rise)[0], -np.diff(fall)[0], np.diff(fall)[0]]
    )

    def derivative(t, power):
        after = [np.maximum(t - end, 0.0) ** power * (t >= end) for end in ends]
        return sum(s * a for s, a in zip(slopes, after, strict=True))

    return tuple(
        lambda t, p=p, c=c: c * derivative(t, p) for p, c in ((2, 0.5), (1, 1.0), (0, 1.0))
    )


PROFILE = trapezoid((0.0503, 0.1237), (0.3119, 0.3851), 8.0)


@pytest.mark.filterwarnings("ignore:output 'M' vibrates")
@pytest.mark.parametrize("h", [0.01, 2.5e-3])
def test_the_moment_of_a_trapezoidal_speed_profile_is_that_of_its_acceleration(h):
    """Its moment jumps within steps; the speed of each sample is another."""
    angle, _, acceleration = PROFILE
    factor = np.array([0.3, 1.0])
    motion = fb.simulate(driven_disc(lambda t: factor * angle(t)), duration=0.5, step=h)
    exact = 0.02 * factor[:, None] * acceleration(motion.time.values)
    assert "impulses" not in motion.attrs
    assert motion.sel(output="M").values == pytest.approx(exact, abs=3e-3 * h * exact.max())


@pytest.mark.parametrize(("h", "error"), [(0.01, 2e-4), (5e-3, 3e-5), (2.5e-3, 1e-5)])
def test_the_moment_of_a_slider_crank_converges_across_jumps_of_the_acceleration(h, error):
    """M = J θ̈ + J′ θ̇²/2, with the crank's moment of inertia J(θ), relative to the largest."""
    angle, rate, acceleration = PROFILE
    motion = fb.simulate(rod(angle), duration=0.5, step=h)
    t = motion.time.values

    def inertia(theta):
        m = 7800.0 * 0.02**2 * np.array([0.2, 0.5])
        r = 0.2
        L = 0.5
        bar = [m[k] * (length**2 + 0.02**2) / 12 for k, length in enumerate((r, L))]
        sine = -r / L * np.sin(theta)
        cosine = np.sqrt(1 - (r / L * np.sin(theta)) ** 2)
        turn = -r / L * np.cos(theta) / cosine  # dφ/dθ of the rod
        middle = (-r * np.sin(theta) - L / 2 * sine * turn) ** 2 + (r * np.cos(theta) / 2) ** 2
        slider = -r * np.sin(theta) - L * sine * turn
        crank = bar[0] + m[0] * r**2 / 4
        return crank + m[1] * middle + bar[1] * turn**2 + 5.0 * slider**2

    slope = np.imag(inertia(angle(t) + 1e-20j)) / 1e-20
    exact = inertia(angle(t)) * acceleration(t) + slope * rate(t) ** 2 / 2
    deviation = abs(motion.sel(output="M").values - exact).max()
    assert deviation < error * abs(exact).max()
