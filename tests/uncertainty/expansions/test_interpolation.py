"""Coefficients that are formed where they are needed, and runs in memory that they grow in."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import flexband as fb
from flexband.uncertainty.adaptive.adaptation import Adaptation
from flexband.uncertainty.adaptive.interpolation import NestedDesign
from flexband.uncertainty.adaptive.runs import ResponseRuns, RunBuffer
from flexband.uncertainty.expansions.direct import DirectExpansion
from flexband.uncertainty.expansions.families import HERMITE
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.interpolation import Interpolation, in_place
from flexband.uncertainty.phases.decomposition import Stage
from flexband.uncertainty.surrogates.surrogate import Surrogate

DESIGNS = [NestedDesign.first(2, (HERMITE,), most) for most in (4, 6, 8)]
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
def test_rows_and_times(seed, chosen, thinned):
    which = np.array(sorted(chosen))
    times = slice(None, None, 2) if thinned else slice(None)
    runs = stage(seed)
    points = np.random.default_rng(seed).uniform(-1, 1, (4, 3))
    where = points[:, :1], points[:, 1:]
    whole = reference(DESIGNS[-1], runs.base).of_rows(ROWS, which, times)
    own = DESIGNS[-1].fit(runs).of_rows(ROWS, which, times)
    assert isinstance(own, Interpolation)
    np.testing.assert_allclose(own.evaluate(*where), whole.evaluate(*where), atol=1e-11)
    np.testing.assert_allclose(own.to_hybrid().coefficients, whole.coefficients, atol=1e-11)
    assert own.orders == whole.orders


def test_coefficients_take_the_place_of_runs():
    """Rows of fits with fewer terms are those of these fits."""
    runs = stage(1)
    points = np.random.default_rng(2).uniform(-1, 1, (4, 3))
    own = []
    wanted = np.empty((4, ROWS, TIMES))
    for design, rows in zip(DESIGNS, ([1], [0, 3], [2, 4]), strict=True):
        first = runs.part(slice(len(design)))
        fit = design.fit(first).of_rows(ROWS, np.array(rows), slice(None))
        expected = reference(design, first.base).of_rows(ROWS, np.array(rows), slice(None))
        own.append(fit)
        wanted[:, rows] = expected.evaluate(points[:, :1], points[:, 1:]).reshape(4, -1, TIMES)
    found = in_place(own)
    assert np.shares_memory(found.coefficients, runs.base)
    values = found.evaluate(points[:, :1], points[:, 1:]).reshape(wanted.shape)
    np.testing.assert_allclose(values, wanted, atol=1e-11)


@given(st.lists(st.tuples(st.booleans(), st.integers(1, 5)), max_size=6), st.integers(1, 40))
def test_runs_grow(batches, budget):
    """Fitted runs come first, in the order they were made in; so do those held out."""
    numbers = iter(range(1000))

    def batch(count: int) -> ResponseRuns:
        made = np.array([next(numbers) for _ in range(count)], dtype=float)
        return ResponseRuns(
            made[:, None], made[:, None] + 0.5, np.tile(made[:, None, None], (1, 2, 3))
        )

    runs = RunBuffer(batch(3), 2, budget)
    fitted = [0, 1]
    held = [2]
    for is_fitted, count in batches:
        new = batch(count)
        (runs.fit if is_fitted else runs.hold)(new)
        (fitted if is_fitted else held).extend(new.xi[:, 0])
    assert runs.count == len(fitted) + len(held)
    for own, expected in (
        (runs.design_runs, fitted),
        (runs.holdout, held),
        (runs.all, fitted + held),
    ):
        assert own.xi[:, 0].tolist() == expected
        assert (own.eta[:, 0] - 0.5).tolist() == expected
        assert (own.values == np.array(expected)[:, None, None]).all()


@pytest.mark.parametrize("most", [60, 200])
def test_fits_refer_to_the_runs(monkeypatch, most):
    """Neither fits nor the surrogate need memory beside that of the runs."""
    seen = []
    expanded = Adaptation.run

    def run(self, tolerance):
        reason = expanded(self, tolerance)
        seen.append(self)
        return reason

    monkeypatch.setattr(Adaptation, "run", run)
    t, inputs = np.linspace(0, 1, 5), {"a": fb.Interval(0, 1), "b": fb.Normal(0, 0.3)}
    method = fb.AdaptivePCCI(tolerance=1e-4, max_runs=most)
    surrogate = fb.expand(lambda a, b: np.exp(a * b)[:, None] * t, inputs, method)
    memory = seen[0].made.memory.values
    assert all(np.shares_memory(fit.parts.values, memory) for fit in seen[0].choice.fits)
    assert isinstance(surrogate, Surrogate)
    (expansion,) = surrogate.expansions
    assert isinstance(expansion, DirectExpansion)
    assert np.shares_memory(expansion.values.coefficients, memory)
    value = surrogate.evaluate(a=np.array([0.5]), b=np.array([0.2])).values[0]
    np.testing.assert_allclose(value, np.exp(0.1) * t, atol=1e-4)
