"""Inputs that change no output are named, and no others."""

import functools
import warnings

import numpy as np
import pytest

import flexband as fb
from flexband.uncertainty.inputs.effects import all_have_effects
from flexband.uncertainty.inputs.space import Space

METHODS = [
    fb.PCCI(2, 2), fb.ImprovedPCCI(1, 1), fb.methods.PhaseResolvedPCCI(1, 2), fb.AdaptivePCCI(0.01),
    fb.LHSScanning(20, 3), fb.MonteCarlo(20, 3),
]  # fmt: skip
PAIRED = METHODS[:4]
INPUTS = {
    "a": fb.Interval(1.0, 2.0),
    "b": fb.Interval(-1.0, 1.0),
    "c": fb.Normal(0.0, 1.0),
    "d": fb.Normal(3.0, 1.0),
    "e": fb.RandomField(1.0, 0.1, 5.0, domain=(0.0, 1.0)),
}
TIMES = np.linspace(0.0, 1.0, 5)


def remarks(response, method, inputs=INPUTS):
    """Return the names of the inputs that are remarked on, and the bands."""
    with warnings.catch_warnings(record=True) as records:
        warnings.simplefilter("always")
        bands = fb.propagate(response, inputs, method)
    texts = [str(record.message) for record in records]
    assert all("changes no output" in text for text in texts)
    return {text.split("'")[1] for text in texts}, bands


def over_time(values):
    return np.cos(TIMES) * np.reshape(values, (-1, 1)) + 100.0


def everything(a, b, c, d, e, size=1.0):
    """Every input has an effect, some of them only together with others."""
    values = over_time(a + d)
    values[:, 2] += size * (b * c * (d - 3.0) * (e(np.array([0.5]))[:, 0] - 1.0))
    return values


@pytest.mark.parametrize("method", METHODS, ids=repr)
@pytest.mark.parametrize("size", [1.0, 1e-9])
def test_small_effects_are_effects(method, size):
    names, _ = remarks(functools.partial(everything, size=size), method)
    assert not names


@pytest.mark.parametrize("method", PAIRED, ids=repr)
@pytest.mark.parametrize("idle", ["a", "b", "c", "d", "e"])
def test_inputs_without_effect_are_named(method, idle):
    def response(**values):
        return over_time(
            np.prod(
                [
                    v(np.array([0.5]))[:, 0] if callable(v) else v + 1.5
                    for name, v in values.items()
                    if name != idle
                ],
                axis=0,
            )
            + 0.0 * (values[idle] if idle != "e" else values[idle](np.zeros(1))[:, 0])
        )

    names, bands = remarks(response, method)
    assert names == {idle}
    assert bands.attrs["runs"] <= method.max_runs if isinstance(method, fb.AdaptivePCCI) else True


@pytest.mark.parametrize("method", METHODS[4:], ids=repr)
def test_samples_prove_what_they_can(method):
    def interval(a, b, c, d, e):
        return over_time(a + c + d + 0 * b + e(np.zeros(1))[:, 0])

    def random(a, b, c, d, e):
        return over_time(a + b + 0 * (c + d + e(np.zeros(1))[:, 0]))

    def one_random(a, b, c, d, e):  # the samples have no pairs
        return over_time(a + b + c + 0 * (d + e(np.zeros(1))[:, 0]))

    for response, expected in ((interval, {"b"}), (random, {"c", "d", "e"}), (one_random, set())):
        names, bands = remarks(response, method)
        assert names == expected
        assert bands.attrs["runs"] == 180 + 1


@pytest.mark.parametrize("method", [*METHODS, fb.PCCI(0, 0)], ids=repr)
def test_arguments_that_are_never_read_are_named(method):
    def response(a, b, c, d, e):
        del e
        return over_time(a * c + b)

    assert remarks(response, method)[0] == {"d", "e"}
    cached = functools.wraps(response)(functools.partial(response))
    assert remarks(cached, method)[0] == {"d", "e"}


def test_only_reading_on_all_ways_counts_as_reading():
    def inner(a, b, c, d, e):
        return over_time(sum(v * d for v in (a, b, c))) + [e(np.zeros(1))[k] for k in range(len(a))]

    def by_locals(a, b, c, d, e):
        values = locals()
        return over_time(sum(values[name] for name in "abcd") + e(np.zeros(1))[:, 0])

    @functools.wraps(lambda a, b, c, d, e: over_time(a))
    def around(**values):
        return inner(**values)

    for response in (inner, by_locals, around):
        assert not remarks(response, fb.LHSScanning(5, 2))[0]


def test_products_of_few_points_are_no_proof():
    """With one point of c and d, b has no effect at any run; nothing is claimed."""
    response = functools.partial(everything, size=1.0)
    orders = {"c": 0, "d": 1, "e": 1}
    assert not remarks(response, fb.PCCI(orders, 1))[0]


def test_a_constant_has_no_inputs():
    for method in METHODS:
        assert remarks(lambda **v: np.ones((len(v["a"]), 5)), method)[0] == set(INPUTS)


def test_two_values_are_not_said_to_be_all():
    """The square of a standard variable is the same at −1 and 1, the points of order 1."""

    def response(c):
        return over_time(c**2)

    inputs = {"c": fb.Normal(0.0, 1.0)}
    with pytest.warns(
        fb.errors.FlexbandWarning, match=r"'c' changes no output at the two values of it"
    ):
        fb.propagate(response, inputs, fb.PCCI(1, 1))
    assert not remarks(response, fb.PCCI(2, 1), inputs)[0]


def test_an_interval_of_one_value_is_not_remarked_on():
    inputs = INPUTS | {"b": fb.Interval(1.0, 1.0)}
    for method in METHODS:
        assert not remarks(everything, method, inputs)[0]


def test_a_builder_that_does_not_read_its_argument():
    def builder(length, mass):
        body = fb.PointMass(mass=1.0, position=(length, 0.0), velocity=(1.0, 0.0))
        return fb.Mechanism(bodies={"m": body}, sensors={"x": fb.Position("m")})

    response = fb.dynamic_response(builder, duration=0.02, step=0.01)
    inputs = {"length": fb.Normal(1.0, 0.1), "mass": fb.Normal(1.0, 0.1)}
    assert remarks(response, fb.LHSScanning(4, 2), inputs)[0] == {"mass"}


def test_the_remark_points_to_the_line_of_the_caller():
    with pytest.warns(fb.errors.FlexbandWarning, match="input 'b' changes no output") as records:
        fb.expand(lambda a, b: a[:, None], {k: INPUTS[k] for k in "ab"}, fb.PCCI(1, 1))
    assert records[0].filename == __file__


def test_first_runs_show_that_all_inputs_have_effects():
    space = Space({"a": fb.Interval(0.0, 1.0), "c": fb.Normal(0.0, 1.0)})
    xi = np.array([[0.0], [0.0], [1.0]])
    eta = np.array([[0.0], [1.0], [0.0]])
    assert all_have_effects(space, (xi, eta), xi + eta)
    assert not all_have_effects(space, (xi, eta), 1e-17 * xi + eta + 1.0)
    assert not all_have_effects(space, (xi[:2], eta[:2]), xi[:2] + eta[:2])
