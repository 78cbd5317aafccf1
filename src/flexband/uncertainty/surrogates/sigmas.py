"""Error bars of μ ± kσ: the errors that are expected of them, from those of μ ± σ.

Let r be what an expansion misses of runs, with root mean square ε. It moves μ by E[r] and σ, to
first order, by E[r (F − μ)/σ]. Since 1 and (F − μ)/σ are orthonormal, the squares of both add up to
ε² at most, so that μ ± kσ moves by at most ε √(1 + k²).
"""

from __future__ import annotations

import math

import numpy as np
import xarray as xr

from flexband.basics.checks import check_numbers, check_positive
from flexband.basics.rounding import Units
from flexband.errors import InputError
from flexband.uncertainty.surrogates.axes import axes_of, units_of
from flexband.uncertainty.surrogates.bands import BandRecord
from flexband.uncertainty.surrogates.diagnostics import varying_outputs

AT_ONE_TIME = 1.5
"""Error at one time, as a multiple of the error expected there of which means over time are right.
True errors at one time scatter more than means; few are above twice this one, see
docs/evidence/honesty.md.
"""

MAX_SIGMAS = 1000.0


def checked_sigmas(sigmas: float) -> float:
    """Return k as a float; raise `InputError` if it is not a positive number up to 1000."""
    k = float(check_positive("sigmas", check_numbers("sigmas", sigmas)))
    if k > MAX_SIGMAS:
        raise InputError(f"sigmas must be {MAX_SIGMAS:g} or less; got {k:g}")
    return k


def growth(sigmas: float) -> float:
    """Return the expected error of μ ± kσ as a multiple of that of μ ± σ; k = 0 is that of μ."""
    return math.sqrt((1 + sigmas**2) / 2)


def diagnostics_of(sigmas: float, diagnostics: xr.Dataset, bar: xr.DataArray) -> xr.Dataset:
    """Return diagnostics of μ ± kσ from those of μ ± σ, with `pointwise_error` of the bar."""
    bar_diagnostics = _of_sigmas(sigmas, diagnostics, bar)
    if "error_bar_expected_error" not in bar_diagnostics or "pointwise_error" in bar_diagnostics:
        return bar_diagnostics
    return bar_diagnostics.assign(
        pointwise_error=AT_ONE_TIME * bar_diagnostics["error_bar_expected_error"]
    )


def _of_sigmas(sigmas: float, diagnostics: xr.Dataset, bar: xr.DataArray) -> xr.Dataset:
    """Return what `diagnostics_of` does, with a `pointwise_error` only if the method tells it."""
    of_sigmas = ("error_bar_", "pointwise_")  # what the names of errors of μ ± kσ begin with
    is_narrowed = "inputs_of_runs" in diagnostics.attrs  # which has no errors relative to its bands
    if sigmas == 1 and not is_narrowed:
        return with_relative_errors(diagnostics, bar)
    before = {str(k): diagnostics.variables[k] for k in diagnostics}
    errors = {k: v * growth(sigmas) for k, v in before.items() if k.startswith(of_sigmas)}
    error_name = "error_bar_discretization_error"
    if error_name in errors:  # of bands: if σ alone moves, it is k times as large
        errors[error_name] = before[error_name] * max(sigmas, growth(sigmas))
        errors["error_bar_expected_error"] = (
            errors[error_name] + errors["error_bar_expansion_error"]
        )
    others = diagnostics.drop_vars("relative_expected_error", errors="ignore")
    bar_diagnostics = with_relative_errors(others.assign(errors), bar)
    relative = {
        name: float(np.max(relative_errors(bar_diagnostics, name, bar)))
        for name in (
            "expected_error",
            "expansion_error",
            "integration_error",
            "discretization_error",
        )
        if f"error_bar_{name}" in errors
        and (is_narrowed or isinstance(bar_diagnostics.attrs.get(name), float))
    }
    if "discretization_error" in relative and not is_narrowed:
        before_ratio = BandRecord.read(bar_diagnostics).discretization_error or 1.0
        ratio = relative["discretization_error"] / before_ratio
        for name in (f"{part}_error" for part in BandRecord.read(bar_diagnostics).refined):
            if name not in relative:
                relative[name] = bar_diagnostics.attrs[name] * ratio
    return bar_diagnostics.assign_attrs(relative)


def not_constant(lower: np.ndarray, upper: np.ndarray, units: Units) -> np.ndarray:
    """Return which outputs have error bars wider than rounding, from ends (outputs, times)."""
    size = np.maximum(abs(lower), abs(upper)).max(axis=-1)
    return units.varies((upper - lower).max(axis=-1), size)


def relative_to_bars(
    diagnostics: xr.Dataset, bar: xr.DataArray, F: np.ndarray, units: Units, beyond: float = 1e6
) -> np.ndarray:
    """Return expected errors relative to the width of error bars, with the shape of the outputs.

    It is `beyond` of outputs that vary in runs F, (runs, outputs, times), but whose error bar has
    no width.
    """
    relative = relative_errors(diagnostics, "expected_error", bar)
    zero_width = varying_outputs(F, units).reshape(relative.shape) & ~bars_vary(bar)
    return np.where(zero_width, beyond, relative)


def bars_vary(bar: xr.DataArray) -> np.ndarray:
    """Return the same of error bars, dims (bound, …), with the shape of the outputs."""
    axes = axes_of(bar)
    lower, upper = bar.values.reshape(2, -1, axes.times)
    return not_constant(lower, upper, units_of(bar)).reshape(axes.shape)


def with_relative_errors(diagnostics: xr.Dataset, bar: xr.DataArray) -> xr.Dataset:
    """Return diagnostics with `relative_expected_error` of each output, if errors are estimated."""
    has_errors = {"mean_expected_error", "error_bar_expected_error"} <= set(diagnostics)
    if not has_errors or "relative_expected_error" in diagnostics:
        return diagnostics
    relative = relative_errors(diagnostics, "expected_error", bar)
    return diagnostics.assign(relative_expected_error=(axes_of(bar).dims, relative))


def relative_errors(diagnostics: xr.Dataset, name: str, bar: xr.DataArray) -> np.ndarray:
    """Return the larger error of mean and error bar over the bar's mean width; 0 of constants."""
    axes = axes_of(bar)
    lower, upper = (end.reshape(*axes.shape, axes.times) for end in bar.values)
    width = np.where(bars_vary(bar), (upper - lower).mean(axis=-1), np.inf)
    errors = [diagnostics.variables[f"{band}_{name}"] for band in ("mean", "error_bar")]
    errors = [error.transpose(*bar.dims[1:]).values.reshape(lower.shape) for error in errors]
    return np.max([error.mean(axis=-1) / width for error in errors], axis=0)
