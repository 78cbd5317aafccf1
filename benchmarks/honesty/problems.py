"""Problems in a few standard variables, and the inputs and responses that are made of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import xarray as xr

import flexband as fb
from benchmarks.honesty.references import Term, bands, moments

Bands = tuple[np.ndarray, np.ndarray]
"""Interval mean and interval error bar, each of shape (2, outputs, times)."""


@dataclass(frozen=True)
class Case:
    """A response, its inputs, and a function that computes its true bands.

    The function takes an integer: 2 for twice as many points of every kind, to check convergence.
    `exact_steps` says whether the true bands are those of a response without an error of step and
    mesh.
    """

    family: str
    seed: int
    response: Callable[..., xr.DataArray]
    inputs: Mapping[str, fb.Input]
    reference: Callable[[int], Bands]
    exact_steps: bool = False


@dataclass(frozen=True)
class Problem:
    """Outputs that are sums of terms in standard variables.

    Attributes
    ----------
    kinds : "normal", "uniform" (from −1 to 1) or "interval" of every variable.
    outputs : the terms of each output; no variable is in two terms of one output.
    times : number of times.
    time_error, amplitude_error : relative errors of the values, which the true bands do not have.
    """

    kinds: Sequence[str]
    outputs: Sequence[Sequence[Term]]
    times: int
    time_error: float = 0.0
    amplitude_error: float = 0.0

    @property
    def tau(self) -> np.ndarray:
        """Times over the duration."""
        return np.linspace(0.0, 1.0, self.times)

    def values(self, y: np.ndarray) -> np.ndarray:
        """Return the outputs at variables (runs, variables), shape (runs, outputs, times)."""
        outputs = np.zeros((len(y), len(self.outputs), self.times))
        tau = self.tau * (1 - self.time_error)
        for o, terms in enumerate(self.outputs):
            for term in terms:
                outputs[:, o] += term.formula(*(y[:, [k]] for k in term.on), tau)
        return outputs * (1 + self.amplitude_error)

    def reference(self, refine: int = 1) -> Bands:
        """Return the true bands."""
        band_pairs = []
        for terms in self.outputs:
            parts = [moments(term, self.kinds, self.tau, refine) for term in terms]
            band_pairs.append(bands(parts, self.times, refine))
        mean, bar = (np.stack(v, axis=1) for v in zip(*band_pairs, strict=True))
        return mean, bar


def case(
    family: str,
    seed: int,
    problem: Problem,
    rng: np.random.Generator,
    *,
    inputs: int = 0,
    units: Sequence[float] = (),
) -> Case:
    """Return a case whose inputs have random magnitudes, and outputs and time random units.

    With more `inputs` than variables, every variable is a sum of several inputs: normal ones are
    combined by an orthonormal matrix, an interval variable is a weighted mean of its own inputs.

    Parameters
    ----------
    units : factor of each output; random if there are none.
    """
    kinds, mixing = _mix_inputs(problem.kinds, max(inputs, len(problem.kinds)), rng)
    names = [f"p{k:02d}" for k in rng.permutation(len(kinds))]
    centre = rng.choice([-1, 1], len(kinds)) * 10 ** rng.uniform(-2, 3, len(kinds))
    spread = np.abs(centre) * 10 ** rng.uniform(-2, -0.5, len(kinds))
    centre = np.where(rng.random(len(kinds)) < 0.3, 0.0, centre)
    duration = 10 ** rng.uniform(-2, 1)
    scale = np.array(units) if len(units) else 10 ** rng.uniform(-1, 3, len(problem.outputs))
    labels = {
        "output": [f"q{o}" for o in range(len(scale))],
        "time": duration * problem.tau,
    }

    def response(**values: np.ndarray) -> xr.DataArray:
        columns = np.stack([values[name] for name in names], axis=1)
        y = (columns - centre) / spread @ mixing.T
        F = scale[:, None] * problem.values(y)
        return xr.DataArray(F, dims=("sample", "output", "time"), coords=labels)

    def reference(refine: int = 1) -> Bands:
        mean, bar = problem.reference(refine)
        return scale[:, None] * mean, scale[:, None] * bar

    distributions = {
        name: _input(kind, float(c), float(s))
        for name, kind, c, s in zip(names, kinds, centre, spread, strict=True)
    }
    return Case(family, seed, response, distributions, reference)


def _input(kind: str, centre: float, spread: float) -> fb.Input:
    if kind == "normal":
        return fb.Normal(centre, spread)
    ends = centre - spread, centre + spread
    return fb.Uniform(*ends) if kind == "uniform" else fb.Interval(*ends)


def _mix_inputs(
    kinds: Sequence[str], inputs: int, rng: np.random.Generator
) -> tuple[list[str], np.ndarray]:
    """Return the kinds of so many inputs and the matrix that makes the variables of them."""
    first = list(range(len(kinds)))
    spare = [k for k in first if kinds[k] != "uniform"]
    owners = np.array(first + list(rng.choice(spare or first, inputs - len(kinds))))
    input_kinds = [kinds[k] for k in owners]
    matrix = np.zeros((len(kinds), inputs))
    decay = rng.choice([1.0, 0.7, 0.3]) ** np.arange(inputs)
    normal = np.flatnonzero([kind == "normal" for kind in kinds])
    if len(normal):
        members = np.flatnonzero([kind == "normal" for kind in input_kinds])
        basis = rng.standard_normal((len(members), len(normal)))
        if inputs == len(kinds):
            basis = np.eye(len(normal))
        basis *= decay[: len(members), None]
        matrix[np.ix_(normal, members)] = np.linalg.qr(basis)[0].T
    for k in first:
        if kinds[k] == "interval":
            members = np.flatnonzero(owners == k)
            weights = rng.uniform(0.2, 1.0, len(members)) * decay[: len(members)]
            matrix[k, members] = weights * rng.choice([-1, 1], len(members)) / weights.sum()
        elif kinds[k] == "uniform":
            matrix[k, k] = 1.0
    return input_kinds, matrix
