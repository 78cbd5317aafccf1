"""The surrogate of a response, which is evaluated in place of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_instance
from flexband.uncertainty.expansions.expansion import Expansion, Extremes, extremes_of, join_outputs
from flexband.uncertainty.inputs.evaluation import coordinates
from flexband.uncertainty.inputs.narrowing import part_of
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.surrogates.axes import axes_of
from flexband.uncertainty.surrogates.bands import bands, with_names_and_units
from flexband.uncertainty.surrogates.extrapolation import warn_of_extrapolation
from flexband.uncertainty.surrogates.held_out import HeldOut
from flexband.uncertainty.surrogates.narrowing import narrowed_diagnostics, runs_in
from flexband.uncertainty.surrogates.sigmas import checked_sigmas, diagnostics_of


@frozen()
class Surrogate:
    """A response as expansions: evaluate it, compute its moments and bounds, save it.

    `expand` returns it. `save_surrogate` writes it to a file, and `load_surrogate` reads it.

    Attributes
    ----------
    space : the inputs.
    labels : a response without runs, shape (0, …), for its dims and coordinates.
    expansions : each of some of its outputs: all dims but that of time together (`axes_of`).
    diagnostics : expected errors, vibration frequencies, orders: whatever the method reports.
    held_out : what it misses in runs that were not fitted: those of the method, or of `verify`.
    correction : how much of each expansion corrects the error of step and elements, which runs
        have: expansions of the same outputs and parts; none if nothing is corrected.
    verification : what verification runs say of it (`verify`); None without such runs.

    Examples
    --------
    >>> inputs = {"force": fb.Interval(90.0, 110.0), "compliance": fb.Normal(2e-3, 1e-4)}
    >>> surrogate = fb.expand(lambda force, compliance: force * compliance, inputs, fb.PCCI(1, 1))
    >>> surrogate.evaluate(force=np.array([100.0]), compliance=np.array([2e-3])).values.round(4)
    array([0.2])
    >>> surrogate.narrowed(force=fb.Interval(99.0, 101.0)).bands()["mean"].values.round(4)
    array([0.198, 0.202])
    """

    space: Space
    labels: xr.DataArray
    expansions: tuple[Expansion, ...]
    diagnostics: xr.Dataset
    held_out: HeldOut | None = None
    correction: tuple[Expansion, ...] = ()
    verification: xr.Dataset | None = None

    def __post_init__(self) -> None:
        check_instance("labels", self.labels, xr.DataArray)
        # No runs of an array are a view, which would keep all its runs in memory.
        object.__setattr__(self, "labels", self.labels.copy())

    def __repr__(self) -> str:
        shape = ", ".join(f"{dim} {n}" for dim, n in self.labels.sizes.items() if dim != "sample")
        return f"<Surrogate of {', '.join(self.space.inputs)}; {shape or 'one number'}>"

    @property
    def times(self) -> int:
        """Number of times of each output."""
        outputs = sum(len(expansion.outputs) for expansion in self.expansions)
        return math.prod(self.labels.shape[1:]) // outputs

    @property
    def time(self) -> str | None:
        """The dim of time; None where there is none, or one time has been selected."""
        axes = axes_of(self.labels)
        return axes.time if axes.times == self.times else None

    @property
    def without_correction(self) -> Surrogate:
        """The surrogate of the runs as they are, with their error of step and elements."""
        if not self.correction:
            return self
        pairs = zip(self.expansions, self.correction, strict=True)
        expansions = tuple(
            expansion.of_hybrid(expansion.hybrid + part.hybrid * -1.0) for expansion, part in pairs
        )
        return replace(self, expansions=expansions, correction=())

    def apply_correction(self, values: np.ndarray, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """Correct the values of runs at ξ and η, (points, …), as the surrogate is corrected.

        Only corrected runs can be compared with a corrected surrogate.
        """
        if not self.correction:
            return values
        return values + (self.standard(xi, eta) - self.without_correction.standard(xi, eta))

    def with_attrs(self, **attrs: Any) -> Surrogate:
        """Return the surrogate with further attributes of its diagnostics."""
        return replace(self, diagnostics=self.diagnostics.assign_attrs(attrs))

    def standard(self, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """Return the response at ξ (points, n) and η (points, m), shape (points, …)."""
        return self._join_expansions([expansion.evaluate(xi, eta) for expansion in self.expansions])

    def evaluate(self, **values: np.ndarray) -> xr.DataArray:
        """Return the response at values of the inputs, dims ("sample", …).

        Warns of a random input that is beyond all runs, at more than five standard deviations.

        Parameters
        ----------
        values : every input by name, shape (samples,) or a number; a random field by its standard
            variables ξ, shape (samples, terms).

        Raises
        ------
        InputError
            If names are not those of the inputs, or a value lies outside its interval.
        """
        xi, eta = self.space.standardize(values)
        warn_of_extrapolation(self.space, xi, self.diagnostics.attrs)
        return self._label_values(self.standard(xi, eta))

    def standard_moments(self, eta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return μ and σ at η of shape (points, m), each of shape (points, …)."""
        moments = [expansion.moments(eta) for expansion in self.expansions]
        mean, std = (self._join_expansions(values) for values in zip(*moments, strict=True))
        return mean, std

    def moments(self, **intervals: np.ndarray) -> xr.Dataset:
        """Return `mean` and `std` over the random inputs at values of the interval inputs.

        Parameters and errors are those of `evaluate`, for the interval inputs alone.
        """
        _, eta = Space(self.space.of_kind(random=False)).standardize(intervals)
        mean, std = map(self._label_values, self.standard_moments(eta))
        return xr.Dataset({"mean": mean, "std": std})

    def extremes(self, sigmas: float = 1.0) -> list[Extremes]:
        """Return the bounds of μ, μ − kσ and μ + kσ, values of shape (2, outputs, times)."""
        return extremes_of(self.expansions, sigmas=sigmas)

    def narrowed(self, **inputs: Any) -> Surrogate:
        """Return the surrogate for tighter tolerances or less scatter, without any further run.

        Its errors are judged by the check runs inside the new inputs, or the nearest eight where
        fewer are inside; where the method has no such runs, they are those of the wider inputs.

        Parameters
        ----------
        inputs : those that change, by name: a narrower `Interval`, a distribution, or a number. A
            parameter of a distribution that is an interval has the name ``input.parameter``.

        Raises
        ------
        InputError
            If a name is not an input, or a new one is beyond the runs: an interval outside
            the old one, or a mean ± 3σ outside that of the old distribution.
        """
        part = part_of(self.space, inputs)
        families = part.space.families
        expansions, correction = (
            tuple(expansion.substitute(part.substitutions, families) for expansion in expansions)
            for expansions in (self.expansions, self.correction)
        )
        surrogate = replace(
            self,
            space=part.space,
            expansions=expansions,
            correction=correction,
            held_out=None,
            verification=None,
        )
        held_out_runs = None
        values = np.zeros((0, 1, 1))
        if self.held_out is not None:
            held_out_runs = runs_in(part, self.held_out)
            joint = surrogate.standard(held_out_runs.xi, held_out_runs.eta)
            values = joint.reshape(len(joint), *self.held_out.missed.shape[1:])
        diagnostics = narrowed_diagnostics(
            self.diagnostics, self.labels, part, held_out_runs, values
        )
        return replace(surrogate, diagnostics=diagnostics, held_out=held_out_runs)

    def bands(self, sigmas: float = 1.0) -> xr.Dataset:
        """Return interval mean and interval error bar, with the diagnostics.

        Parameters
        ----------
        sigmas : k of the error bar, from the lowest μ − kσ to the highest μ + kσ.

        Raises
        ------
        InputError
            If `sigmas` is not a positive number.
        """
        sigmas = checked_sigmas(sigmas)
        result = bands(self.space, self.labels, self.extremes(sigmas), sigmas)
        diagnostics = diagnostics_of(sigmas, self.diagnostics, result["error_bar"])
        return with_names_and_units(
            result.merge(diagnostics).assign_attrs(diagnostics.attrs | result.attrs)
        )

    def _join_expansions(self, values: Sequence[np.ndarray]) -> np.ndarray:
        """Join values (points, outputs, times) of all expansions to the shape (points, …)."""
        joint = join_outputs(self.expansions, values, 1)
        return joint.reshape(len(joint), *self.labels.shape[1:])

    def _label_values(self, values: np.ndarray) -> xr.DataArray:
        return xr.DataArray(values, dims=self.labels.dims, coords=coordinates(self.labels))
