"""Local mean decomposition, and the expansion of amplitude, phase and residual that rests on it.

Smith (2005) splits a signal into product functions, each an envelope times a pure frequency
modulation. Jiang and Bai (2022) expand the amplitude and the phase of each, and the residual, in
Chebyshev polynomials of interval inputs. Here the expansion is the hybrid one, on the points of
improved PCCI, so that the split alone makes the difference.
"""

from __future__ import annotations

import numpy as np
from scipy.ndimage import uniform_filter1d

from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.expansions.hybrid import HybridExpansion

SMOOTHINGS = 12
NORMALIZATIONS = 30
"""Most passes of the moving average, and most divisions by an envelope."""

PURE = 0.01
"""Mean deviation from 1 of the envelope of a pure frequency modulation."""

COMPONENTS = 2
"""Most product functions of a run."""

MIN_EXTREMES = 12
"""Of a product function: six periods, as flexband requires of a carrier."""


def product_function(signal: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """Return amplitude and phase of the fastest component of a signal; None if there is none."""
    modulation = signal
    amplitude = np.ones_like(signal)
    if len(_extremes(signal)) < MIN_EXTREMES:
        return None
    for _ in range(NORMALIZATIONS):
        if len(_extremes(modulation)) < MIN_EXTREMES:
            return None
        mean, envelope = _local_levels(modulation)
        modulation = (modulation - mean) / envelope
        amplitude = amplitude * envelope
        if np.mean(np.abs(envelope - 1)) < PURE:
            break
    turn = np.arccos(np.clip(modulation, -1, 1))
    falling = np.gradient(modulation) < 0
    return amplitude, np.unwrap(np.where(falling, turn, -turn))


def _extremes(signal: np.ndarray) -> np.ndarray:
    slope = np.sign(np.diff(signal))
    return np.flatnonzero(slope[1:] * slope[:-1] < 0) + 1


def _local_levels(signal: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return local mean and envelope: means and half differences of extremes, smoothed."""
    nodes = np.concatenate([[0], _extremes(signal), [len(signal) - 1]])
    values = signal[nodes]
    lengths = np.diff(nodes)
    lengths[-1] += 1
    width = int(max(3, lengths[1:-1].max() // 3 * 2 + 1))
    levels = []
    for level in ((values[1:] + values[:-1]) / 2, np.abs(np.diff(values)) / 2):
        steps = np.repeat(level, lengths)
        for _ in range(SMOOTHINGS):
            if np.all(np.diff(steps) != 0):
                break
            steps = uniform_filter1d(steps, width, mode="nearest")
        levels.append(steps)
    tiny = 1e-9 * np.abs(signal).max()
    return levels[0], np.maximum(levels[1], tiny)


def split(runs: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return amplitudes and phases (runs, components, times) and residuals (runs, times).

    All runs have as many components as the one with the fewest. Phases start as close to that of
    the first run as full turns allow.
    """
    run_components = [_components(run) for run in runs]
    count = min(map(len, run_components))
    amplitudes = np.zeros((len(runs), count, runs.shape[1]))
    phases = np.zeros_like(amplitudes)
    for run, components in enumerate(run_components):
        for k, (amplitude, phase) in enumerate(components[:count]):
            turns = np.round((phase[0] - phases[0, k, 0]) / (2 * np.pi)) if run else 0.0
            amplitudes[run, k] = amplitude
            phases[run, k] = phase - 2 * np.pi * turns
    return amplitudes, phases, runs - (amplitudes * np.cos(phases)).sum(axis=1)


def _components(run: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    components = []
    while len(components) < COMPONENTS and (component := product_function(run)):
        components.append(component)
        run = run - component[0] * np.cos(component[1])
    return components


class SplitExpansion:
    """Expansions of amplitudes, phases and residual on a tensor design.

    Parameters
    ----------
    runs : values of one output, shape (runs, times), at the points of `HybridExpansion.design`.
    families, orders, nodes : as of `HybridExpansion.fit`.
    """

    def __init__(self, runs, families: tuple[Family, ...], orders, nodes):
        parts = split(runs)
        self.count, self.times = parts[0].shape[1:]
        joint = np.concatenate([part.reshape(len(runs), -1) for part in parts], axis=1)
        self.expansion = HybridExpansion.fit(joint, families, orders, nodes)

    def evaluate(self, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        """Return the output at ξ and η, shape (points, times)."""
        values = self.expansion.evaluate(xi, eta).reshape(len(xi), -1, self.times)
        amplitudes = values[:, : self.count]
        phases = values[:, self.count : 2 * self.count]
        return (amplitudes * np.cos(phases)).sum(axis=1) + values[:, -1]
