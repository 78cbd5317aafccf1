"""Columns of the parts of a response, and of the smooth moments that follow from them.

Both descriptions are tuples of numbers, which compiled functions accept.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations, combinations_with_replacement
from typing import NamedTuple

import numpy as np

from flexband.uncertainty.phases.decomposition import Stage

Carriers = list[tuple[np.ndarray, np.ndarray, np.ndarray]]
"""φ of shape (…, 1, times), Re Z and Im Z of shape (…, outputs, times), of each carrier."""


class PartColumns(NamedTuple):
    """The columns of the parts at one time: the base of every output, then a block per carrier.

    A block has φ, Re Z of every output and Im Z of every output. The series of the parts are these
    columns with all times of one after the other.
    """

    outputs: int
    carriers: int
    # columns of φ and, for the first output, of Re Z and Im Z of the first carrier; those of
    # carrier c are c blocks further
    phase: int
    real: int
    imag: int
    block: int  # number of columns of a carrier

    @staticmethod
    def from_outputs(outputs: int, carriers: int) -> PartColumns:
        return PartColumns(
            outputs, carriers, outputs, outputs + 1, 2 * outputs + 1, 2 * outputs + 1
        )

    @staticmethod
    def of_stage(stage: Stage) -> PartColumns:
        return PartColumns.from_outputs(stage.base.shape[1], len(stage.carriers))

    @property
    def width(self) -> int:
        return self.phase + self.carriers * self.block

    @property
    def phases(self) -> slice:
        """The columns of all φ."""
        return slice(self.phase, None, self.block)

    def pack(self, stage: Stage) -> np.ndarray:
        """Return the parts of runs as series, shape (runs, columns × times).

        They are a copy if there are carriers.
        """
        runs, _, times = stage.base.shape
        if not stage.carriers:
            return stage.base.reshape(runs, self.width * times)
        packed = np.empty((runs, self.width, times))
        base, carriers = self.unpack(packed.reshape(runs, self.width * times))
        base[:] = stage.base
        for columns, c in zip(carriers, stage.carriers, strict=True):
            parts = c.phase[:, None], np.real(c.envelope), np.imag(c.envelope)
            for part, values in zip(columns, parts, strict=True):
                part[:] = values
        return packed.reshape(runs, self.width * times)

    def unpack(self, series: np.ndarray) -> tuple[np.ndarray, Carriers]:
        """Return the base, shape (…, outputs, times), and the parts of each carrier."""
        times = series.shape[-1] // self.width
        rows = series.reshape(*series.shape[:-1], self.width, times)
        starts = range(self.phase, self.width, self.block)
        blocks = (rows[..., first : first + self.block, :] for first in starts)
        split = 1 + self.outputs
        return rows[..., : self.outputs, :], [
            (block[..., :1, :], block[..., 1:split, :], block[..., split:, :]) for block in blocks
        ]

    def join(self, series: np.ndarray, *, single: bool = False) -> np.ndarray:
        """Return F = base + Σ Re[Z e^{iφ}] of series of the parts, shape (…, outputs, times).

        Without carriers this is a view of the series. With `single`, cos φ and sin φ are computed
        in single precision, ten times as fast.
        """
        base, carriers = self.unpack(series)
        F = base.copy() if self.carriers else base
        for phase, re, im in carriers:
            angle = phase
            if single:
                angle = (phase - 2 * np.pi * np.rint(phase / (2 * np.pi))).astype(np.float32)
            F += re * np.cos(angle)
            F -= im * np.sin(angle)
        return F

    def parts(self, series: int) -> Iterator[np.ndarray]:
        """Yield the numbers of the series of the base, and of φ and of Z of each carrier.

        Shapes are (outputs, times), (1, times) and (2 × outputs, times).
        """
        rows = np.arange(series).reshape(self.width, -1)
        yield rows[: self.outputs]
        for first in range(self.phase, self.width, self.block):
            yield rows[first : first + 1]
            yield rows[first + 1 : first + self.block]

    def of_outputs(self, which: np.ndarray) -> np.ndarray:
        """Return the columns of some outputs, counted from 0."""
        columns = np.concatenate([[self.phase], self.real + which, self.imag + which])
        blocks = self.block * np.arange(self.carriers)[:, None] + columns
        return np.concatenate([which, blocks.ravel()])


class MomentColumns(NamedTuple):
    """The columns of a table of smooth moments: those of each output, then φ̄ of each carrier.

    An output has the smooth part of μ, E b; the smooth part of σ²; and the complex factors of what
    turns with the phases: E u_c in μ, and one factor per row of `turning_parts` in σ².
    """

    outputs: int
    carriers: int
    turns: int  # number of turning parts of σ²
    mean: int  # column of the smooth part of μ of an output
    variance: int  # of σ²
    mean_real: int  # first columns of the factors of an output
    mean_imag: int
    turn_real: int
    turn_imag: int
    block: int  # number of columns of an output
    phase: int  # first column of φ̄

    @staticmethod
    def from_outputs(outputs: int, carriers: int) -> MomentColumns:
        turns = len(turning_parts(carriers))
        factors = 2, 2 + carriers, 2 + 2 * carriers, 2 + 2 * carriers + turns
        block = 2 + 2 * carriers + 2 * turns
        return MomentColumns(outputs, carriers, turns, 0, 1, *factors, block, outputs * block)

    @property
    def width(self) -> int:
        return self.phase + self.carriers


def turning_parts(carriers: int) -> np.ndarray:
    """Return what turns in σ²: first rows (c, −1, 0) for φ̄_c, then (c, d, ±1) for φ̄_c ± φ̄_d."""
    numbers = range(carriers)
    sums = [(c, d, 1) for c, d in combinations_with_replacement(numbers, 2)]
    differences = [(c, d, -1) for c, d in combinations(numbers, 2)]
    return np.array([(c, -1, 0) for c in numbers] + sums + differences, dtype=int).reshape(-1, 3)
