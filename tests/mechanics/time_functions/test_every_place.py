"""Every function of time that flexband offers, in every place that takes one."""

import warnings

import numpy as np
import pytest
from scipy.integrate import quad

import flexband as fb

END = 1.0
BREAKS = (0.1, 0.3, 0.5, 0.6)
COLUMNS = np.array([1.0, 0.5, -0.7])
CONTINUOUS = {
    "table from the start on": fb.table([0.0, 2.0], [0.0, 0.6]),
    "table that begins before": fb.table([-1.0, 2.0], [-0.3, 0.6]),
    "table that begins later": fb.table([0.1, 2.0], [0.0, 0.6]),
    "table to the end": fb.table([0.0, 1.0], [0.0, 0.6]),
    "table with a kink": fb.table([0.0, 0.5, 2.0], [0.0, 0.3, 0.1]),
    "table with a kink at the start": fb.table([-1.0, 0.0, 2.0], [0.0, 0.0, 0.6]),
    "table of columns": fb.table([0.0, 0.5, 2.0], np.outer([0.0, 0.3, 0.1], COLUMNS)),
    "ramp": fb.ramp(to=0.6, duration=0.5),
    "integral": fb.ramp(to=0.6, duration=0.5).integral,
    "ramp of samples": fb.ramp(to=0.6 * COLUMNS, duration=0.5),
    "NumPy's interpolation": lambda t: np.interp(t, [0.0, 0.5, 2.0], [0.0, 0.3, 0.1]),
    "function of Python": lambda t: 0.3 * t * t,
    "function of NumPy": lambda t: 0.2 * np.sin(3.0 * t),
}
SMOOTH = {
    name
    for name in CONTINUOUS
    if name == "table with a kink at the start"
    or not any(word in name for word in ("later", "kink", "columns", "interpolation"))
}
JUMPING = {
    "table with a jump": fb.table([0.0, 0.3, 0.3, 2.0], [0.2, 0.2, 0.5, 0.5]),
    "table with a jump at the start": fb.table([-1.0, 0.0, 0.0, 2.0], [0.0, 0.0, 0.5, 0.5]),
    "step": lambda t: 0.4 if t > 0.3 else 0.1,
    "pulse": lambda t: np.where((t > 0.3) & (t < 0.6), 0.5, 0.1),
}
STEPS = [None, 1e-8]
DISC = fb.RigidBody(mass=2.0, inertia=0.5)


def constant(t, x, v, p, force):
    force[0, 0] = p[0]


def body_with_drive(place, function):
    """Return a body with a drive; output "s" is what it prescribes."""
    rail = {"rail": fb.Prismatic("b", (0.0, 0.0))}
    joints = {
        "rotation": {
            "pin": fb.Revolute("b", (0.0, 0.0)),
            "d": fb.PrescribedRotation("b", function),
        },
        "travel": {**rail, "d": fb.PrescribedTravel("b", (0.0, 0.0), function)},
        "path": {"d": fb.PrescribedPath("b", function, lambda t: 0.0 * t)},
        "distance": {**rail, "d": fb.Distance("b", (-1.0, 0.0), lambda t: 1.0 + function(t))},
    }[place]
    sensor = fb.Angle("b") if place == "rotation" else fb.Position("b")
    sensors = {"s": sensor, "W": fb.Work("d"), "T": fb.KineticEnergy()}
    return fb.Mechanism(bodies={"b": DISC}, joints=joints, sensors=sensors)


def body_with_load(place, function):
    """Return a body with a load, its momentum over the integral of the load, and its speed."""
    rail = {"r": fb.Slot("b", (0.0, 0.0))}
    pin = {"r": fb.Revolute("b", (0.0, 0.0))}
    flat = fb.loads.Characteristic([1.0, 1.0], place=[-1.0, 1.0], factor=function)
    law = fb.ForceLaw(["b"], constant, parameters=[function])
    load, joints = {
        "force": (fb.Force("b", x=function), rail),
        "moment": (fb.Moment("b", function), pin),
        "pull": (fb.Spring("b", (5.0, 0.0), rest_length=1.0, pull=function), rail),
        "torque": (fb.TorsionSpring("b", torque=function), pin),
        "factor": (fb.TorsionSpring("b", torque=flat, rest_angle=0.0), pin),
        "parameter": (law, rail),
    }[place]
    rotation = joints is pin
    return fb.Mechanism(
        bodies={"b": DISC}, joints=joints, loads={"l": load},
        sensors={"v": fb.AngularVelocity("b") if rotation else fb.Velocity("b")},
    ), 0.5 if rotation else 2.0  # fmt: skip


