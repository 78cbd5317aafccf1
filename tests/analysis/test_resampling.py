"""Responses over an angle instead of time, against closed forms."""

import json
import pickle

import cloudpickle
import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import flexband as fb
from flexband.cli.application import app
from flexband.errors import InputError, ResolutionWarning, RunError
from flexband.execution.fingerprint import fingerprint
from flexband.report.page.charts import chart_data
from flexband.report.page.given import study_motion
from flexband.report.text.requirement_verdicts import verdict_line
from flexband.study.start_vibrations import start_vibrations
from tests.study.test_start_vibrations import SPEED, pulled

ROD = 0.45
TURN = np.linspace(0.0, 360.0, 73)
OverOutput = fb.analysis.OverOutput


def slider_crank(angle, crank=0.2):
    """A rigid slider–crank; the slider's place is `place` of the crank's angle."""
    return fb.Mechanism(
        bodies={
            "crank": fb.RigidBody(mass=1.0, inertia=0.01, points={"pin": (crank, 0.0)}),
            "rod": fb.RigidBody(
                mass=1.0, inertia=0.01, position=(crank, 0.0), points={"far": (ROD, 0.0)}
            ),
            "slider": fb.PointMass(mass=1.0, position=(crank + ROD, 0.0)),
        },
        joints={
            "shaft": fb.Revolute("crank", (0.0, 0.0)),
            "motor": fb.PrescribedRotation("crank", angle),
            "pin": fb.Revolute("rod", "crank.pin"),
            "end": fb.Revolute("slider", "rod.far"),
            "guide": fb.Slot("slider", (0.0, 0.0)),
        },
        sensors={"crank angle": fb.Angle("crank"), "slider": fb.Position("slider")},
    )


def place(degrees, crank=0.2):
    angle = np.radians(degrees)
    return crank * np.cos(angle) + np.sqrt(ROD**2 - (crank * np.sin(angle)) ** 2)


def over_crank(builder, step, values=TURN, duration=1.2):
    response = fb.dynamic_response(builder, duration=duration, step=step)
    return OverOutput(response, "crank angle", values, unit="deg")


def closed_form(times, wobble=0.3, turns=1.0):
    """Return an angle that rises with a wobble, and functions of it."""

    def response(scale):
        angle = np.asarray(scale)[:, None] * turns * (times + wobble * np.sin(times))
        values = np.stack([angle, np.sin(3 * angle), np.exp(angle / 7)], axis=1)
        coords = {"output": ["angle", "sine", "power"], "time": times}
        return xr.DataArray(
            values, {**coords, "unit": ("output", ["rad", "m", "1"])}, ("sample", "output", "time")
        )

    return response


def test_at_constant_speed_the_values_are_those_of_times():
    def builder(speed):
        return slider_crank(lambda t: speed * t)

    response = fb.dynamic_response(builder, duration=1.0, step=0.01)
    speed = np.array([2 * np.pi, 3 * np.pi])
    result = OverOutput(response, "crank angle", TURN[::2], unit="deg")(speed=speed)
    times = response(speed=speed)
    assert result.dims == ("sample", "output", "crank angle")
    assert result["output"].values.tolist() == ["slider_X", "slider_Y"]
    assert result["crank angle"].attrs == {"units": "deg"}
    at = [0, 25, 50, 75, 100]  # every 90°
    x = result.sel(output="slider_X").values
    x_at_times = times.sel(output="slider_X").values
    assert np.allclose(x[0, ::9], x_at_times[0, at], rtol=0, atol=1e-12)
    assert np.allclose(x, place(TURN[::2]), rtol=0, atol=2e-6)


@pytest.mark.parametrize("rise", [0.0, 0.4])
def test_bands_over_the_angle_depend_on_no_drive(rise):
    def builder(speed, crank):
        angle = fb.ramp(speed, rise).integral if rise else lambda t: speed * t * (1 + t)
        return slider_crank(angle, crank)

    inputs = {"speed": fb.Interval(6.3, 8.0), "crank": fb.Interval(0.199, 0.201)}
    bands = fb.propagate(over_crank(builder, 2e-3), inputs, fb.PCCI(0, 2))
    low, high = bands["mean"].sel(output="slider_X").values
    ends = place(TURN[:, None], np.array([0.199, 0.201]))
    assert np.allclose(low, ends.min(axis=1), rtol=0, atol=2e-7)
    assert np.allclose(high, ends.max(axis=1), rtol=0, atol=2e-7)
    fixed_crank = fb.propagate(over_crank(builder, 2e-3), inputs | {"crank": 0.2}, fb.PCCI(0, 2))
    assert (
        np.ptp(fixed_crank["error_bar"].values, axis=0).max() < 2e-8
    )  # the speed alone does nothing


