"""Functions of one sample that are given as responses by mistake are recognized."""

import math
import warnings

import numpy as np
import pytest
import xarray as xr
from scipy.integrate import solve_ivp

import flexband as fb

INPUTS = {"x": fb.Normal(1.0, 0.1), "e": fb.Interval(0.5, 1.0)}
T = np.linspace(0.0, 1.0, 9)


def with_math(x, e):
    return math.sin(x) * e


def with_a_branch(x, e):
    return x * e if x > 0.5 else 0.5 * e


def with_float(x, e):
    return float(x) * float(e)


def one_number(x, e):
    return float(np.sum(np.ravel(x * e)))


def with_a_solver(x, e):
    return solve_ivp(lambda t, y: -x * y, (0.0, 1.0), [e], t_eval=T, rtol=1e-9).y[0]


def of_as_many_times(x, e):
    """Return (times,), which is the shape (n,) of a method with nine runs."""
    return e * np.exp(-x * T)


def with_labels(x, e):
    values = e * np.exp(-x * T)
    return xr.DataArray([values, values**2], dims=("output", "time"), coords={"time": T})


def stacked_outputs(x, e):
    return [x, e**2, 1.0]


SCALAR = [with_math, with_a_branch, with_float, one_number, with_a_solver, of_as_many_times,
          with_labels, stacked_outputs]  # fmt: skip


@pytest.mark.parametrize("function", SCALAR, ids=lambda f: f.__name__)
def test_the_message_shows_the_line_that_helps(function):
    for call in (fb.propagate, fb.expand):
        with pytest.raises(
            fb.errors.InputError, match=r"response = fb\.models\.samplewise\(response\)$"
        ):
            call(function, INPUTS, fb.PCCI(2, 2))
    study = fb.Study(fb.models.samplewise(function), INPUTS, fb.PCCI(4, 4))
    assert study.run()["mean"].notnull().all()


@pytest.mark.parametrize("domain", [None, (0.0, 1.0)])
def test_a_function_of_one_field_is_recognized(domain):
    def bar(flexibility, load):
        x = np.linspace(0.0, 1.0, 9)
        return load * np.trapezoid(flexibility(x), x)

    field = fb.RandomField(10.0, 1.0, correlation_length=2.0, domain=domain)
    inputs = {"flexibility": field, "load": fb.Interval(1.0, 2.0)}
    bands = fb.propagate(bar, inputs, fb.PCCI(2, 1))  # vectorized as it is
    of_samples = fb.propagate(fb.models.samplewise(bar), inputs, fb.PCCI(2, 1))
    np.testing.assert_allclose(of_samples["mean"], bands["mean"], rtol=1e-12)
    with pytest.raises(fb.errors.InputError, match=r"fb\.models\.samplewise\(response\)"):
        fb.propagate(lambda flexibility, load: float(bar(flexibility, load)), inputs,
                     fb.PCCI(2, 1))  # fmt: skip


def bad_for_one(x, e):
    if np.any(x < 0.9):
        raise ArithmeticError("too small")
    return x * e


@pytest.mark.parametrize(
    ("response", "error"),
    [
        (bad_for_one, ArithmeticError),  # vectorized: samples fail, not arrays
        (lambda x, e: x[:, None][0], fb.errors.InputError),
        (lambda x, e: undefined, NameError),  # noqa: F821
        (lambda x, e: {"u": x}, fb.errors.InputError),
    ],
)
def test_other_errors_are_told_with_the_inputs(response, error):
    with pytest.raises((fb.errors.RunError, fb.errors.InputError)) as failure:
        fb.propagate(response, INPUTS, fb.PCCI(2, 2))
    message = str(failure.value)
    assert "samplewise" not in message
    if error is not fb.errors.InputError:
        assert isinstance(failure.value.__cause__, error)
        assert f"the response raised {error.__name__}: " in message
        assert "inputs of the 9 runs of the call: e from 0.5" in message


@pytest.mark.parametrize("scalar", [lambda h: max(h, 0.0), math.fabs], ids=["max", "fabs"])
def test_a_builder_of_one_mechanism_is_recognized(scalar):
    def falling(height, mass):
        body = fb.PointMass(mass=mass, position=(0.0, scalar(height)))
        return fb.Mechanism(bodies={"m": body}, loads={"g": fb.Gravity()},
                            sensors={"m": fb.Position("m")})  # fmt: skip

    inputs = {"height": fb.Interval(1.0, 2.0), "mass": fb.Normal(1.0, 0.1)}
    response = fb.dynamic_response(falling, duration=0.1, step=0.01)
    with pytest.raises(fb.errors.InputError, match=r"fb\.models\.samplewise\(response\)"):
        fb.propagate(response, inputs, fb.PCCI(1, 1))
    with pytest.warns(fb.errors.FlexbandWarning, match="input 'mass' changes no output"):
        bands = fb.propagate(fb.models.samplewise(response), inputs, fb.PCCI(1, 1))
    heights = bands["mean"].sel(output="m_Y", time=0.1)
    np.testing.assert_allclose(heights, [1 - 0.5 * 9.81 * 0.01, 2 - 0.5 * 9.81 * 0.01], rtol=1e-4)


@pytest.mark.parametrize("policy", ["stop", "skip"])
def test_failing_runs_are_no_functions_of_one_sample(policy):
    calls = []

    def failing(x, e):
        calls.append(np.shape(x))
        if np.any(x > 1.1):
            raise ArithmeticError("too large")
        return x * e

    method = fb.MonteCarlo(40, 2)
    if policy == "stop":
        with pytest.raises(fb.errors.RunError, match="raised ArithmeticError: too large"):
            fb.propagate(failing, INPUTS, method)
    else:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            fb.propagate(failing, INPUTS, method, failed=policy)
    assert () not in calls[3:]  # tried at the first error only


@pytest.mark.parametrize("method", [fb.PCCI(2, 2), fb.MonteCarlo(20, 3)], ids=repr)
def test_positions_outside_the_domain_of_a_field_are_not_taken_for_one_sample(method):
    def bar(E, L, e):
        return E(np.multiply.outer(L, np.linspace(0.0, 1.0, 5))).mean(axis=-1) * e

    field = fb.RandomField(1.0, 0.1, correlation_length=1.0)
    inputs = {"E": field, "L": fb.Normal(0.9, 0.01), "e": fb.Interval(0.5, 1.0)}
    with pytest.raises(
        fb.errors.InputError, match=r"outside its domain \(0, 0\.9\); give a domain="
    ) as e:
        fb.propagate(bar, inputs, method)
    assert "samplewise" not in str(e.value)


def test_fields_without_a_domain_have_a_row_for_every_run():
    def bar(E, L):
        modulus = E(np.linspace(0.0, 1.0, 5))
        return np.array([modulus[k].mean() * L[k] for k in range(len(L))])

    inputs = {"E": fb.RandomField(1.0, 0.1, correlation_length=1.0), "L": fb.Interval(0.9, 1.0)}
    assert fb.propagate(bar, inputs, fb.PCCI(2, 2))["mean"].shape == (2,)


@pytest.mark.parametrize("domain", [None, (0.0, 1.0)])
def test_a_field_that_is_taken_for_an_array_is_explained(domain):
    inputs = {"E": fb.RandomField(1.0, 0.1, correlation_length=1.0, domain=domain)}
    text = "E: a field is a function of the position. At positions x of shape"
    with pytest.raises(fb.errors.RunError, match=text) as error:
        fb.propagate(lambda E: 2.0 * E, inputs, fb.PCCI(2, 2))
    assert isinstance(error.value.__cause__, TypeError)
