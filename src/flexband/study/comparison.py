"""Methods against a reference: runs, wall time and relative errors."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import xarray as xr

from flexband.study.study import Study
from flexband.uncertainty.methods import Method

NEGLIGIBLE = 1e-10
"""An output below this part of the largest one is round-off."""


@dataclass(frozen=True)
class Comparison:
    """One method's result.

    Attributes
    ----------
    method : what it is.
    bands : its bands.
    seconds : wall time of the study.
    errors : relative error of each output, by variable, "mean" and "error_bar"; None for the
        reference.
    """

    method: Method
    bands: xr.Dataset
    seconds: float
    errors: dict[str, xr.DataArray] | None

    @property
    def runs(self) -> int:
        """Number of evaluations of the response."""
        return self.bands.attrs["runs"]


def relative_error(found: xr.DataArray, reference: xr.DataArray) -> xr.DataArray:
    """Return ∫|Δ| dt / ∫|reference| dt over both bounds, for every output.

    The integral runs over all dims but "output". NaN stands for an output that is zero but for
    round-off, measured by the largest output.
    """
    dims = [d for d in found.dims if d != "output"]
    size = abs(reference).sum(dims)
    return (abs(found - reference).sum(dims) / size).where(size > NEGLIGIBLE * size.max())


def compare(
    study: Study,
    reference: Method,
    methods: Sequence[Method],
    *,
    progress: Callable[[Method], Callable[[int, int], object]] | None = None,
) -> list[Comparison]:
    """Run the study by the reference and by every method; the reference comes first.

    Parameters
    ----------
    progress : given a method, returns what is called as ``(done, total)`` after every batch.
    """
    study = study.located()
    results: list[Comparison] = []
    for method in (reference, *methods):
        begin = time.perf_counter()
        bands = study.using(method).run(progress=progress(method) if progress else None)
        seconds = time.perf_counter() - begin
        errors = None
        if results:
            truth = results[0].bands
            errors = {v: relative_error(bands[v], truth[v]) for v in ("mean", "error_bar")}
        results.append(Comparison(method, bands, seconds, errors))
    return results
