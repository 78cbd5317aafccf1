"""Coefficients that are formed where they are needed, and runs in memory that they grow in."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import flexband as fb
from flexband.uncertainty.adaptive.adaptation import Adaptation
from flexband.uncertainty.adaptive.nested_design import NestedDesign
from flexband.uncertainty.adaptive.response_runs import ResponseRuns, RunBuffer
from flexband.uncertainty.expansions.direct import DirectExpansion
from flexband.uncertainty.expansions.families import HERMITE
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.interpolation import Interpolation, in_place
from flexband.uncertainty.phases.decomposition import Stage
from flexband.uncertainty.surrogates.surrogate import Surrogate

DESIGNS = [NestedDesign.first(2, (HERMITE,), count) for count in (4, 6, 8)]
ROWS = 5
TIMES = 3


def stage(seed: int) -> Stage:
    """Return random runs at the points of the largest design."""
    shape = len(DESIGNS[-1]), ROWS, TIMES
    return Stage([], np.random.default_rng(seed).standard_normal(shape))


def reference(design: NestedDesign, series: np.ndarray) -> HybridExpansion:
    """Return the expansion by solving for all coefficients."""
    coefficients = np.linalg.solve(design.matrix, series.reshape(len(series), -1))
    return HybridExpansion(tuple(design.families), design.index, coefficients)


@given(st.integers(0, 99), st.sets(st.integers(0, ROWS - 1), min_size=1), st.booleans())
def test_rows_and_times(seed, row_set, thinned):
    rows = np.array(sorted(row_set))
    times = slice(None, None, 2) if thinned else slice(None)
    runs = stage(seed)
    points = np.random.default_rng(seed).uniform(-1, 1, (4, 3))
    where = points[:, :1], points[:, 1:]
    expected = reference(DESIGNS[-1], runs.base).of_rows(ROWS, rows, times)
    interpolation = DESIGNS[-1].fit(runs).of_rows(ROWS, rows, times)
    assert isinstance(interpolation, Interpolation)
    np.testing.assert_allclose(
        interpolation.evaluate(*where), expected.evaluate(*where), atol=1e-11
    )
    np.testing.assert_allclose(
        interpolation.to_hybrid().coefficients, expected.coefficients, atol=1e-11
    )
    assert interpolation.orders == expected.orders


def test_coefficients_take_the_place_of_runs():
    """Rows of fits with fewer terms are those of these fits."""
    runs = stage(1)
    points = np.random.default_rng(2).uniform(-1, 1, (4, 3))
    fits = []
    exact = np.empty((4, ROWS, TIMES))
    for design, rows in zip(DESIGNS, ([1], [0, 3], [2, 4]), strict=True):
        first = runs.part(slice(len(design)))
        fit = design.fit(first).of_rows(ROWS, np.array(rows), slice(None))
        expected = reference(design, first.base).of_rows(ROWS, np.array(rows), slice(None))
        fits.append(fit)
        exact[:, rows] = expected.evaluate(points[:, :1], points[:, 1:]).reshape(4, -1, TIMES)
    result = in_place(fits)
    assert np.shares_memory(result.coefficients, runs.base)
    values = result.evaluate(points[:, :1], points[:, 1:]).reshape(exact.shape)
    np.testing.assert_allclose(values, exact, atol=1e-11)


@given(st.lists(st.tuples(st.booleans(), st.integers(1, 5)), max_size=6), st.integers(1, 40))
def test_runs_grow(batches, budget):
    """Fitted runs come first, in the order they were made in; so do those held out."""
    numbers = iter(range(1000))

    def batch(count: int) -> ResponseRuns:
        values = np.array([next(numbers) for _ in range(count)], dtype=float)
        return ResponseRuns(
            values[:, None], values[:, None] + 0.5, np.tile(values[:, None, None], (1, 2, 3))
        )

    runs = RunBuffer(batch(3), 2, budget)
    fit_numbers = [0, 1]
    check_numbers = [2]
    for is_fitted, count in batches:
        new = batch(count)
        (runs.fit if is_fitted else runs.hold)(new)
        (fit_numbers if is_fitted else check_numbers).extend(new.xi[:, 0])
    assert runs.count == len(fit_numbers) + len(check_numbers)
    for part, expected in (
        (runs.design_runs, fit_numbers),
        (runs.holdout, check_numbers),
        (runs.all, fit_numbers + check_numbers),
    ):
        assert part.xi[:, 0].tolist() == expected
        assert (part.eta[:, 0] - 0.5).tolist() == expected
        assert (part.values == np.array(expected)[:, None, None]).all()


@pytest.mark.parametrize("max_runs", [60, 200])
def test_fits_refer_to_the_runs(monkeypatch, max_runs):
    """Neither fits nor the surrogate need memory beside that of the runs."""
    adaptations = []
    expanded = Adaptation.run

    def run(self, tolerance):
        reason = expanded(self, tolerance)
        adaptations.append(self)
        return reason

    monkeypatch.setattr(Adaptation, "run", run)
    t = np.linspace(0, 1, 5)
    inputs = {"a": fb.Interval(0, 1), "b": fb.Normal(0, 0.3)}
    method = fb.AdaptivePCCI(tolerance=1e-4, max_runs=max_runs)
    surrogate = fb.expand(lambda a, b: np.exp(a * b)[:, None] * t, inputs, method)
    memory = adaptations[0].made.memory.values
    assert all(np.shares_memory(fit.parts.values, memory) for fit in adaptations[0].choice.fits)
    assert isinstance(surrogate, Surrogate)
    (expansion,) = surrogate.expansions
    assert isinstance(expansion, DirectExpansion)
    assert np.shares_memory(expansion.values.coefficients, memory)
    value = surrogate.evaluate(a=np.array([0.5]), b=np.array([0.2])).values[0]
    np.testing.assert_allclose(value, np.exp(0.1) * t, atol=1e-4)
