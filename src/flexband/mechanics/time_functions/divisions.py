"""Divisions of steps in which a load changes fast between its kinks and jumps, as in short pulses.

A load that does so in most steps is left to averages.
"""

from __future__ import annotations

import numpy as np

from flexband.mechanics.time_functions.averages import Averaging, ChordMiss
from flexband.mechanics.time_functions.breakpoints import Breakpoints, few
from flexband.mechanics.time_functions.evaluation import Evaluation


def divisions(
    at: Evaluation,
    times: np.ndarray,
    missed: ChordMiss,
    located: Breakpoints,
    averaging: Averaging,
    *,
    points: int = 17,
    remaining_miss: float = 1e-3,
    max_parts: int = 32,
    max_divided: float = 0.25,
) -> Breakpoints:
    """Return times that divide steps so that a function is nearly linear between them.

    `points` on each part of a step tell how far it is from its chord, relative to its range;
    `max_divided` is the part of the steps up to which those that miss little are divided.
    """
    h, last = times[1] - times[0], len(times) - 2
    at_break = np.clip(((located.after - times[0]) / h).astype(int), 0, last)
    looked_at = averaging.noticed(missed)
    looked_at[at_break, located.column] = True
    steps, columns = np.nonzero(looked_at)
    step, column = np.r_[steps, at_break], np.r_[columns, located.column]
    before, low = np.r_[times[steps], located.before], np.r_[times[steps], located.after]
    order = np.lexsort((low, step, column))
    step, column, before, low = (array[order] for array in (step, column, before, low))
    high = times[step + 1]
    same = (np.diff(column) == 0) & (np.diff(step) == 0)
    high[:-1] = np.where(same, before[1:], high[:-1])
    grid = np.linspace(low, np.maximum(low, high), points, axis=1)
    f = at.points(grid.ravel(), np.repeat(column, points)).reshape(grid.shape)
    chords = np.linspace(f[:, 0], f[:, -1], points, axis=1)
    miss = np.abs(f - chords).max(axis=1, initial=0.0) / missed.spread[column]
    brief = few(column[miss > averaging.noticed_miss], at.columns, max_divided * (last + 1))
    chosen = miss > np.where(brief, averaging.noticed_miss, averaging.min_miss)[column]
    parts = np.ceil(np.sqrt(miss / remaining_miss)).clip(1, max_parts)
    parts = np.where(chosen, parts, 1).astype(int)
    part = np.repeat(np.arange(len(parts)), parts - 1)
    place = np.arange(len(part)) - np.searchsorted(part, part) + 1
    moments = low[part] + (high - low)[part] * place / parts[part]
    divided = Breakpoints(column[part], moments, moments, np.full(len(part), np.inf))
    return divided.those(few(divided.column, at.columns, last + 1)[divided.column])
