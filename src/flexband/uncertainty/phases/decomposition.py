"""Find the carriers of runs and separate them one after the other, in the order of energy."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from flexband.uncertainty.phases.carriers import Carrier, CarrierOptions, track


class Stage(NamedTuple):
    """Runs split into base and carriers, F = base + Σ Re[Z e^{iφ}] in every run."""

    carriers: list[Carrier]
    base: np.ndarray  # shape (runs, outputs, times)

    @property
    def signal(self) -> np.ndarray:
        """F, the sum of base and carriers."""
        signal = np.copy(self.base) if self.carriers else self.base
        for carrier in self.carriers:
            carrier.add_to(signal)
        return signal

    def part(
        self,
        runs: slice | np.ndarray = slice(None),
        outputs: slice | np.ndarray = slice(None),
        times: slice = slice(None),
    ) -> Stage:
        """Return some of the runs, outputs and times."""
        carriers = [carrier.part(runs, outputs, times) for carrier in self.carriers]
        return Stage(carriers, self.base[runs, outputs, times])

    def copy(self) -> Stage:
        """Return a copy, which keeps no other runs or times in memory."""
        carriers = [Carrier(c.phase.copy(), c.envelope.copy(), c.frequency) for c in self.carriers]
        return Stage(carriers, self.base.copy())


def decompose(
    F: np.ndarray, dt: float, *, options: CarrierOptions = CarrierOptions()
) -> Iterator[Stage]:
    """Yield the runs with 0, 1, 2, … carriers, until no further one is found.

    A new carrier is tracked in the rest of the runs without the earlier ones; then each carrier is
    tracked once more in the rest without all others. If a carrier is lost but its frequency is near
    a multiple h of the first one, it is tried as a harmonic, with the phase h φ₁.

    The runs F have the shape (runs, outputs, times), at steps of dt. A stage takes 1 + 2c times the
    memory of the runs with c carriers. Those that are released by the caller are not kept.
    """
    yield Stage([], F)
    separation = Separation(F, dt, options)
    min_energy = 0.0
    while F.shape[-1] >= options.min_times and len(separation.carriers) < options.max_carriers:
        energy, varying = spectra(separation.rest, separation.scale)
        min_energy = min_energy if separation.carriers else options.min_energy * varying.sum()
        peaks = detect(energy, varying, F.shape[-1], dt, min_energy, options=options)
        carrier, multiple = separation.next_carrier(peaks[: options.max_peaks])
        if carrier is None:
            break
        separation.separate(carrier, multiple)
        yield Stage(separation.carriers, separation.rest)


def follow(
    F: np.ndarray,
    dt: float,
    phases: Sequence[np.ndarray],
    frequencies: Sequence[float],
    *,
    options: CarrierOptions = CarrierOptions(),
) -> Stage | None:
    """Return runs split into base and carriers near known ones, or None if one of them is lost.

    F has shape (runs, outputs, times), at steps of dt; `phases`, each (runs, times), and
    `frequencies` are those of the known carriers. Phases start at the known ones, so that those of
    runs which differ little, as on another discretization, differ little, too.
    """
    separation = Separation(F, dt, options, align=False)
    for psi, frequency in zip(phases, frequencies, strict=True):
        multiple = round(frequency / frequencies[0])
        if multiple > 1 and np.allclose(psi, multiple * phases[0], rtol=1e-9):
            carrier = separation.harmonic(frequency, multiple)
        else:
            carrier = separation.track_carrier(frequency, psi, options.passes)
            multiple = 0
        if carrier is None:
            return None
        separation.separate(carrier, multiple)
    return Stage(separation.carriers, separation.rest)


class Separation:
    """Runs from which carriers are separated one after the other; `align` is as of `track`."""

    def __init__(self, F: np.ndarray, dt: float, options: CarrierOptions, *, align: bool = True):
        self.rest = F
        self.dt = dt
        self.options = options
        self.align = align
        scale = np.sqrt([np.mean(series.var(axis=-1)) for series in np.moveaxis(F, 1, 0)])
        self.scale = np.where(scale > 0, scale, 1.0)  # the size of each output, (outputs,)
        self.carriers: list[Carrier] = []
        self.multiples: list[int] = []  # of the first carrier's phase; 0: not a harmonic

    def track_carrier(self, frequency: float, psi: np.ndarray, passes: int) -> Carrier | None:
        """Track the carrier near a phase ψ, (runs, times), in the rest; None if it is lost."""
        arguments = self.rest, self.dt, frequency, psi, self.scale, passes
        return track(*arguments, align=self.align, options=self.options)

    def harmonic(self, frequency: float, multiple: int) -> Carrier | None:
        """Return the carrier whose phase is a multiple of the first carrier's."""
        return self.track_carrier(frequency, multiple * self.carriers[0].phase, 0)

    def next_carrier(self, peaks: list[np.ndarray]) -> tuple[Carrier | None, int]:
        """Return the carrier of the first peak that can be tracked, and its multiple, or 0."""
        ramp = 2 * np.pi * self.dt * np.arange(self.rest.shape[-1])
        for frequencies in peaks:
            middle = float(frequencies.mean())
            carrier = self.track_carrier(middle, frequencies[:, None] * ramp, self.options.passes)
            if carrier is not None:
                return carrier, 0
            ratio = middle / self.carriers[0].frequency if self.carriers else 0.0
            multiple = round(ratio)
            if multiple > 1 and abs(ratio / multiple - 1) < self.options.harmonic_tolerance:
                return self.harmonic(middle, multiple), multiple
        return None, 0

    def separate(self, carrier: Carrier, multiple: int) -> None:
        """Take a carrier out of the rest; track each of several again without all others."""
        # earlier stages keep theirs
        self.carriers, self.rest = [*self.carriers, carrier], np.copy(self.rest)
        self.multiples.append(multiple)
        carrier.add_to(self.rest, -1.0)
        for k, h in enumerate(self.multiples if len(self.multiples) > 1 else []):
            old = self.carriers[k]
            old.add_to(self.rest)
            frequency = old.frequency
            new_carrier = (
                self.harmonic(frequency, h) if h else self.track_carrier(frequency, old.phase, 1)
            )
            self.carriers[k] = old if new_carrier is None else new_carrier
            self.carriers[k].add_to(self.rest, -1.0)


