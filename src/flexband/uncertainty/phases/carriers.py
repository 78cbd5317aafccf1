"""Separate a carrier from ringing time series: its phase, and its envelope in every output.

A run rings with a phase φ(t) that all its outputs share. Around every time t, in a window of
some periods to each side, the output is approximated by

    F(t + τ) ≈ Σ_p a_p τ^p + Re[(Σ_p z_p τ^p) e^{iψ(t + τ)}],   p = 0, 1, 2,

with an estimate ψ of the phase. z₀ is the envelope at t; the rotation of the envelopes corrects ψ.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.sparse import csr_array

from flexband.uncertainty.expansions.polynomials import cubic_spline


class CarrierOptions(NamedTuple):
    """How carriers are looked for, and how the runs are split."""

    max_carriers: int = 3  # most carriers of a response
    max_peaks: int = 2  # peaks of the spectrum that are tried for each further carrier
    min_times: int = 32  # fewest times of runs in which carriers are looked for
    max_frequency: float = 0.4  # of a carrier, in periods per step of the times
    min_cycles: float = 6.0  # fewest periods of a carrier in the record
    # least energy of a carrier, as a fraction of that of the variation between the runs
    min_energy: float = 1e-5
    band_ratio: float = 1.15  # ratio of the ends of a frequency band to its middle
    # relative distance from a multiple of the first carrier within which a lost carrier is tried as
    # its harmonic
    harmonic_tolerance: float = 0.03
    passes: int = 3  # corrections of the phase of a new carrier
    window_periods: float = 2.5  # to each side, over which the parts of a run are approximated
    degree: int = 2  # of the polynomials in τ, of the slow part and of the envelope
    averaging_periods: float = 2.0  # to each side, over which the rotation of envelopes is averaged
    # fraction of the largest energy below which a run continues with its mean frequency
    silent_energy: float = 1e-4
    windows_at_once: int = 4096  # windows, of all runs, in which envelopes are computed at once


@dataclass(frozen=True)
class Carrier:
    """A carrier in every run."""

    phase: np.ndarray  # φ [rad], shape (runs, times)
    envelope: np.ndarray  # Z, complex, shape (runs, outputs, times)
    frequency: float  # approximate frequency, in cycles per unit of time

    def add_to(self, values: np.ndarray, factor: float = 1.0) -> None:
        """Add so many times its signal Re[Z e^{iφ}] to values, one output after the other."""
        turn = np.exp(1j * self.phase)
        for output in range(values.shape[1]):
            values[:, output] += factor * np.real(self.envelope[:, output] * turn)

    def part(self, runs: slice, outputs: slice | np.ndarray, times: slice) -> Carrier:
        envelope = self.envelope[runs, outputs, times]
        return Carrier(self.phase[runs, times], envelope, self.frequency)


def track(
    F: np.ndarray,
    dt: float,
    frequency: float,
    psi: np.ndarray,
    scale: np.ndarray,
    passes: int,
    *,
    align: bool = True,
    options: CarrierOptions = CarrierOptions(),
) -> Carrier | None:
    """Return the carrier near a phase ψ, or None if its frequency leaves [f/2, 2f] in some run.

    F has shape (runs, outputs, times), at steps of dt; `frequency` and `psi`, (runs, times),
    estimate f and ψ, which is corrected in `passes`; `scale` is the size of each output. With
    `align`, a constant is added to the phase of each run, to align the envelopes of all.
    """
    times = F.shape[-1]
    half = min(max(3, round(options.window_periods / (frequency * dt))), (times - 1) // 2)
    stride = max(1.0, 0.5 / (frequency * dt))  # envelopes are computed every half period
    places = np.linspace(0, times - 1, int((times - 1) / stride) + 1)
    at = np.unique(np.round(places).astype(int))
    smooth = max(1, round(options.averaging_periods / (frequency * dt * stride)))
    moments = window_moments(half, at, times, options.degree)
    turned, at_once = np.zeros((len(F), len(at))), max(1, options.windows_at_once // len(at))
    z, part = split(F, psi, moments, at_once)
    for k in range(passes):
        z, part = split(F, psi, moments, at_once) if k else (z, part)
        turned = turning(z * np.sqrt(part), scale, smooth, options.silent_energy)
        psi = psi + cubic_spline(at, turned, np.arange(times))
        rate = np.diff(psi, axis=-1) / (2 * np.pi * dt)
        if rate.min() < frequency / 2 or rate.max() > 2 * frequency:
            return None
    z = z * np.exp(-1j * turned)[:, None]
    # A constant phase per run aligns the envelopes of all runs, except for their sign: so an
    # amplitude that passes through zero stays a smooth function of the inputs.
    overlap = np.sum(z * z[len(z) // 2].conj() / scale[:, None] ** 2, axis=(1, 2))
    shift = 0.5 * np.angle(overlap**2) if passes and align else np.zeros(len(F))
    z = z * np.exp(-1j * shift)[:, None, None]
    # times are the slowest axis in memory, as those of a spline
    runs, outputs, _ = F.shape
    envelope = np.moveaxis(np.empty((times, runs, outputs), complex), 0, -1)
    for o in range(outputs):
        envelope[:, o] = cubic_spline(at, z[:, o], np.arange(times))
    return Carrier(psi + shift[:, None], envelope, frequency)


def split(
    F: np.ndarray, psi: np.ndarray, moments: list[csr_array], at_once: int
) -> tuple[np.ndarray, np.ndarray]:
    """Return the envelope z₀ of the carrier of phase ψ, and its share of the fast energy.

    Both have shape (runs, outputs, windows). The share is the carrier's energy in the window over
    the sum of this energy and that of the residual.

    With the basis τ^p (1, cos ψ, sin ψ), the matrix of the normal equations consists of window sums
    of τ^{p+q} times the products of two of these waves, the same for all outputs, their right-hand
    side of window sums of τ^p F times a wave. They take more memory than the runs, so that
    only `at_once` runs are split at once.
    """
    blocks = (slice(k, k + at_once) for k in range(0, len(F), at_once))
    envelope, share = zip(*(_split(F[rows], psi[rows], moments) for rows in blocks), strict=True)
    return np.concatenate(envelope), np.concatenate(share)


def _split(
    F: np.ndarray, psi: np.ndarray, moments: list[csr_array]
) -> tuple[np.ndarray, np.ndarray]:
    """Return what `split` does, of all runs at once."""
    waves = np.ones((1, F.shape[-1])), np.cos(psi), np.sin(psi)
    powers = np.arange((len(moments) + 1) // 2)
    weights, size = moments[0].sum(axis=1), 3 * len(powers)
    G = np.empty((len(F), len(weights), 3, len(powers), 3, len(powers)))
    for a, b in ((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)):
        sums = window_sums(moments, waves[a] * waves[b])
        G[:, :, a, :, b] = G[:, :, b, :, a] = sums[..., np.add.outer(powers, powers)]
    G = G.reshape(len(F), len(weights), size, size)
    G[..., range(size), range(size)] += 1e-9 * weights.max()
    right = [window_sums(moments[: len(powers)], F * wave[:, None]) for wave in waves]
    right = np.moveaxis(np.concatenate(right, axis=-1), 1, 3)
    solution = np.linalg.solve(G, right)
    rest = window_sums(moments[:1], F * F)[..., 0]
    rest = rest - np.moveaxis(np.sum(solution * right, axis=2), 1, 2)
    cosine, sine = (np.moveaxis(solution[:, :, k * len(powers)], 2, 1) for k in (1, 2))
    energy = (cosine**2 + sine**2) / 2 * weights
    return cosine - 1j * sine, energy / np.maximum(energy + np.maximum(rest, 0.0), 1e-300)


def window_moments(half: int, at: np.ndarray, times: int, degree: int) -> list[csr_array]:
    """Return matrices (len(at), times) that form Σ_τ w(τ) τ^p g(t + τ) from g, p = 0 … 2 degree.

    t is a time whose number is in `at`; τ is in units of the window's half width, and
    w = (1 − τ²)² + 10⁻³. Outside the record g is zero, so windows at its ends are one-sided.
    """
    tau = np.arange(-half, half + 1) / half
    weight = (1 - tau**2) ** 2 + 1e-3
    places = at[:, None] + np.arange(-half, half + 1)
    inside = (places >= 0) & (places < times)
    ends = np.concatenate([[0], np.cumsum(inside.sum(axis=1))])
    kernels = (weight * tau**p for p in range(2 * degree + 1))
    return [
        csr_array(
            (np.broadcast_to(kernel, places.shape)[inside], places[inside], ends), (len(at), times)
        )
        for kernel in kernels
    ]


def window_sums(moments: list[csr_array], g: np.ndarray) -> np.ndarray:
    """Return the moments of g, of shape (…, times), in every window: (…, windows, moments)."""
    flat = np.ascontiguousarray(g.reshape(-1, g.shape[-1]).T)
    sums = np.stack([moment @ flat for moment in moments], axis=-1)
    return sums.swapaxes(0, 1).reshape(*g.shape[:-1], *sums.shape[::2])


def turning(z: np.ndarray, scale: np.ndarray, smooth: int, silent_energy: float) -> np.ndarray:
    """Return the common rotation of the envelopes of all outputs, zero at the start, (runs, at).

    From one time to the next it is arg Σ_o z_o,j+1 z̄_o,j / s_o², averaged over ±`smooth` times.
    If an output or all of them pass through zero, the outputs and times that ring dominate the
    average, and a run that does not ring, with less than the fraction `silent_energy` of the
    largest energy, continues with its mean frequency. So no phase has to be unwrapped.
    """
    u = z / scale[:, None]
    lag = np.sum(u[..., 1:] * u[..., :-1].conj(), axis=1)
    weight = np.hanning(2 * smooth + 3)[1:-1]
    lag = _averaged(lag, weight / weight.sum())
    mean = np.exp(1j * np.angle(lag.sum(-1, keepdims=True)))
    lag = lag + silent_energy * np.abs(lag).max(-1, keepdims=True) * mean
    return np.concatenate([np.zeros((len(z), 1)), np.cumsum(np.angle(lag), -1)], -1)


def _averaged(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return averages over times to both sides, with symmetric weights; outside, values are zero.

    It is `scipy.ndimage.convolve1d`, bit for bit, whose package takes long to import.
    """
    half, times = len(weights) // 2, values.shape[-1]
    padded = np.pad(values, ((0, 0), (half, half)))
    averages = values * weights[half]
    for k in range(half):
        last = 2 * half - k
        averages = (
            averages + (padded[:, k : k + times] + padded[:, last : last + times]) * weights[k]
        )
    return averages
