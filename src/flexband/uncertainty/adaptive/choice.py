"""For each output, the fit that is best in runs it has not seen."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from flexband.uncertainty.adaptive.fits import PartsFit, Weights
from flexband.uncertainty.adaptive.rare_values import RareValues
from flexband.uncertainty.adaptive.response_runs import RareRuns, ResponseRuns
from flexband.uncertainty.expansions.expansion import Expansion
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.interpolation import Interpolation, in_place
from flexband.uncertainty.phases.expansion import expansion_of
from flexband.uncertainty.phases.layout import PartColumns
from flexband.uncertainty.surrogates.diagnostics import at_all_times, rms


class ChoiceOptions(NamedTuple):
    """How fits are compared."""

    # a further carrier is used for an output if it brings the error below this part
    carrier_gain: float = 0.8
    # a fit of more runs is better if its error is smaller by more than this part
    min_relative_gain: float = 1e-9
    max_times: int = 128  # at which growth at rare values is evaluated


def release(fits: list[PartsFit]) -> Iterator[PartsFit]:
    """Yield fits, and remove them from the list, so that those not chosen leave the memory."""
    while fits:
        yield fits.pop(0)


class BestHeldOutFit(NamedTuple):
    """The fit that misses least in the check runs."""

    missed: np.ndarray  # of check runs and of those fitted later, root mean square, (outputs,)
    overshoot: np.ndarray  # root mean square, (outputs,)
    values: RareValues  # at which it leaves the range of the runs by most
    taken: bool  # whether it is the choice for all outputs


class BestFits(NamedTuple):
    """The best fit of every output."""

    fits: list[PartsFit]  # each of the outputs for which it is the best
    missed: np.ndarray  # what is missed of check runs, shape (runs, outputs, times)
    later: np.ndarray  # and of runs that were fitted later, root mean square, (outputs, times)
    overshoot: np.ndarray  # of the fits, shape (outputs, times)
    doubted: BestHeldOutFit  # what grows at rare values, though it misses least

    @staticmethod
    def from_fits(
        fits: Iterable[PartsFit],
        fitted: ResponseRuns,
        holdout: ResponseRuns,
        generic: int,
        rare: RareRuns,
        weights: Weights | None = None,
        earlier_fits: int = 0,
        *,
        options: ChoiceOptions = ChoiceOptions(),
    ) -> BestFits:
        """Choose the fits that are best in runs they have not seen; further carriers have to pay.

        Fits are judged one after the other. Each is kept for the outputs for which it is the best
        so far, since a fit takes more memory than the runs.

        Parameters
        ----------
        fits : the earlier ones, each of other outputs, and then new ones of all outputs.
        generic : number of check runs at generic points; the others are at extremes.
        rare : runs at rare values.
        weights : of fitted runs; needed if a fit is of only the first of them.
        earlier_fits : number of earlier fits.
        """
        shape = holdout.values.shape
        thin = slice(None, None, -(-shape[-1] // options.max_times))
        all_runs = ResponseRuns.concatenate(holdout.at(thin), fitted.at(thin), rare.runs.at(thin))
        places = [np.concatenate([holdout.eta, fitted.eta]), holdout.eta[generic:]]
        later = np.empty(shape[1:])
        overshoot = np.empty(shape[1:])
        smallest_error = np.full(shape[1], np.inf)
        best = np.full(shape[1], -1)
        fits_by_number: dict[int, PartsFit] = {}
        closest: list[tuple[float, int, tuple[np.ndarray, np.ndarray, RareValues]]] = []
        size = np.maximum(rms(holdout.values), 1e-300)
        equal = np.full(shape[0], 1 / shape[0])
        for k, fit in enumerate(fits):
            # Judge the fit by what it misses of runs, and by its growth at rare values.
            excess, values = fit.overshoot(all_runs, places, rare, thin)
            excess = at_all_times(excess, thin, shape[-1])
            of_held = np.sqrt(fit.mean_square_missed(holdout, equal))
            runs_after = fitted.which(slice(fit.runs, None))
            counts = np.zeros(0) if weights is None else weights(fit.runs)
            after = np.sqrt(fit.mean_square_missed(runs_after, counts))
            alone = np.maximum(rms(of_held[None]), rms(after[None]))
            beyond = rms(excess[None])
            error = np.hypot(alone, beyond) / options.carrier_gain ** len(fit.frequencies)
            so_far = smallest_error[fit.outputs]
            is_earlier = best[fit.outputs] < earlier_fits
            better = error < (1 + options.min_relative_gain) * so_far
            better = np.where(is_earlier, (1 + options.min_relative_gain) * error <= so_far, better)
            if len(alone) == shape[1]:
                total = float(np.sum(alone / size[fit.outputs]))
                closest.append((total, k, (alone, beyond, values)))
            # Take it for the outputs for which it is the best so far, and drop fits without any.
            outputs = fit.outputs[better]
            smallest_error[outputs] = error[better]
            best[outputs] = k
            later[outputs] = after[better]
            overshoot[outputs] = excess[better]
            candidates = fits_by_number | {k: fit}
            fits_by_number = {
                j: f.of_outputs(np.flatnonzero(best == j))
                for j, f in candidates.items()
                if j in best
            }
            del fit, candidates  # while the next one is made, only those in use are in memory
        best_fits = [
            fits_by_number[k] for k in sorted(fits_by_number, key=lambda k: (k < earlier_fits, k))
        ]
        missed = np.empty(shape)
        for fit in best_fits:  # once more, since what all fits miss takes more memory
            for rows, of_rows in fit.residual_batches(holdout):
                missed[rows, fit.outputs] = of_rows
        # Of the fits of all outputs, the one that misses least may be doubted for its growth only.
        fewest = np.inf
        doubted = None
        of_all = False
        for total, k, judged in sorted(
            closest, key=lambda judged: (judged[1] < earlier_fits, judged[1])
        ):
            if total < (1 - options.min_relative_gain) * fewest:
                fewest = total
                doubted = judged
                of_all = bool(np.all(best == k))
        assert doubted is not None  # new fits are of all outputs
        return BestFits(best_fits, missed, later, overshoot, BestHeldOutFit(*doubted, of_all))

    def expansions(self, times: slice | np.ndarray = slice(None)) -> list[Expansion]:
        """Return the expansions of all outputs at some of the times, one for each fit."""
        return [fit.at(times).expansion for fit in self.fits]

    @property
    def carriers(self) -> np.ndarray:
        """The number of carriers of each output, shape (outputs,)."""
        carriers = np.empty(self.missed.shape[1], dtype=int)
        for fit in self.fits:
            carriers[fit.outputs] = len(fit.frequencies)
        return carriers

    @property
    def frequencies(self) -> list[float]:
        """Those of the fit with the most carriers."""
        return max((fit.frequencies for fit in self.fits), key=len)

    @property
    def orders(self) -> np.ndarray:
        """The highest order in each variable, η first."""
        return np.max([fit.parts.orders for fit in self.fits], axis=0)


def in_place_of_runs(
    pairs: Sequence[tuple[PartsFit, HybridExpansion | None]],
) -> tuple[tuple[Expansion, ...], tuple[Expansion, ...]]:
    """Return expansions of all outputs, with the changes of their parts, and these changes.

    Each fit is given with the change of its parts, or None. Where it can be, expansions take the
    memory of the runs. Neither the runs nor the fits can be used afterwards.
    """
    expansions = [
        (fit.expansion, change) for fit, change in pairs if not isinstance(fit.parts, Interpolation)
    ]
    linear = [pair for pair in pairs if isinstance(pair[0].parts, Interpolation)]
    if linear:
        numbers = np.sort(np.concatenate([fit.outputs for fit, _ in linear]))
        total = None
        for fit, change in linear:
            if change is not None:
                places = np.searchsorted(numbers, fit.outputs)
                wide_change = change.embed_rows(len(fit.outputs), len(numbers), places)
                total = wide_change if total is None else total + wide_change
        values = in_place([fit.parts for fit, _ in linear if isinstance(fit.parts, Interpolation)])
        expansions.append(
            (expansion_of(numbers, values, PartColumns.from_outputs(len(numbers), 0)), total)
        )
    if all(change is None for _, change in expansions):
        return tuple(expansion for expansion, _ in expansions), ()
    complete_pairs = [
        (expansion, expansion.hybrid.constant(0.0) if change is None else change)
        for expansion, change in expansions
    ]
    return (
        tuple(
            expansion.of_hybrid(expansion.hybrid + change) for expansion, change in complete_pairs
        ),
        tuple(expansion.of_hybrid(change) for expansion, change in complete_pairs),
    )
