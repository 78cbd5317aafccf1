"""Inputs of a user's own: propagated, saved and loaded."""

from dataclasses import dataclass

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

import flexband as fb


@dataclass(frozen=True)
class OfMedian(fb.Input):
    """A positive number whose logarithm is normally distributed."""

    median: float
    scatter: float

    def value(self, standard):
        return self.median * np.exp(self.scatter * standard[:, 0])

    def standard(self, value):
        return np.log(value / self.median) / self.scatter


@dataclass(frozen=True)
class Tolerance(fb.Input):
    """A nominal value with a tolerance, in parts of another interval."""

    nominal: float
    part: fb.Interval
    note: str | None = None

    random = False

    def value(self, standard):
        return self.nominal * (1 + self.part.value(standard))

    def standard(self, value):
        return self.part.standard(value / self.nominal - 1)


INPUTS = {"a": OfMedian(2.0, 0.1), "b": Tolerance(3.0, fb.Interval(-0.1, 0.2), "as drawn")}


@given(
    st.sampled_from(
        [fb.Interval(-2.0, 5.0), fb.Normal(3.0, 0.5), fb.Uniform(1.0, 4.0), *INPUTS.values()]
    ),
    st.lists(st.floats(-1, 1), min_size=1, max_size=5),
)
def test_standard_variables_and_values_belong_together(quantity, numbers):
    standard = np.array(numbers)[:, None]
    np.testing.assert_allclose(
        quantity.standard(quantity.value(standard)), standard[:, 0], atol=1e-12
    )


def test_a_distribution_and_an_interval_of_the_users_own():
    """E = m e^{s²/2} and its variance of a log-normal number, times the ends of the interval."""
    bands = fb.propagate(lambda a, b: a * b, INPUTS, fb.ImprovedPCCI(8, 1))
    mean = 2 * np.exp(0.005)
    std = mean * np.sqrt(np.exp(0.01) - 1)
    np.testing.assert_allclose(bands["mean"], [2.7 * mean, 3.6 * mean], rtol=1e-9)
    top = 3.6 * (mean + std)
    np.testing.assert_allclose(bands["error_bar"], [2.7 * (mean - std), top], rtol=1e-9)
    np.testing.assert_allclose(bands["mean_at"].sel(input="b"), [2.7, 3.6])


def test_they_are_saved_with_a_surrogate(tmp_path, monkeypatch):
    monkeypatch.setitem(fb.RandomField.correlations, "triangle", triangle)
    field = fb.RandomField(1.0, 0.1, 1.0, domain=[0, 1], terms=2, correlation=triangle)  # type: ignore
    surrogate = fb.expand(
        lambda a, b, f: a * b * f(np.ones(1))[:, 0], INPUTS | {"f": field}, fb.ImprovedPCCI(2, 1)
    )
    fb.save_surrogate(surrogate, tmp_path / "s.npz")
    copy = fb.load_surrogate(tmp_path / "s.npz")
    assert {k: copy.space.inputs[k] for k in INPUTS} == INPUTS
    points = {"a": [1.9, 2.2], "b": 3.0, "f": np.array([[0.0, 1.0]])}
    xr.testing.assert_identical(copy.evaluate(**points), surrogate.evaluate(**points))
    monkeypatch.delitem(fb.RandomField.correlations, "triangle")
    with pytest.raises(fb.errors.InputError, match="the correlation 'triangle' must be"):
        fb.load_surrogate(tmp_path / "s.npz")
    monkeypatch.delitem(fb.Input.kinds, "OfMedian")
    with pytest.raises(
        fb.errors.InputError, match=f"OfMedian must be defined.* import it from {__name__}"
    ):
        fb.load_surrogate(tmp_path / "s.npz")


def triangle(distance):
    return np.maximum(1 - np.abs(distance), 0.0)


def test_bad_inputs_of_the_users_own_are_refused():
    with pytest.raises(
        fb.errors.InputError, match="OfMedian scatter must be finite numbers; got nan"
    ):
        OfMedian(1.0, np.nan)
    with pytest.raises(
        fb.errors.InputError, match="Normal is an input of flexband; give yours another"
    ):
        type("Normal", (fb.Input,), {"__module__": __name__})
