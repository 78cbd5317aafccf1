"""Find the carriers of runs, in order of energy, and split them off one after the other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexband.uncertainty.phases.carriers import Carrier, track

MOST_CARRIERS = 3
CANDIDATES = 2
"""Peaks that are tried for each further carrier."""

PASSES = 3
CYCLES = 6.0
"""Fewest periods in the record of what counts as a carrier."""

FEWEST_TIMES = 32
BAND = 1.15
"""Factor from the middle of a frequency band to its ends."""

LEAST = 1e-5
"""Energy of a carrier, as a part of that of the variation between the runs."""

HARMONIC = 0.03
"""How far from a multiple of the first carrier a lost one may be to be tried as its harmonic."""


class Stage(NamedTuple):
    """Runs as carriers and base, F = base + Σ Re[Z e^{iφ}] in every run.

    base : shape (runs, outputs, times).
    """

    carriers: list[Carrier]
    base: np.ndarray

    @property
    def signal(self) -> np.ndarray:
        """F, base and carriers together."""
        return sum((c.signal for c in self.carriers), self.base)

    def runs(self, which: slice) -> Stage:
        """Return some of the runs."""
        return Stage([c.runs(which) for c in self.carriers], self.base[which])


def decompose(F: np.ndarray, dt: float) -> list[Stage]:
    """Return the runs with 0, 1, 2, … carriers, until no further one is found.

    A new carrier is tracked in what the earlier ones leave; then each is split once more from what
    all others leave. Where a carrier is lost but lies near a multiple h of the first one, it is
    tried as its harmonic, with the phase h φ₁.

    Parameters
    ----------
    F : shape (runs, outputs, times), at steps of dt.
    """
    stages = [Stage([], F)]
    scale = np.sqrt(np.mean((F - F.mean(-1, keepdims=True)) ** 2, axis=(0, 2)))
    scale = np.where(scale > 0, scale, 1.0)
    least = LEAST * spectrum(F - F.mean(0), scale).sum()
    multiples: list[int] = []  # of the first carrier's phase, 0 for a phase of its own
    while F.shape[-1] >= FEWEST_TIMES and len(stages) <= MOST_CARRIERS:
        found, rest = stages[-1]
        new, multiple = _next_carrier(rest, dt, found, scale, least)
        if new is None:
            break
        carriers, rest = [*found, new], rest - new.signal
        multiples.append(multiple)
        for j in range(len(carriers) if found else 0):
            old, h = carriers[j], multiples[j]
            rest = rest + old.signal
            psi = h * carriers[0].phase if h else old.phase
            again = track(rest, dt, old.frequency, psi, scale, 0 if h else 1)
            carriers[j] = old if again is None else again
            rest = rest - carriers[j].signal
        stages.append(Stage(carriers, rest))
    return stages


def _next_carrier(
    rest: np.ndarray, dt: float, found: list[Carrier], scale: np.ndarray, least: float
) -> tuple[Carrier | None, int]:
    """Return the strongest carrier that can be tracked, and its multiple of the first, or 0."""
    ramp = 2 * np.pi * dt * np.arange(rest.shape[-1])
    for frequencies in detect(rest, dt, scale, least)[:CANDIDATES]:
        middle = float(frequencies.mean())
        carrier = track(rest, dt, middle, frequencies[:, None] * ramp, scale, PASSES)
        if carrier is not None:
            return carrier, 0
        ratio = middle / found[0].frequency if found else 0.0
        multiple = round(ratio)
        if multiple > 1 and abs(ratio / multiple - 1) < HARMONIC:
            carrier = track(rest, dt, middle, multiple * found[0].phase, scale, 0)
            return carrier, multiple
    return None, 0


def detect(F: np.ndarray, dt: float, scale: np.ndarray, least: float) -> list[np.ndarray]:
    """Return the frequency of every run, shape (runs,), of each candidate, the strongest first.

    Of the energy E(f) of the variation between the runs in the band [f/b, b f], a candidate is a
    largest value that is twice that of the bands next to it. A run's own frequency is the centre of
    its energy in [f/1.25, 1.25 f].
    """
    times = F.shape[-1]
    frequency = np.fft.rfftfreq(times, dt)
    own = spectrum(F, scale)
    varying = spectrum(F - F.mean(0), scale).sum(0)
    summed = np.concatenate([[0.0], np.cumsum(varying)])

    def band(f: np.ndarray) -> np.ndarray:
        high, low = np.searchsorted(frequency, BAND * f), np.searchsorted(frequency, f / BAND)
        return summed[high] - summed[low]

    here = band(frequency)
    ok = (frequency >= CYCLES / (times * dt)) & (frequency <= 0.4 / dt) & (here > least)
    ok &= (here > 2 * band(frequency / BAND**2)) & (here > 2 * band(frequency * BAND**2))
    found = []
    while ok.any():
        peak = frequency[np.argmax(np.where(ok, here, 0.0))]
        near = own * ((frequency > peak / 1.25) & (frequency < peak * 1.25))
        found.append(near @ frequency / np.maximum(near.sum(1), 1e-300))
        ok &= (frequency < peak / 1.5) | (frequency > peak * 1.5)
    return found


def spectrum(F: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Return the energy of all outputs by frequency, (runs, frequencies): Hann window, no trend."""
    times = F.shape[-1]
    x = np.linspace(-1, 1, times)
    G = F - F.mean(-1, keepdims=True)
    G = G - x * (G @ x)[..., None] / (x @ x)
    return np.sum(np.abs(np.fft.rfft(G * np.hanning(times) / scale[:, None])) ** 2, axis=1)
