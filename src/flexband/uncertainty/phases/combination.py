"""Linear combinations of outputs, as expansions of their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import reduce

import numpy as np

from flexband.uncertainty.expansions.expansion import Expansion
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.phases.expansion import expansion_of
from flexband.uncertainty.phases.layout import PartColumns


def combine(expansions: Sequence[Expansion], weights: np.ndarray) -> Expansion:
    """Return the expansion of linear combinations of all outputs.

    Weights are those of the outputs by number, shape (combinations, outputs).
    """
    summands = [expansion for expansion in expansions if np.any(weights[:, expansion.outputs])]
    parts = reduce(
        _sum, (_of_one(expansion, weights[:, expansion.outputs]) for expansion in summands)
    )
    return expansion_of(np.arange(len(weights)), *parts)


Parts = tuple[HybridExpansion, PartColumns]


def _of_one(expansion: Expansion, weights: np.ndarray) -> Parts:
    """Return the parts of combinations of the outputs of one expansion."""
    parts = expansion.hybrid
    columns = PartColumns.from_outputs(weights.shape[1], expansion.carriers)
    rows = parts.coefficients.reshape(len(parts.index), columns.width, -1)
    base, carriers = columns.unpack(rows.reshape(len(rows), -1))
    blocks = [weights @ base]
    for phase, *envelope in carriers:
        blocks += [phase, *(weights @ part for part in envelope)]
    series = np.concatenate(blocks, axis=1).reshape(len(rows), -1)
    return replace(parts, coefficients=series), PartColumns.from_outputs(
        len(weights), columns.carriers
    )


def _sum(summand: Parts, other: Parts) -> Parts:
    """Return the parts of a sum, which has the carriers of both."""
    columns = PartColumns.from_outputs(summand[1].outputs, summand[1].carriers + other[1].carriers)
    first = 0
    wide_parts = []
    for parts, layout in (summand, other):
        rows = parts.coefficients.reshape(len(parts.index), layout.width, -1)
        wide = np.zeros((len(rows), columns.width, rows.shape[2]))
        wide[:, : layout.outputs] = rows[:, : layout.outputs]
        at = layout.outputs + first * columns.block
        wide[:, at : at + layout.width - layout.outputs] = rows[:, layout.outputs :]
        first += layout.carriers
        wide_parts.append(replace(parts, coefficients=wide.reshape(len(rows), -1)))
    return wide_parts[0] + wide_parts[1], columns
