"""The surrogate of a response: what it is made of, and what can be asked of it without runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import xarray as xr

from flexband.uncertainty.expansions.bounds import Extremes
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.phases.bounds import phase_extremes, standard_moments
from flexband.uncertainty.phases.expansion import PhaseExpansion
from flexband.uncertainty.surrogates.bands import SIGMAS, bands


class Group(NamedTuple):
    """Outputs with the same carriers.

    outputs : their numbers. expansion : of these outputs.
    """

    outputs: np.ndarray
    expansion: PhaseExpansion


def extremes_of(groups: Sequence[Group], times: slice = slice(None)) -> list[Extremes]:
    """Return bounds of μ + c σ, c of `SIGMAS`, values (2, outputs, times) and places (…, m)."""
    outputs = sum(len(group.outputs) for group in groups)
    count = len(range(groups[0].expansion.layout.times)[times])
    m = groups[0].expansion.parts.interval_dimension
    shape = (2, outputs, count)
    found = [Extremes(np.empty(shape), np.empty((*shape, m))) for _ in SIGMAS]
    for which, expansion in groups:
        here = expansion.of(np.arange(len(which)), times)
        own = (2, len(which), count)
        for one, whole in zip(phase_extremes(here, SIGMAS), found, strict=True):
            whole.values[:, which] = one.values.reshape(own)
            whole.places[:, which] = one.places.reshape(*own, m)
    return found


@dataclass(frozen=True)
class Surrogate:
    """A response as an expansion: evaluate it, take its moments and bounds, save it.

    Attributes
    ----------
    space : the inputs.
    labels : a response without runs, shape (0, …), for its dims and coordinates.
    groups : the expansions of its outputs. Outputs and times are the response's dims but the last,
        and the last.
    diagnostics : what the method says of the expansion: errors expected, carriers, orders.
    """

    space: Space
    labels: xr.DataArray
    groups: tuple[Group, ...]
    diagnostics: xr.Dataset

    @property
    def _shape(self) -> tuple[int, int]:
        """How many outputs and times there are."""
        outputs = sum(len(group.outputs) for group in self.groups)
        return outputs, self.groups[0].expansion.layout.times

    def __repr__(self) -> str:
        """Say what it is a surrogate of, in a line."""
        shape = ", ".join(f"{dim} {n}" for dim, n in self.labels.sizes.items() if dim != "sample")
        return f"<Surrogate of {', '.join(self.space.inputs)}; {shape or 'one number'}>"

    def standard(self, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """Return the response at ξ (points, n) and η (points, m), shape (points, …)."""
        values = np.empty((len(xi), *self._shape))
        for which, expansion in self.groups:
            values[:, which] = expansion.evaluate(xi, eta)
        return values.reshape(len(xi), *self.labels.shape[1:])

    def evaluate(self, **values: np.ndarray) -> xr.DataArray:
        """Return the response at values of the inputs, dims ("sample", …).

        Parameters
        ----------
        values : every input by name, shape (samples,) or a number; a random field by its standard
            variables ξ, shape (samples, terms).

        Raises
        ------
        InputError
            Where names are not those of the inputs, or a value lies outside its interval.
        """
        xi, eta = self.space.standardized(values)
        return self._labelled(self.standard(xi, eta))

    def moments(self, **intervals: np.ndarray) -> xr.Dataset:
        """Return `mean` and `std` over the random inputs at values of the interval inputs.

        Parameters and errors are those of `evaluate`, for the interval inputs alone.
        """
        _, eta = Space(self.space.intervals).standardized(intervals)
        mean, std = map(self._labelled, self.standard_moments(eta))
        return xr.Dataset({"mean": mean, "std": std})

    def standard_moments(self, eta: np.ndarray) -> np.ndarray:
        """Return μ and σ at η of shape (points, m), shape (2, points, …)."""
        found = np.empty((2, len(eta), *self._shape))
        for which, expansion in self.groups:
            found[:, :, which] = standard_moments(expansion, eta)
        return found.reshape(2, len(eta), *self.labels.shape[1:])

    def bands(self) -> xr.Dataset:
        """Return interval mean and interval error bar, with the diagnostics."""
        found = [
            Extremes(
                e.values.reshape(2, -1),
                e.places.reshape(2, e.values[0].size, e.places.shape[-1]),
            )
            for e in extremes_of(self.groups)
        ]
        result = bands(self.space, self.labels, found)
        return result.merge(self.diagnostics).assign_attrs(self.diagnostics.attrs)

    def _labelled(self, values: np.ndarray) -> xr.DataArray:
        coords = {k: c for k, c in self.labels.coords.items() if "sample" not in c.dims}
        return xr.DataArray(values, dims=self.labels.dims, coords=coords)
