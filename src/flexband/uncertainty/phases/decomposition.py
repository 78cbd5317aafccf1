"""Find the carriers of runs and separate them one after the other, in the order of energy."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from flexband.uncertainty.phases.carriers import Carrier, track

MAX_CARRIERS = 3
MAX_PEAKS = 2
"""Peaks of the spectrum that are tried for each further carrier."""

PASSES = 3
"""Corrections of the phase of a new carrier."""

MIN_CYCLES = 6.0
"""Fewest periods of a carrier in the record."""

MIN_TIMES = 32
BAND_RATIO = 1.15
"""Ratio of the ends of a frequency band to its middle."""

MIN_ENERGY = 1e-5
"""Least energy of a carrier, as a fraction of that of the variation between the runs."""

HARMONIC_TOLERANCE = 0.03
"""Relative distance from a multiple of the first carrier within which a lost carrier is tried as
its harmonic."""


class Stage(NamedTuple):
    """Runs split into base and carriers, F = base + Σ Re[Z e^{iφ}] in every run.

    base : shape (runs, outputs, times).
    """

    carriers: list[Carrier]
    base: np.ndarray

    @property
    def signal(self) -> np.ndarray:
        """F, the sum of base and carriers."""
        return sum((c.signal for c in self.carriers), self.base)

    def runs(self, which: slice) -> Stage:
        """Return some of the runs."""
        return Stage([c.runs(which) for c in self.carriers], self.base[which])

    def at(self, times: slice) -> Stage:
        """Return the runs at some of the times."""
        return Stage([c.at(times) for c in self.carriers], self.base[..., times])

    def copy(self) -> Stage:
        """Return a copy, which keeps no other runs or times in memory."""
        carriers = [Carrier(c.phase.copy(), c.envelope.copy(), c.frequency) for c in self.carriers]
        return Stage(carriers, self.base.copy())


def decompose(F: np.ndarray, dt: float) -> Iterator[Stage]:
    """Yield the runs with 0, 1, 2, … carriers, until no further one is found.

    A new carrier is tracked in the rest of the runs without the earlier ones; then each carrier is
    tracked once more in the rest without all others. If a carrier is lost but its frequency is near
    a multiple h of the first one, it is tried as a harmonic, with the phase h φ₁.

    A stage takes 1 + 2c times the memory of the runs with c carriers. Those that are released by
    the caller are not kept.

    Parameters
    ----------
    F : shape (runs, outputs, times), at steps of dt.
    """
    carriers: list[Carrier] = []
    rest = F
    yield Stage([], rest)
    scale = np.sqrt([np.mean(series.var(axis=-1)) for series in np.moveaxis(F, 1, 0)])
    scale, least = np.where(scale > 0, scale, 1.0), 0.0
    multiples: list[int] = []  # of the first carrier's phase; 0: not a harmonic
    while F.shape[-1] >= MIN_TIMES and len(carriers) < MAX_CARRIERS:
        energy, varying = spectra(rest, scale)
        least = least if carriers else MIN_ENERGY * varying.sum()
        peaks = detect(energy, varying, F.shape[-1], dt, least)[:MAX_PEAKS]
        new, multiple = _next_carrier(rest, dt, carriers, scale, peaks)
        if new is None:
            break
        carriers, rest = [*carriers, new], np.copy(rest)  # earlier stages keep theirs
        new.add_to(rest, -1.0)
        multiples.append(multiple)
        for j in range(len(carriers) if len(carriers) > 1 else 0):
            old, h = carriers[j], multiples[j]
            old.add_to(rest)
            psi = h * carriers[0].phase if h else old.phase
            again = track(rest, dt, old.frequency, psi, scale, 0 if h else 1)
            carriers[j] = old if again is None else again
            carriers[j].add_to(rest, -1.0)
        yield Stage(carriers, rest)


def _next_carrier(
    rest: np.ndarray,
    dt: float,
    carriers: list[Carrier],
    scale: np.ndarray,
    peaks: list[np.ndarray],
) -> tuple[Carrier | None, int]:
    """Return the first carrier that can be tracked, and its multiple of the first found, or 0."""
    ramp = 2 * np.pi * dt * np.arange(rest.shape[-1])
    for frequencies in peaks:
        middle = float(frequencies.mean())
        carrier = track(rest, dt, middle, frequencies[:, None] * ramp, scale, PASSES)
        if carrier is not None:
            return carrier, 0
        ratio = middle / carriers[0].frequency if carriers else 0.0
        multiple = round(ratio)
        if multiple > 1 and abs(ratio / multiple - 1) < HARMONIC_TOLERANCE:
            carrier = track(rest, dt, middle, multiple * carriers[0].phase, scale, 0)
            return carrier, multiple
    return None, 0


def detect(
    energy: np.ndarray, varying: np.ndarray, times: int, dt: float, least: float
) -> list[np.ndarray]:
    """Return the frequency in every run, shape (runs,), of each candidate, the strongest first.

    A candidate is a maximum of the energy E(f) of the variation between the runs in the band
    [f/b, b f], if it is twice the energy of the neighbouring bands. The frequency in a run is the
    centre of its energy in [f/1.25, 1.25 f].

    Parameters
    ----------
    energy, varying : `spectra` of the runs, at so many times.
    """
    frequency = np.fft.rfftfreq(times, dt)
    summed = np.concatenate([[0.0], np.cumsum(varying)])

    def band(f: np.ndarray) -> np.ndarray:
        low, high = (np.searchsorted(frequency, g) for g in (f / BAND_RATIO, BAND_RATIO * f))
        return summed[high] - summed[low]

    band_energy = band(frequency)
    ok = (frequency >= MIN_CYCLES / (times * dt)) & (frequency <= 0.4 / dt) & (band_energy > least)
    for beside in (frequency / BAND_RATIO**2, frequency * BAND_RATIO**2):
        ok &= band_energy > 2 * band(beside)
    candidates = []
    while ok.any():
        peak = frequency[np.argmax(np.where(ok, band_energy, 0.0))]
        near = energy * ((frequency > peak / 1.25) & (frequency < peak * 1.25))
        candidates.append(near @ frequency / np.maximum(near.sum(1), 1e-300))
        ok &= (frequency < peak / 1.5) | (frequency > peak * 1.5)
    return candidates


def spectra(F: np.ndarray, scale: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the energy of all outputs by frequency, and that of their variation between the runs.

    Shapes are (runs, frequencies) and (frequencies,). A linear trend is removed and a Hann window
    applied.
    """
    runs, _, times = F.shape
    x, window = np.linspace(-1, 1, times), np.hanning(times)
    energy, varying = np.zeros((runs, times // 2 + 1)), np.zeros(times // 2 + 1)
    for G, size in zip(np.moveaxis(F, 1, 0), scale, strict=True):
        bent = G - G.mean(axis=-1, keepdims=True)
        bent -= (G @ x / (x @ x))[:, None] * x
        bent *= window / size
        z = np.fft.rfft(bent)
        energy += np.abs(z) ** 2
        varying += np.sum(np.abs(z - z.mean(axis=0)) ** 2, axis=0)
    return energy, varying