def test_the_error_falls_with_the_fourth_power_of_the_step():
    values = np.linspace(0.0, 6.0, 61)
    errors = []
    for count in (201, 401, 801):
        response = OverOutput(closed_form(np.linspace(0.0, 7.0, count)), "angle", values)
        sine, power = response(scale=[1.0])[0].values
        errors.append(np.abs(sine - np.sin(3 * values)).max())
        assert np.abs(power - np.exp(values / 7)).max() < errors[-1]
    assert np.array(errors[:-1]) / errors[1:] == pytest.approx([16.0, 16.0], rel=0.2)
    assert errors[1] < 1e-6


def test_times_that_are_far_apart_are_warned_of_with_about_the_true_error():
    values = np.linspace(0.0, 6.0, 61)
    with pytest.warns(
        ResolutionWarning, match=r"sine over angle .* about 0\.\d+ % of its"
    ) as records:
        result = OverOutput(closed_form(np.linspace(0.0, 7.0, 71)), "angle", values)(scale=[1.0])
    estimate = float(str(records[0].message).split("about ")[1].split(" %")[0]) / 100
    true = np.abs(result[0, 0].values - np.sin(3 * values)).max() / 2
    assert 0.5 * true < estimate < 3 * true


def test_a_run_does_not_depend_on_the_others_and_angles_may_fall():
    response = OverOutput(
        closed_form(np.linspace(0.0, 7.0, 401)), "angle", np.linspace(0.0, 5.0, 41)
    )
    scale = np.array([1.0, 1.3, 2.0])
    batch = response(scale=scale)
    for k in range(3):
        assert np.array_equal(response(scale=scale[k : k + 1]).values[0], batch.values[k])
    falling = closed_form(np.linspace(0.0, 7.0, 401), turns=-1.0)
    backwards = OverOutput(falling, "angle", np.linspace(-5.0, 0.0, 41))(scale=scale)
    assert np.allclose(backwards[:, 0, ::-1], -batch[:, 0], rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    ("wobble", "values", "message"),
    [
        (1.5, [0.0, 5.0], r"sample 0 at 2\.\d+ s: angle turns back: it goes from 0 to 7.9"),
        (0.3, [0.0, 8.0], r"does not reach all values: it goes from 0 to 7.*, not over 0 to 8 rad"),
        (0.3, [-1.0, 5.0], "does not reach all values"),
    ],
)
def test_runs_that_do_not_pass_each_value_once_fail_by_name(wobble, values, message):
    times = np.linspace(0.0, 7.0, 401)
    with pytest.raises(RunError, match=message) as error:
        OverOutput(closed_form(times, wobble), "angle", values)(scale=np.array([1.0, 4.0]))
    assert error.value.failures.keys() >= {0}
    if values[1] == 8.0:  # the other run is kept
        assert error.value.failures.keys() == {0}
        assert np.isfinite(error.value.results.values[1]).all()
    later_turn = OverOutput(closed_form(times, 1.5), "angle", [0.0, 0.5])  # it turns back later
    assert np.isfinite(later_turn(scale=[1.0])).all()


def test_failed_runs_of_the_response_are_kept_apart():
    inner = closed_form(np.linspace(0.0, 7.0, 401))

    def response(scale):
        results = inner(scale)
        results[1] = np.nan
        raise RunError("sample 1 fails", {1: (0.5, "no reason")}, results)

    over_angle = OverOutput(response, "angle", [0.0, 5.0])
    with pytest.raises(RunError, match=r"^sample 1 fails$") as error:
        over_angle(scale=[1.0, 2.0, 3.0])
    assert error.value.failures == {1: (0.5, "no reason")}
    expected = OverOutput(inner, "angle", [0.0, 5.0])(scale=[1.0, 3.0])
    assert np.array_equal(error.value.results.values[[0, 2]], expected)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda r: OverOutput(r, "angle", [1.0, 1.0]), "values must be two numbers or more that"),
        (lambda r: OverOutput(r, "angle", [0.0, np.inf]), "values must be finite numbers"),
        (lambda r: OverOutput(r, "angle", [[0.0, 1.0]]), "values must be two numbers or more"),
        (lambda r: OverOutput(3, "angle", [0.0, 1.0]), "response must be a function"),
        (lambda r: OverOutput(r, "none", [0, 1])(scale=[1.0]), "output must be one of angle"),
        (lambda r: OverOutput(r, "angle", [0, 1], unit="mm")(scale=[1.0]), "a unit for rad; got"),
        (
            lambda r: OverOutput(lambda scale: np.ones((1, 3)), "angle", [0, 1])(scale=[1.0]),
            r"dims \(sample, output, time\)",
        ),
        (
            lambda r: OverOutput(fb.models.elsewhere("a", outputs=["b"]), "b", [0, 1]),
            "got one run elsewhere",
        ),
    ],
)
def test_what_does_not_fit_is_refused_by_name(make, message):
    with pytest.raises(InputError, match=message):
        make(closed_form(np.linspace(0.0, 7.0, 401)))


