"""Scanning methods: samples of ξ at every point of a scan of η, and extremes of their moments."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from scipy.special import ndtri

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_integer
from flexband.basics.words import number_of
from flexband.errors import RunError
from flexband.uncertainty.expansions.bounds.discs import in_discs
from flexband.uncertainty.expansions.expansion import SIGMAS, Extremes
from flexband.uncertainty.expansions.hybrid import tensor_points
from flexband.uncertainty.inputs.sampling import latin_hypercube_normals, of_normals, sobol
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.methods.method import Evaluate, Method
from flexband.uncertainty.surrogates.bands import bands, with_names_and_units


@dataclass(frozen=True)
class Scanning(Method):
    """Samples of ξ at every point of a scan of η; a subclass chooses the samples in `normals`."""

    samples: int = 100
    points: int = 10
    seed: int = 0

    skips_failed = True
    lost = 1
    """What N is reduced by in the mean square of the deviations: 1 as in Eq. (10), or 0."""

    def __post_init__(self) -> None:
        for name, minimum in (("samples", 2), ("points", 2), ("seed", 0)):
            object.__setattr__(self, name, check_integer(name, getattr(self, name), minimum))

    def normals(self, dimension: int) -> np.ndarray:
        """Return samples of standard normal variables, shape (samples, dimension).

        Those of inputs with another distribution are transformed.
        """
        raise NotImplementedError

    def runs(self, space: Space) -> int:
        """Return N pᵐ, with N = 1 if no input is random."""
        samples = self.samples if space.random_dimension else 1
        return samples * self.points**space.interval_dimension

    def advice(self, space: Space, most_runs: int) -> str:
        """Return which samples and points take at most so many runs, as text."""
        m = space.interval_dimension
        sampled = space.random_dimension > 0
        max_points = most_runs // (self.samples if sampled else 1)
        largest = min(self.points, int(max_points ** (1 / m)) + 1) if m else self.points
        points = next((p for p in range(largest, 1, -1) if p**m <= max_points), 2)
        samples = min(self.samples, most_runs // points**m) if sampled else 1
        if points**m > most_runs or (sampled and samples < 2):
            return (
                f"No scan fits, since the ends of {number_of(m, 'interval')} alone are "
                f"2^{m} points; AdaptivePCCI and RegressionPCCI do without a scan"
            )
        scan = replace(self, samples=max(2, samples), points=points)
        sample_options = {"samples": samples} if sampled else {}
        options = {**sample_options, "points": points}.items()
        return (
            f"{' and '.join(f'{k}={v}' for k, v in options)} would take {scan.runs(space)} "
            f"({' '.join(f'--{k} {v}' for k, v in options)} on the command line)"
            + (", at the ends of the intervals alone" if points == 2 else "")
        )

    def solve(self, space: Space, evaluate: Evaluate, sigmas: float = 1.0) -> xr.Dataset:
        """Return the bands of Eqs. (8)–(10), over the uniform grid of Eq. (7), ends included.

        Its squares are moved into discs where there are plays.
        """
        n = space.random_dimension
        m = space.interval_dimension
        xi = of_normals(self.normals(n) if n else np.zeros((1, 0)), space.families)
        eta = in_discs(tensor_points([np.linspace(-1, 1, self.points)] * m), space.discs)
        values = evaluate(np.tile(xi, (len(eta), 1)), np.repeat(eta, len(xi), axis=0))
        flat = values.values.reshape(len(eta), len(xi), -1)
        finite_mask = np.asarray(np.isfinite(flat).all(axis=2))
        few = np.flatnonzero(finite_mask.sum(axis=1) < min(2, len(xi)))
        if len(few):
            at = of_intervals(space, eta[few[0]])
            raise RunError(
                f"fewer than {min(2, len(xi))} of {number_of(len(xi), 'run')} succeeded at "
                f"{len(few)} of {number_of(len(eta), 'point')} of the scan, one of them {at}. "
                "Correct the response there, or choose intervals without such points",
                {},
            )
        # The moments at each point of the scan, and the extremes over these points.
        samples = [v if mask.all() else v[mask] for v, mask in zip(flat, finite_mask, strict=True)]
        mean = np.stack([v.mean(axis=0) for v in samples])
        std = np.stack(
            [v.std(axis=0, ddof=self.lost) if len(xi) > 1 else 0 * v[0] for v in samples]
        )
        extremes = []
        for c in SIGMAS:
            scanned = mean + c * sigmas * std
            best = np.stack([scanned.argmin(axis=0), scanned.argmax(axis=0)])
            extremes.append(Extremes(np.take_along_axis(scanned, best, axis=0), eta[best]))
        return with_names_and_units(bands(space, values, extremes, sigmas))


def of_intervals(space: Space, eta: np.ndarray) -> str:
    """Return the values of the interval inputs at a point η as text."""
    values = space.numbers_at(space.nominal()[0], eta[None])
    random = space.of_kind(random=True)
    return ", ".join(f"{k} = {column[0]:.6g}" for k, column in values.items() if k not in random)


@frozen()
class LHSScanning(Scanning):
    """The reference: Latin hypercube samples of ξ at every point of a scan of η, Eqs. (6)–(10).

    Parameters
    ----------
    samples : number N of Latin hypercube samples.
    points : number p of points of the scan along each interval variable, ends included.
    seed : seed of the random numbers.

    Raises
    ------
    InputError
        If samples or points are below 2 or the seed is negative.

    Examples
    --------
    >>> inputs = {"a": fb.Interval(0.0, 1.0), "b": fb.Normal(5.0, 1.0)}
    >>> bands = fb.propagate(lambda a, b: a + b, inputs, fb.LHSScanning(samples=100, points=3))
    >>> bands["mean"].values.round(2)
    array([5., 6.])
    """

    name = "LHS–Scanning"

    def normals(self, dimension: int) -> np.ndarray:
        return latin_hypercube_normals(self.samples, dimension, self.seed)


@frozen()
class SobolScanning(Scanning):
    """Points of a scrambled Sobol' sequence of ξ at every point of a scan of η.

    The sequence fills the space of ξ more evenly than a Latin hypercube, most of all if the number
    of samples is a power of two; for smooth responses the error decreases almost like 1/samples.
    Parameters and errors are those of `LHSScanning`; the seed is that of the scrambling.
    """

    samples: int = 128

    name = "Sobol–Scanning"
    lost = 0

    def normals(self, dimension: int) -> np.ndarray:
        return ndtri(sobol(self.samples, dimension, self.seed))


@frozen()
class MonteCarlo(Scanning):
    """Independent random samples of ξ at every point of a scan of η.

    Parameters are those of `LHSScanning`, which is more accurate at the same cost: the error of the
    mean decreases like 1/√samples here.
    """

    name = "Monte Carlo"

    def normals(self, dimension: int) -> np.ndarray:
        return np.random.default_rng(self.seed).standard_normal((self.samples, dimension))
