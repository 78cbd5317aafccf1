"""Functions of time as polynomials in each round of a run, for steps that end anywhere in it.

A polynomial is one in u, from −1 at the start of the round to 1 at its end.
Rounds end at kinks and jumps, so that functions are smooth in them. A round in which a polynomial
is off by more than is allowed is halved, in each sample for itself.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from flexband.errors import InputError
from flexband.mechanics.kernels.forms import COEFFICIENTS
from flexband.mechanics.time_functions.schedule import Schedule


class SmoothFunction(Protocol):
    """A function of time with one column per sample or one that all samples share."""

    @property
    def name(self) -> str: ...
    @property
    def columns(self) -> int: ...
    @property
    def prescribes(self) -> bool: ...
    def points(self, times: np.ndarray, columns: np.ndarray) -> np.ndarray: ...


@dataclass(frozen=True)
class PolynomialFit:
    """How functions become polynomials."""

    error_part: float = 1e-2
    """Error of a polynomial, relative to the range of the function in the run, over the tolerance
    of the steps."""
    motion_part: float = 1e-5
    """The same of a prescribed motion, whose second derivative matters."""
    rounding: float = 1e-13
    """Error that counts as none, relative to the largest value."""
    halvings: int = 12
    """The most of a round."""

    def fit(
        self, functions: Sequence[SmoothFunction], schedule: Schedule, times: np.ndarray,
        tolerance: float,
    ) -> tuple[Schedule, np.ndarray]:  # fmt: skip
        """Fit polynomials; return rounds and coefficients (rounds, 1 + functions, …, n or 1)."""
        fits: list[tuple[np.ndarray, np.ndarray]] = []
        # Halve rounds until all polynomials fit.
        for halving in range(self.halvings + 1):
            fits = [self._fit(function, schedule, tolerance) for function in functions]
            off_masks = [off for _, off in fits]
            width = max([schedule.parts.shape[1], *(off.shape[1] for off in off_masks)])
            step_mask = np.zeros((len(schedule.parts), width), dtype=bool)
            for off in off_masks:
                step_mask |= off
            if not step_mask.any():
                break
            if halving == self.halvings:
                k = next(k for k, off in enumerate(off_masks) if off.any())
                moment = schedule.times[np.argwhere(off_masks[k])[0, 0], 0]
                raise InputError(
                    f"{functions[k].name} is not smooth near t = {moment:.6g} s, even in "
                    f"2^{self.halvings} parts of a step; steps that are chosen freely need that"
                )
            schedule = schedule.halve_steps(step_mask, times)
        # Put the function 1 in front, and give all the same number of columns.
        constant = np.zeros((len(schedule.parts), COEFFICIENTS, 1))
        constant[:, 0] = 1.0
        parts = [constant, *(coefficients for coefficients, _ in fits)]
        width = max(part.shape[2] for part in parts)
        return schedule, np.stack(
            [np.broadcast_to(part, (*part.shape[:2], width)) for part in parts], axis=1
        )

    def _fit(
        self, function: SmoothFunction, schedule: Schedule, tolerance: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return coefficients, shape (rounds, `COEFFICIENTS`, n or 1), and where they are off."""
        # Points of Chebyshev to interpolate at, and points between them to check at.
        degree = COEFFICIENTS - 1
        width = max(function.columns, schedule.parts.shape[1])
        nodes = -np.cos(np.pi * np.arange(degree + 1) / degree)
        checks = -np.cos(np.pi * (np.arange(degree) + 0.5) / degree)
        places = np.concatenate([nodes, checks])
        shape = (len(schedule.parts), width)
        stepping = np.broadcast_to(schedule.parts > 0, shape)
        end = np.broadcast_to(schedule.limits, shape)
        start = np.concatenate([end[:1], end[:-1]])
        # Evaluate the function at both in each step.
        row, column = np.nonzero(stepping[1:])
        low = start[row + 1, column]
        high = end[row + 1, column]
        moments = low[:, None] + 0.5 * (1 + places) * (high - low)[:, None]
        columns = np.repeat(column % function.columns, len(places))
        f = function.points(moments.ravel(), columns).reshape(moments.shape)
        # Interpolate, and measure the error between the points.
        inverse = np.linalg.inv(np.vander(nodes, increasing=True))
        c = np.stack([_weighted_sum(weights, f.T[: degree + 1]) for weights in inverse])
        powers = np.vander(checks, COEFFICIENTS, increasing=True)
        polynomial_values = np.stack([_weighted_sum(weights, c) for weights in powers])
        error = np.abs(polynomial_values - f[:, degree + 1 :].T).max(axis=0)
        # Compare it with the range of the function in the run.
        lowest, highest = np.full((2, width), [[np.inf], [-np.inf]])
        np.minimum.at(lowest, column, f.min(axis=1))
        np.maximum.at(highest, column, f.max(axis=1))
        part = self.motion_part if function.prescribes else self.error_part
        max_error = np.maximum(
            part * tolerance * (highest - lowest),
            self.rounding * np.maximum(np.abs(lowest), np.abs(highest)),
        )
        coefficients = np.zeros((shape[0], COEFFICIENTS, width))
        off = np.zeros(shape, dtype=bool)
        coefficients[row + 1, :, column] = c.T
        off[row + 1, column] = error > max_error[column]
        return coefficients, off


