"""The parts of runs, in numbers that can be compared: which terms they need is told by them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from flexband.uncertainty.phases.decomposition import Stage
from flexband.uncertainty.phases.layout import PartColumns
from flexband.uncertainty.surrogates.diagnostics import rms


def compared_times(stage: Stage, count: int = 128) -> Stage:
    """Return a stage at about so many of the times, without the memory of all of them."""
    some = stage.at(slice(None, None, max(1, stage.base.shape[-1] // count)))
    return some.copy() if stage.carriers else some


class Split(NamedTuple):
    """All runs split into parts, with the numbers of carriers that are in use.

    Attributes
    ----------
    stages : all runs, those of the design first, at `compared_times`.
    outputs : the outputs that each stage stands for.
    xi, eta : of the held-out runs, which are the last.
    """

    stages: list[Stage]
    outputs: list[np.ndarray]
    xi: np.ndarray
    eta: np.ndarray

    @staticmethod
    def of(stages: Sequence[Stage], carriers: np.ndarray, xi: np.ndarray, eta: np.ndarray) -> Split:
        """Take the stages that outputs use, by the number of carriers of each output.

        A stage with fewer carriers stands for one that has not been found.
        """
        carriers = np.minimum(carriers, len(stages) - 1)
        used = np.unique(carriers)
        outputs = [np.flatnonzero(carriers == k) for k in used]
        return Split([stages[k] for k in used], outputs, xi, eta)

    def rows(self, combined: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        """Return combinations of runs, relative to the size of each output, (rows, parts, times).

        Parts are the base, real and imaginary part of each envelope, and phases times the mean
        envelope, of every output.

        Parameters
        ----------
        combined : makes rows of the parts of all runs, (runs, series) to (rows, series).
        """
        parts = []
        for stage, which in zip(self.stages, self.outputs, strict=True):
            columns, size = PartColumns.of_stage(stage), rms(stage.signal)[which, None] + 1e-300
            base, carriers = columns.unpack(combined(columns.pack(stage)))
            parts.append(base[:, which] / size)
            for (phase, re, im), c in zip(carriers, stage.carriers, strict=True):
                mean = np.abs(c.envelope).mean(axis=0)[which]
                parts += [part / size for part in (re[:, which], im[:, which], phase * mean)]
        return np.concatenate(parts, axis=1)