def detect(
    energy: np.ndarray,
    varying: np.ndarray,
    times: int,
    dt: float,
    min_energy: float,
    *,
    options: CarrierOptions = CarrierOptions(),
) -> list[np.ndarray]:
    """Return the frequency in every run, shape (runs,), of each candidate, the strongest first.

    A candidate is a maximum of the energy E(f) of the variation between the runs in the band [f/b,
    b f], if it is twice the energy of the neighbouring bands. The frequency in a run is the centre
    of its energy in [f/1.25, 1.25 f]. `spectra` returns the energy and what varies.
    """
    frequency = np.fft.rfftfreq(times, dt)
    ratio = options.band_ratio
    summed = np.concatenate([[0.0], np.cumsum(varying)])

    def band(f: np.ndarray) -> np.ndarray:
        low, high = (np.searchsorted(frequency, g) for g in (f / ratio, ratio * f))
        return summed[high] - summed[low]

    band_energy = band(frequency)
    ok = frequency >= options.min_cycles / (times * dt)
    ok &= frequency <= options.max_frequency / dt
    ok &= band_energy > min_energy
    for beside in (frequency / ratio**2, frequency * ratio**2):
        ok &= band_energy > 2 * band(beside)
    # Take the strongest candidate, and leave out what is near it, until there are none.
    candidates = []
    while ok.any():
        peak = frequency[np.argmax(np.where(ok, band_energy, 0.0))]
        peak_energy = energy * ((frequency > peak / 1.25) & (frequency < peak * 1.25))
        candidates.append(peak_energy @ frequency / np.maximum(peak_energy.sum(1), 1e-300))
        ok &= (frequency < peak / 1.5) | (frequency > peak * 1.5)
    return candidates


def spectra(F: np.ndarray, scale: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the energy of all outputs by frequency, and that of their variation between the runs.

    Shapes are (runs, frequencies) and (frequencies,). A linear trend is removed and a Hann window
    applied.
    """
    runs, _, times = F.shape
    x = np.linspace(-1, 1, times)
    window = np.hanning(times)
    energy = np.zeros((runs, times // 2 + 1))
    varying = np.zeros(times // 2 + 1)
    for G, size in zip(np.moveaxis(F, 1, 0), scale, strict=True):
        bent = G - G.mean(axis=-1, keepdims=True)
        bent -= (G @ x / (x @ x))[:, None] * x
        bent *= window / size
        z = np.fft.rfft(bent)
        energy += np.abs(z) ** 2
        varying += np.sum(np.abs(z - z.mean(axis=0)) ** 2, axis=0)
    return energy, varying
