"""Comparison of the errors that methods expect with their true errors."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
import xarray as xr

FACTOR = 5.0
"""Factor between expected and true error up to which an estimate counts as right."""

NEGLIGIBLE = 1e-5
"""Part of the response; smaller errors, expected or true, count as this large."""

WINDOWS = 20
"""Number of time windows in each of which root mean squares over time are compared."""


class Estimate(NamedTuple):
    """An expected error and the true one, relative to the mean size of the response.

    Attributes
    ----------
    expected, true : mean over time.
    local_expected, local_true : root mean square in each window, shape (windows,).
    """

    expected: float
    true: float
    local_expected: np.ndarray
    local_true: np.ndarray


Claims = Mapping[tuple[str, str, str], Mapping[str, Estimate]]
"""Estimates by case, name and label of the method, then by output and band."""


def claimed_error(band_set: xr.Dataset, band: str) -> xr.DataArray | None:
    """Return the error that a method expects of a band; None if it estimates none.

    That of step and elements is left out where the method tells it apart, since the truth is
    computed on the same ones.
    """
    for kind in ("expansion", "expected"):
        if f"{band}_{kind}_error" in band_set:
            return band_set[f"{band}_{kind}_error"]
    return None


def estimates(band_set: xr.Dataset, truth: xr.Dataset) -> Iterator[tuple[str, Estimate]]:
    """Yield the error estimates of a method by "output band"; nothing if it has none."""
    for name in ("mean", "error_bar"):
        claim = claimed_error(band_set, name)
        if claim is None:
            continue
        deviation = abs(band_set[name] - truth[name]).mean("bound")
        size = abs(truth[name]).mean(("bound", "time"))
        claim, deviation = (v.transpose(..., "time") / size for v in (claim, deviation))
        labels = claim["output"].values if "output" in claim.dims else [""]
        rows = zip(
            labels, *(v.values.reshape(len(labels), -1) for v in (claim, deviation)), strict=True
        )
        for label, expected, true in rows:
            pair = expected, true
            yield (
                f"{label} {name}".strip(),
                Estimate(*(float(v.mean()) for v in pair), *(_windows(v) for v in pair)),
            )


def _windows(v: np.ndarray) -> np.ndarray:
    return np.array([np.sqrt(np.mean(part**2)) for part in np.array_split(v, WINDOWS)])


def within_factor(expected, true):
    """Return whether expected errors are within the factor of the true ones."""
    a = np.maximum(expected, NEGLIGIBLE)
    b = np.maximum(true, NEGLIGIBLE)
    return (a <= FACTOR * b) & (b <= FACTOR * a)


def too_small(expected, true):
    """Return whether expected errors are too small by more than the factor."""
    return np.maximum(true, NEGLIGIBLE) > FACTOR * np.maximum(expected, NEGLIGIBLE)


def notes(claims: Claims) -> list[str]:
    """Return lines that count the right estimates of every method, for ordinary cases and traps."""
    rows = [
        (case, method, e) for (case, method, _), by_band in claims.items() for e in by_band.values()
    ]
    lines = []
    for method in dict.fromkeys(method for _, method, _ in rows):
        for kind, trap in (("ordinary cases", False), ("traps", True)):
            selection = [e for case, by, e in rows if by == method and ("(trap)" in case) == trap]
            if selection:
                pairs = [(e.expected, e.true) for e in selection]
                local = [
                    p for e in selection for p in zip(e.local_expected, e.local_true, strict=True)
                ]
                lines.append(
                    f"{method}, {kind}: {_count(pairs)}; in windows of time, {_count(local)}"
                )
    if lines:
        lines.append(
            f"these lines count the expected errors that are within a factor of {FACTOR:g} of the "
            f"true ones; errors below {100 * NEGLIGIBLE:g} % of the response count as this large, "
            f"and a window is 1/{WINDOWS} of the simulated time"
        )
    return lines


def _count(pairs: list[tuple[float, float]]) -> str:
    expected, true = np.array(pairs).T
    right = within_factor(expected, true)
    return (
        f"{right.sum()} of {len(pairs)} ({100 * right.mean():.0f} %) within a factor of "
        f"{FACTOR:g}, {too_small(expected, true).sum()} too small"
    )


def details(claims: Claims) -> dict:
    """Return the numbers for the JSON file."""
    return {
        f"{case}: {label}": {
            name: {
                "expected": e.expected,
                "true": e.true,
                "right": bool(within_factor(e.expected, e.true)),
                "right_windows": float(within_factor(e.local_expected, e.local_true).mean()),
                "windows_too_small": float(too_small(e.local_expected, e.local_true).mean()),
            }
            for name, e in by_band.items()
        }
        for (case, _, label), by_band in claims.items()
    }
