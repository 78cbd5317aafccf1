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
from numpy.lib.stride_tricks import sliding_window_view

from flexband.compilation.caching import cached_on_disk
from flexband.compilation.functions import compiled
from flexband.uncertainty.expansions.bounds.terms import copy, multiply, sum_of
from flexband.uncertainty.expansions.polynomials import cubic_spline
from flexband.uncertainty.expansions.threads import in_threads


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

    def part(self, runs: slice | np.ndarray, outputs: slice | np.ndarray, times: slice) -> Carrier:
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
    rotation = np.zeros((len(F), len(at)))
    z, part = split(F, psi, at, half, options.degree)
    for k in range(passes):
        z, part = split(F, psi, at, half, options.degree) if k else (z, part)
        rotation = common_rotation(z * np.sqrt(part), scale, smooth, options.silent_energy)
        psi = psi + cubic_spline(at, rotation, np.arange(times))
        rate = np.diff(psi, axis=-1) / (2 * np.pi * dt)
        if rate.min() < frequency / 2 or rate.max() > 2 * frequency:
            return None
    z = z * np.exp(-1j * rotation)[:, None]
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
    F: np.ndarray, psi: np.ndarray, at: np.ndarray, half: int, degree: int, lanes: int = 8
) -> tuple[np.ndarray, np.ndarray]:
    """Return the envelope z₀ of the carrier of phase ψ, and its share of the fast energy.

    Both have shape (runs, outputs, windows). A window reaches `half` steps to each side of one of
    the times `at`. The share is the carrier's energy in it over the sum of this energy and that of
    the residual.
    """
    tau = np.arange(-half, half + 1) / half
    kernels = ((1 - tau**2) ** 2 + 1e-3) * tau ** np.arange(2 * degree + 1)[:, None]
    runs, outputs, times = F.shape
    blocks = -(-runs // lanes)
    fitted = np.empty((blocks, outputs, len(at), 3, lanes))

    def solve(block: int) -> None:
        rows = slice(block * lanes, (block + 1) * lanes)
        signals = np.zeros((outputs, times, lanes))
        waves = np.ones((3, times, lanes))
        signals[..., : len(F[rows])] = np.moveaxis(F[rows], 0, -1)
        for wave, values in zip(waves[1:], (np.cos(psi[rows]), np.sin(psi[rows])), strict=True):
            wave[:, : len(values)] = values.T
        split_windows(signals, waves, kernels, at, fitted[block])

    in_threads(solve, range(blocks))
    parts = np.moveaxis(fitted, (3, 4), (0, 2)).reshape(3, blocks * lanes, outputs, len(at))
    cosine, sine, share = parts[:, :runs]
    return cosine - 1j * sine, share


@cached_on_disk
def split_windows(F, waves, kernels, at, fitted):
    """Fill the factors of cos ψ and sin ψ in the middle of each window, and the carrier's share.

    With the basis τ^p (1, cos ψ, sin ψ), the matrix of the normal equations consists of window sums
    of τ^{p+q} times the products of two of these waves, the same for all outputs, their right-hand
    side of window sums of τ^p F times a wave. Runs are in lanes, the last dimension.

    Parameters
    ----------
    F : runs, (outputs, times, lanes). Outside the record it is zero, so windows at its ends are
        one-sided.
    waves : 1, cos ψ and sin ψ, (3, times, lanes).
    kernels : w(τ) τ^p, p = 0 … 2 degree, with τ in units of the window's half width, and
        w = (1 − τ²)² + 10⁻³, (2 degree + 1, 2 half + 1).
    at : numbers of the times in the middle of the windows, (windows,).
    fitted : what is filled, (outputs, windows, 3, lanes).
    """
    outputs, times, lanes = F.shape
    half = kernels.shape[1] // 2
    powers = (len(kernels) + 1) // 2
    size = 3 * powers
    ridge = 1e-9 * sum_of(kernels[0])
    # products of two waves, and every output times each wave and itself, lane after lane
    products = np.empty((times, 6 * lanes))
    signals = np.empty((times, 4 * outputs * lanes))
    for t in range(times):
        for a in range(3):
            for b in range(a + 1):
                product = a * (a + 1) // 2 + b
                _multiply(waves[a, t], waves[b, t], products[t, product * lanes :])
            for o in range(outputs):
                _multiply(F[o, t], waves[a, t], signals[t, (4 * o + a) * lanes :])
        for o in range(outputs):
            _multiply(F[o, t], F[o, t], signals[t, (4 * o + 3) * lanes :])
    of_products = np.empty((len(kernels), products.shape[1]))
    of_signals = np.empty((powers, signals.shape[1]))
    factor = np.empty((size, size, lanes))
    solution = np.empty((size, lanes))
    rest = np.empty(lanes)
    # Solve the normal equations of every window.
    for k in range(len(at)):
        first = max(0, at[k] - half)
        last = min(times, at[k] + half + 1)
        window = kernels[:, first - at[k] + half : last - at[k] + half]
        multiply(window, products[first:last], of_products)
        multiply(window, signals[first:last], of_signals)
        for row in range(size):
            for column in range(row + 1):
                a = row // powers
                p = row % powers
                b = column // powers
                q = column % powers
                product = a * (a + 1) // 2 + b
                copy(factor[row, column], of_products[p + q, product * lanes :])
            for n in range(lanes):
                factor[row, row, n] += ridge
        _factorize(factor)
        for o in range(outputs):
            copy(rest, of_signals[0, (4 * o + 3) * lanes :])
            for row in range(size):
                place = (4 * o + row // powers) * lanes
                copy(solution[row], of_signals[row % powers, place:])
            _substitute(factor, solution, rest)
            for n in range(lanes):
                cosine = solution[powers, n]
                sine = solution[2 * powers, n]
                energy = (cosine**2 + sine**2) / 2 * of_products[0, n]
                fitted[o, k, 0, n] = cosine
                fitted[o, k, 1, n] = sine
                fitted[o, k, 2, n] = energy / max(energy + max(rest[n], 0.0), 1e-300)


@compiled
def _multiply(a, b, product):
    for n in range(len(a)):
        product[n] = a[n] * b[n]


@compiled
def _factorize(matrix):
    """Replace positive definite matrices, (n, n, lanes), of which half is used, by L of L Lᵀ."""
    size, _, lanes = matrix.shape
    for a in range(size):
        for b in range(a + 1):
            for k in range(b):
                for n in range(lanes):
                    matrix[a, b, n] -= matrix[a, k, n] * matrix[b, k, n]
            for n in range(lanes):
                if a > b:
                    matrix[a, b, n] /= matrix[b, b, n]
                else:
                    matrix[a, a, n] = np.sqrt(matrix[a, a, n])


@compiled
def _substitute(factor, x, rest):
    """Solve L Lᵀ y = x in place, (n, lanes), and take xᵀ y from what `rest` has."""
    size, lanes = x.shape
    for a in range(size):
        for b in range(a):
            for n in range(lanes):
                x[a, n] -= factor[a, b, n] * x[b, n]
        for n in range(lanes):
            x[a, n] /= factor[a, a, n]
            rest[n] -= x[a, n] ** 2
    for a in range(size - 1, -1, -1):
        for b in range(a + 1, size):
            for n in range(lanes):
                x[a, n] -= factor[b, a, n] * x[b, n]
        for n in range(lanes):
            x[a, n] /= factor[a, a, n]


def common_rotation(
    z: np.ndarray, scale: np.ndarray, smooth: int, silent_energy: float
) -> np.ndarray:
    """Return the common rotation of the envelopes of all outputs, zero at the start, (runs, at).

    From one time to the next it is arg Σ_o z_o,j+1 z̄_o,j / s_o², averaged over ±`smooth` times.
    If an output or all of them pass through zero, the outputs and times that ring dominate the
    average, and a run that does not ring, with less than the fraction `silent_energy` of the
    largest energy, continues with its mean frequency. So no phase has to be unwrapped.
    """
    u = z / scale[:, None]
    lag = np.sum(u[..., 1:] * u[..., :-1].conj(), axis=1)
    weight = np.hanning(2 * smooth + 3)[1:-1]
    padded = np.pad(lag, ((0, 0), (smooth, smooth)))
    lag = sliding_window_view(padded, 2 * smooth + 1, axis=-1) @ (weight / weight.sum())
    mean = np.exp(1j * np.angle(lag.sum(-1, keepdims=True)))
    lag = lag + silent_energy * np.abs(lag).max(-1, keepdims=True) * mean
    return np.concatenate([np.zeros((len(z), 1)), np.cumsum(np.angle(lag), -1)], -1)