def test_it_is_what_the_response_is():
    inner = closed_form(np.linspace(0.0, 7.0, 401))
    over_angle = OverOutput(fb.models.samplewise(lambda scale: inner([scale])), "angle", [0.0, 5.0])
    assert over_angle.one_by_one
    assert not over_angle.refines
    moving = over_crank(lambda crank: slider_crank(np.sin, crank), 1e-3)
    assert moving.refines
    refinement = moving.refinements(crank=0.2)["step"]
    assert refinement.source.step == 5e-4
    assert refinement.output == "crank angle"
    copy = pickle.loads(cloudpickle.dumps(moving))
    assert fingerprint(copy) == fingerprint(moving) != fingerprint(refinement)


def test_numbers_per_turn():
    angle = np.linspace(0.0, 720.0, 721)
    values = (1 + 0.5 * (angle > 360)) * np.sin(np.radians(angle))
    response = xr.DataArray(
        values[None], {"angle": ("angle", angle, {"units": "deg"})}, ("sample", "angle")
    )
    peaks = fb.analysis.Peak(period=360)(response)
    assert peaks.dims == ("sample", "turn")
    assert peaks["turn"].values.tolist() == [1.0, 2.0]
    assert np.allclose(peaks, [[1.0, 1.5]], rtol=0, atol=1e-6)
    assert np.allclose(fb.analysis.PeakTime(period=360)(response), [[90.0, 450.0]])
    assert np.allclose(fb.analysis.RootMeanSquare(period=360)(response) ** 2, [[0.5, 1.125]])
    spectrum = fb.analysis.Spectrum(period=360)(response[:, :-1])
    assert spectrum.sizes == {"sample": 1, "frequency": 181, "turn": 1}
    assert spectrum[0, 1, 0] == pytest.approx(1.0, abs=0.01)
    for period, message in ((800.0, "at most 720"), (1.0, "have three times"), (-1.0, "positive")):
        with pytest.raises(InputError, match=message):
            fb.analysis.Peak(period=period)(response)


def test_a_study_over_the_angle_is_drawn_limited_and_answered_over_it(tmp_path):
    def builder(crank):
        return slider_crank(fb.ramp(12.0, 0.2).integral, crank)

    values = np.linspace(360.0, 720.0, 25)
    case = fb.Study(
        over_crank(builder, 4e-3, values, duration=1.2),
        {"crank": fb.Interval(0.199, 0.201)},
        fb.AdaptivePCCI(tolerance=0.05),
        requirements=fb.Requirement("slider_X", below=0.64, during=(500.0, 720.0)),
    )
    result = case.run_in(tmp_path / "run", fb.RunOptions(verification_runs=0))
    assert result.bands.attrs["runs_between"] == 8
    assert chart_data(result.bands)["x"]["unit"] == "deg"
    motion, _ = study_motion(case, samples=0)
    assert motion["places"]["shape"] == motion["times"]["shape"]
    assert "m at crank angle 720 deg (worst" in verdict_line(result.verdicts[0])
    command = ["derived", str(tmp_path / "run"), "peak", "slider_X", "--period", "360", "--json"]
    answer = json.loads(CliRunner().invoke(app, command).stdout)
    assert answer["mean"][1] == pytest.approx(ROD + 0.201, abs=1e-5)


def test_vibrations_from_the_start_are_found_over_an_output_too():
    def with_cart(tare):
        mechanism = pulled(lambda t: SPEED * t)(tare)
        return fb.Mechanism(
            bodies=mechanism.bodies, joints=mechanism.joints, loads=mechanism.loads,
            sensors={"cart": fb.Position("cart"), "load": fb.Position("load")},
        )  # fmt: skip

    response = fb.dynamic_response(with_cart, duration=4.0, step=5e-3)
    over_cart = OverOutput(response, "cart_X", np.linspace(0.0, 2.0, 201))
    case = fb.Study(over_cart, {"tare": fb.Interval(-0.4, 0.4)}, fb.PCCI(0, 1))
    surrogate = case.expand()
    (vibration,) = start_vibrations(case, surrogate, surrogate.bands())
    assert vibration.output == "load_X"
