"""What fits to some rows of a table miss of the others.

Terms are chosen again in every fold, and so is the number of carriers, without the rows that are
predicted.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from flexband.uncertainty.adaptive.fits import PartsFit
from flexband.uncertainty.phases.decomposition import Stage
from flexband.uncertainty.tables.design import TableDesign
from flexband.uncertainty.tables.places import levels_within


def cross_validated(
    design: TableDesign, stages: Sequence[Stage], F: np.ndarray, fold: np.ndarray, at: np.ndarray
) -> list[np.ndarray]:
    """Return what fits with 0, 1, … carriers miss of rows F, (rows, outputs, times) each.

    Of a variable that has few values in all rows, the rows of each value are a fold, too: what
    vanishes at all of these values, no other fold shows. The rows are at coordinates `at`.
    """
    missed = [missed_by_folds(design, stage, F, fold) for stage in stages]
    for level in levels_within(at):
        inside = level >= 0
        for of_stage, stage in zip(missed, stages, strict=True):
            new = missed_by_folds(design, stage, F, level)[inside]
            larger = np.mean(new**2, axis=-1) > np.mean(of_stage[inside] ** 2, axis=-1)
            of_stage[inside] = np.where(larger[..., None], new, of_stage[inside])
    return missed


def missed_by_folds(
    design: TableDesign, stage: Stage, F: np.ndarray, fold: np.ndarray
) -> np.ndarray:
    """Return what is missed of rows by the fits to the rows of all other folds, 0 in none."""
    missed = np.zeros_like(F)
    for rows, others in _splits(fold):
        fit = PartsFit.from_design(design.which(others), stage.part(runs=others))
        missed[rows] = F[rows] - fit.evaluate(design.xi[rows], design.eta[rows])
    return missed


def _splits(fold: np.ndarray) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield which rows are in each fold, and which are not; those below 0 are in none."""
    for k in np.unique(fold[fold >= 0]):
        yield fold == k, fold != k


def carriers_of(missed: Sequence[np.ndarray], weight: np.ndarray) -> np.ndarray:
    """Return the number of carriers with which least is missed of each output, (outputs,)."""
    square = [np.einsum("p,pot->o", weight, values**2) for values in missed]
    carrier_gain = 0.8  # a further carrier is used if it brings the error below this part
    handicap = carrier_gain ** (-2.0 * np.arange(len(missed)))
    return np.argmin(np.array(square) * handicap[:, None], axis=0)


def missed_with_carriers(
    missed: Sequence[np.ndarray], weight: np.ndarray, fold: np.ndarray
) -> np.ndarray:
    """Return what is missed of rows with as many carriers as the other folds choose."""
    with_carriers = np.empty_like(missed[0])
    for rows, others in _splits(fold):
        carriers = carriers_of([values[others] for values in missed], weight[others])
        for o, k in enumerate(carriers):
            with_carriers[rows, o] = missed[k][rows, o]
    return with_carriers
