"""Whether methods know their errors: the errors they expect against the true ones."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np
import xarray as xr

FACTOR = 5.0
"""An estimate within this factor of the truth is honest, too large or too small."""

NEGLIGIBLE = 1e-5
"""Of the response; smaller errors, expected or true, count as this large."""

WINDOWS = 20
"""Parts of the record in each of which the root mean squares over time are compared."""


class Estimate(NamedTuple):
    """An error that was expected and the true one, parts of the response's mean size.

    Attributes
    ----------
    expected, true : means over the record.
    local_expected, local_true : root mean squares in each window, (windows,).
    """

    expected: float
    true: float
    local_expected: np.ndarray
    local_true: np.ndarray


Claims = Mapping[tuple[str, str, str], Mapping[str, Estimate]]
"""By case, name and label of the method, then by what is estimated."""


def estimates(found: xr.Dataset, truth: xr.Dataset) -> Iterator[tuple[str, Estimate]]:
    """Yield what a method says of its errors, by "output quantity"; nothing if it is silent."""
    for name in ("mean", "error_bar"):
        if f"{name}_expected_error" not in found:
            continue
        own = found[f"{name}_expected_error"]
        off = abs(found[name] - truth[name]).mean("bound")
        size = abs(truth[name]).mean(("bound", "time"))
        own, off = (v.transpose(..., "time") / size for v in (own, off))
        labels = own["output"].values if "output" in own.dims else [""]
        rows = zip(labels, *(v.values.reshape(len(labels), -1) for v in (own, off)), strict=True)
        for label, expected, true in rows:
            pair = expected, true
            yield (
                f"{label} {name}".strip(),
                Estimate(*(float(v.mean()) for v in pair), *(_windows(v) for v in pair)),
            )


def _windows(v: np.ndarray) -> np.ndarray:
    return np.array([np.sqrt(np.mean(part**2)) for part in np.array_split(v, WINDOWS)])


def honest(expected, true):
    """Return whether expected errors are within the factor of the true ones."""
    a, b = np.maximum(expected, NEGLIGIBLE), np.maximum(true, NEGLIGIBLE)
    return (a <= FACTOR * b) & (b <= FACTOR * a)


def too_small(expected, true):
    """Return whether expected errors are below the true ones by more than the factor."""
    return np.maximum(true, NEGLIGIBLE) > FACTOR * np.maximum(expected, NEGLIGIBLE)


def notes(found: Claims) -> list[str]:
    """Return the count of honest estimates of every method, on traps and on what is none."""
    rows = [(case, method, e) for (case, method, _), own in found.items() for e in own.values()]
    lines = []
    for method in dict.fromkeys(method for _, method, _ in rows):
        for kind, trap in (("no traps", False), ("traps", True)):
            own = [e for case, by, e in rows if by == method and ("(trap)" in case) == trap]
            if own:
                pairs = [(e.expected, e.true) for e in own]
                local = [p for e in own for p in zip(e.local_expected, e.local_true, strict=True)]
                lines.append(
                    f"{method}, {kind}: {_count(pairs)}; in windows of time, {_count(local)}"
                )
    if lines:
        lines.append(
            f"an expected error is honest within a factor of {FACTOR:g} of the true one, errors "
            f"below {100 * NEGLIGIBLE:g} % of the response taken as that much; a window is a "
            f"{WINDOWS}th of the time"
        )
    return lines


def _count(pairs: list[tuple[float, float]]) -> str:
    expected, true = np.array(pairs).T
    return (
        f"{honest(expected, true).sum()} of {len(pairs)} expected errors are honest "
        f"({100 * honest(expected, true).mean():.0f} %), "
        f"{too_small(expected, true).sum()} too small"
    )


def details(found: Claims) -> dict:
    """Return all numbers for the JSON file."""
    return {
        f"{case}: {label}": {
            name: {
                "expected": e.expected,
                "true": e.true,
                "honest": bool(honest(e.expected, e.true)),
                "honest_windows": float(honest(e.local_expected, e.local_true).mean()),
                "windows_too_small": float(too_small(e.local_expected, e.local_true).mean()),
            }
            for name, e in own.items()
        }
        for (case, _, label), own in found.items()
    }
