"""The protocol of expansions of a response, and the values of several expansions together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.substitution import Substitution

SIGMAS = (0.0, -1.0, 1.0)
"""Multiples of σ whose bounds make the bands: μ, μ − σ and μ + σ of Eqs. (3) and (4)."""


@dataclass(frozen=True)
class Extremes:
    """Lower and upper bound of μ + c σ over the interval variables, (2, …), at η, (2, …, m)."""

    values: np.ndarray
    places: np.ndarray


class Expansion(Protocol):
    """The surrogate of some outputs of a response as a function of ξ and η."""

    @property
    def outputs(self) -> np.ndarray:
        """The numbers of the response's outputs that are expanded, increasing."""
        ...

    @property
    def carriers(self) -> int:
        """The number of carriers that the outputs share; 0 if their values are expanded."""
        ...

    @property
    def hybrid(self) -> HybridExpansion:
        """The polynomials in ξ and η: of the outputs, or of the parts that make them."""
        ...

    def evaluate(self, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """Return the outputs at ξ (points, n) and η (points, m), shape (points, outputs, times)."""
        ...

    def evaluate_quickly(self, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """Return what `evaluate` does, in one thread and to six digits; η may be shared."""
        ...

    def moments(self, eta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return μ and σ over ξ at η (points, m), each of shape (points, outputs, times)."""
        ...

    def extremes(self, sigmas: Sequence[float]) -> list[Extremes]:
        """Return bounds of μ + c σ, c in `sigmas`, (2, outputs, times), and their η, (…, m)."""
        ...

    def integration_error(self, bounds: Sequence[Extremes], sigmas: Sequence[float]) -> np.ndarray:
        """Return how far bounds of each μ + c σ are off as moments are integrated numerically.

        The shape is (sigmas, 2, outputs, times); zero where moments have a closed form.
        """
        ...

    def select(self, outputs: np.ndarray, times: slice | np.ndarray = slice(None)) -> Expansion:
        """Return the expansion of some of its outputs, by number, at some of the times."""
        ...

    def substitute(
        self, substitutions: Mapping[int, Substitution], families: Sequence[Family]
    ) -> Expansion:
        """Return the expansion in other variables; see `substitution.substitute`."""
        ...

    def of_hybrid(self, hybrid: HybridExpansion) -> Expansion:
        """Return an expansion of the same outputs with other polynomials, as `hybrid` gives."""
        ...

    def arrays(self) -> dict[str, np.ndarray]:
        """Return the arrays of a file, from which `of_arrays(families, **arrays)` restores it."""
        ...


def join_outputs(
    expansions: Sequence[Expansion], values: Sequence[np.ndarray], axis: int
) -> np.ndarray:
    """Return one array of values per expansion as one array, along the axis of the outputs."""
    if len(values) == 1:
        return values[0]
    outputs = np.concatenate([expansion.outputs for expansion in expansions])
    shape = list(values[0].shape)
    shape[axis] = len(outputs)
    joint = np.empty(shape)
    ends = np.cumsum([len(expansion.outputs) for expansion in expansions])
    for places, part in zip(np.split(np.argsort(np.argsort(outputs)), ends), values, strict=False):
        np.moveaxis(joint, axis, 0)[places] = np.moveaxis(part, axis, 0)
    return joint


def extremes_of(
    expansions: Sequence[Expansion],
    times: slice | np.ndarray = slice(None),
    sigmas: float = 1.0,
    of: Sequence[float] = SIGMAS,
) -> list[Extremes]:
    """Return the bounds of μ, μ − kσ and μ + kσ, or the multiples `of` kσ, at some times."""
    multiples = [sigmas * c for c in of]
    bounds = [
        expansion.select(expansion.outputs, times).extremes(multiples) for expansion in expansions
    ]
    return [
        Extremes(
            join_outputs(expansions, [part.values for part in extremes], 1),
            join_outputs(expansions, [part.places for part in extremes], 1),
        )
        for extremes in zip(*bounds, strict=True)
    ]