@pytest.mark.filterwarnings("ignore:.*whose rate jumps", "ignore:assembly turned")
@pytest.mark.filterwarnings("ignore:left out")
@pytest.mark.parametrize("tolerance", STEPS)
@pytest.mark.parametrize("place", ["rotation", "travel", "path", "distance"])
@pytest.mark.parametrize("name", CONTINUOUS)
def test_a_drive_follows_it_and_does_the_work(name, place, tolerance):
    function = CONTINUOUS[name]
    integrator = fb.GeneralizedAlpha(step_tolerance=tolerance)
    model = body_with_drive(place, function)
    motion = fb.simulate(model, duration=END, step=0.01, integrator=integrator)
    times = motion["time"].values
    values = np.array([np.broadcast_to(function(t), len(COLUMNS)) for t in times])
    positions = np.atleast_2d(motion.isel(output=0).values)
    np.testing.assert_allclose(positions, values.T[: len(positions)], rtol=0, atol=1e-9)
    work, energy = (motion.sel(output=key).values for key in "WT")
    energy_change = energy - energy[..., :1]
    np.testing.assert_allclose(work, energy_change, rtol=0, atol=1e-5 + 2e-3 * energy.max())
    if name in SMOOTH:
        assert "impulses" not in motion.attrs
    at = fb.equilibrium(model, time=0.7)
    exact = np.broadcast_to(function(0.7), len(COLUMNS))
    np.testing.assert_allclose(at[..., 0], exact[: at[..., 0].size].squeeze(), rtol=0, atol=1e-9)


@pytest.mark.parametrize("place", ["force", "moment", "pull", "torque", "factor", "parameter"])
@pytest.mark.parametrize("name", CONTINUOUS | JUMPING)
def test_a_load_gives_its_impulse(name, place):
    function = (CONTINUOUS | JUMPING)[name]
    adaptive = place in ("moment", "factor")
    integrator = fb.GeneralizedAlpha(step_tolerance=1e-8 if adaptive else None)
    model, inertia = body_with_load(place, function)
    motion = fb.simulate(model, duration=END, step=0.01, integrator=integrator)
    speeds = np.atleast_2d(motion.isel(output=0).values)[:, -1]
    for k, speed in enumerate(speeds):
        of_sample = lambda t, k=k: np.broadcast_to(function(t), len(COLUMNS))[k]  # noqa: E731
        impulse = quad(of_sample, 0.0, END, points=BREAKS, limit=200)[0]
        assert inertia * speed == pytest.approx(impulse, abs=2e-5)


@pytest.mark.filterwarnings("ignore:.*whose rate jumps")
@pytest.mark.parametrize("name", CONTINUOUS)
def test_a_study_takes_it(name):
    """Scaled by an uncertain factor, as the drive of a rotation."""
    if "columns" in name or "samples" in name:
        pytest.skip("its samples are those of one run")
    function = CONTINUOUS[name]

    def build(scale):
        return body_with_drive("rotation", lambda t: np.multiply.outer(function(t), scale))

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        response = fb.dynamic_response(build, duration=END, step=0.02)
        bands = fb.propagate(response, {"scale": fb.Interval(0.9, 1.1)}, fb.PCCI(0, 2))
    upper = bands["mean"].sel(output="s", bound="upper").values
    values = np.array([function(t) for t in bands["time"].values])
    np.testing.assert_allclose(upper, np.maximum(0.9 * values, 1.1 * values), atol=1e-9)