def rates(polynomials: np.ndarray, schedule: Schedule, step: float) -> np.ndarray:
    """Return f′ and f″ at ends of steps, or after them, (rounds, 2, functions, n or 1)."""
    count = len(polynomials)
    width = polynomials.shape[-1]
    # Of each round, select its own step, or else the next one.
    stepping = np.broadcast_to(schedule.parts > 0, (count, schedule.parts.shape[1])).copy()
    stepping[0] = False
    place = np.arange(count)[:, None]
    after = np.where(stepping, place, count)
    after = np.minimum.accumulate(after[::-1], axis=0)[::-1]
    before = np.maximum.accumulate(np.where(stepping, place, 0), axis=0)
    number = np.where(stepping | (after == count), before, np.minimum(after, count - 1))
    u = np.where(stepping | (after == count), 1.0, -1.0)
    # Differentiate its polynomial there.
    columns = np.arange(max(width, number.shape[1]))
    number = number[:, columns % number.shape[1]]
    u = u[:, columns % u.shape[1]]
    c = polynomials[number, :, :, columns % width]  # (rounds, n, functions, coefficients)
    lengths = step * schedule.parts[number, columns % schedule.parts.shape[1]]
    scale = (2.0 / np.where(lengths > 0, lengths, 1.0))[..., None]
    first, second = np.zeros((2, *c.shape[:3]))
    for k in range(1, COEFFICIENTS):
        power = u[..., None] ** (k - 1)
        first = first + k * c[..., k] * power
        if k > 1:
            second = second + k * (k - 1) * c[..., k] * u[..., None] ** (k - 2)
    return np.stack([scale * first, scale**2 * second], axis=1).transpose(0, 1, 3, 2)


def pad_with_parabolas(
    polynomials: np.ndarray, values: np.ndarray, rates: np.ndarray, schedule: Schedule, step: float
) -> np.ndarray:
    """Replace the polynomials of rounds that are no steps by parabolas about the place 0."""
    width = max(rows.shape[-1] for rows in (polynomials, values, rates, schedule.parts))
    c = np.array(np.broadcast_to(polynomials, (*polynomials.shape[:3], width)))
    for k, row in enumerate((values, step / 2 * rates[:, 0], step**2 / 8 * rates[:, 1])):
        c[:, :, k] = np.where(schedule.parts[:, None] > 0, c[:, :, k], row)
    return c


def _weighted_sum(weights: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return Σ weights_k values_k in the order of k, which products of matrices do not keep."""
    total = weights[0] * values[0]
    for weight, value in zip(weights[1:], values[1:], strict=True):
        total = total + weight * value
    return total
