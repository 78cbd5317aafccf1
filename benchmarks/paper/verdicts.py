"""Verdicts on the paper's statements: whether, and for which settings, they hold."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

Numbers = Mapping[str, Any]
HOLDS = "holds"
NOT = "does not hold"


@dataclass(frozen=True)
class Statement:
    """What the paper states, what was found, and a verdict: "holds" or not, and when or why."""

    claim: str
    result: str
    verdict: str


def method(study: Numbers, label: str) -> Numbers:
    """Return what is known of a method of a study."""
    return next(entry for entry in study["methods"] if entry["label"] == label)


def largest(errors: Mapping[str, float], of: str = "") -> float:
    """Return the largest of the errors whose names contain a text."""
    return max(value for name, value in errors.items() if of in name)


def percent(value: float) -> str:
    """Return an error in per cent with two digits."""
    return f"{value:.2g} %" if value < 99.5 else f"{value:.0f} %"


def where(sweep: list[Numbers], holds: Callable[[Numbers], bool]) -> str:
    """Return for which settings of the sweep a statement holds, as text."""
    cells = [cell for cell in sweep if holds(cell)]
    if len(cells) == len(sweep):
        return "every ρ∞, step and element of the sweep"
    if not cells:
        return "no ρ∞, step or element of the sweep"
    parts = []
    for step in dict.fromkeys(cell["step"] for cell in sweep):
        by_element: dict[str, list[str]] = {}
        for cell in cells:
            if cell["step"] == step:
                by_element.setdefault(cell["element"], []).append(f"{cell['radius']:g}")
        radii = {element: ", ".join(texts) for element, texts in by_element.items()}
        if len(radii) == 2 and len(set(radii.values())) == 1:
            radii = {"": next(iter(radii.values()))}
        for element, text in radii.items():
            parts.append(
                f"ρ∞ = {text} at {1e3 * step:g} ms{f' ({element} element)' * bool(element)}"
            )
    return "; ".join(parts)


def verdict(
    sweep: list[Numbers],
    holds: Callable[[Numbers], bool],
    why: str = "",
    holds_here: bool | None = None,
) -> str:
    """Return a verdict on a statement about the reactions over the sweep.

    Parameters
    ----------
    why : why it does not hold everywhere.
    holds_here : whether it holds in the study of the page, if that was judged in another way.
    """
    count = sum(map(holds, sweep))
    holds_here = holds(cell_of(sweep)) if holds_here is None else holds_here
    if count == len(sweep) and holds_here:
        return HOLDS
    why = why and f": {why}"
    if count == 0:
        return f"{HOLDS} here, but nowhere in the sweep{why}" if holds_here else f"{NOT}{why}"
    share = f"{count} of {len(sweep)} settings"
    return f"{HOLDS} only with {where(sweep, holds)} ({share}){why}"


def plain(holds: bool) -> str:
    """Return a verdict without a sweep."""
    return HOLDS if holds else NOT


def cell_of(sweep: list[Numbers], element: str = "plain", step: float = 1e-3, radius: float = 0.7):
    """Return one of the settings of the sweep."""
    setting = element, step, radius
    return next(c for c in sweep if (c["element"], c["step"], c["radius"]) == setting)


def rate(cell: Numbers, name: str) -> float:
    """Return the factor between the errors with 16 and 256 runs, geometric mean of the indexes."""
    first = cell[f"{name} 1"]
    last = cell[f"{name} 3"]
    return math.prod(first[index] / last[index] for index in first) ** (1 / len(first))
