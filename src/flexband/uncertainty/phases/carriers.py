"""Separate a carrier from ringing time series: its phase, and its envelope in every output.

A run rings with a phase φ(t) that all its outputs share. Around every time t, in a window of
`WINDOW_PERIODS` periods to each side, the output is approximated by

    F(t + τ) ≈ Σ_p a_p τ^p + Re[(Σ_p z_p τ^p) e^{iψ(t + τ)}],   p = 0, 1, 2,

with an estimate ψ of the phase. z₀ is the envelope at t; the rotation of the envelopes corrects ψ.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import fftconvolve
from scipy.sparse import csr_array

WINDOW_PERIODS = 2.5
DEGREE = 2
"""Degree of the polynomials in τ, of the slow part and of the envelope."""

AVERAGING_PERIODS = 2.0
"""Periods to each side over which the rotation of envelopes is averaged."""

SILENT_ENERGY = 1e-4
"""Fraction of the largest energy below which a run continues with its mean frequency."""


@dataclass(frozen=True)
class Carrier:
    """A carrier in every run.

    Attributes
    ----------
    phase : φ [rad], shape (runs, times).
    envelope : Z, complex, shape (runs, outputs, times).
    frequency : approximate frequency, in cycles per unit of time.
    """

    phase: np.ndarray
    envelope: np.ndarray
    frequency: float

    @property
    def signal(self) -> np.ndarray:
        """Re[Z e^{iφ}]."""
        return np.real(self.envelope * np.exp(1j * self.phase)[:, None])

    def runs(self, which: slice) -> Carrier:
        """Return the carrier in some of the runs."""
        return Carrier(self.phase[which], self.envelope[which], self.frequency)

    def at(self, times: slice) -> Carrier:
        """Return the carrier at some of the times."""
        return Carrier(self.phase[..., times], self.envelope[..., times], self.frequency)


def track(
    F: np.ndarray, dt: float, frequency: float, psi: np.ndarray, scale: np.ndarray, passes: int
) -> Carrier | None:
    """Return the carrier near a phase ψ, or None if its frequency leaves [f/2, 2f] in some run.

    Parameters
    ----------
    F : shape (runs, outputs, times), at steps of dt.
    frequency, psi : estimates of f and of ψ, shape (runs, times).
    scale : size of each output, shape (outputs,).
    passes : number of corrections of ψ.
    """
    times = F.shape[-1]
    half = min(max(3, round(WINDOW_PERIODS / (frequency * dt))), (times - 1) // 2)
    stride = max(1.0, 0.5 / (frequency * dt))  # envelopes are computed every half period
    places = np.linspace(0, times - 1, int((times - 1) / stride) + 1)
    at = np.unique(np.round(places).astype(int))
    smooth = max(1, round(AVERAGING_PERIODS / (frequency * dt * stride)))
    turned, (z, part) = np.zeros((len(F), len(at))), split(F, psi, half, at)
    for k in range(passes):
        z, part = split(F, psi, half, at) if k else (z, part)
        turned = turning(z * np.sqrt(part), scale, smooth)
        psi = psi + CubicSpline(at, turned, axis=-1)(np.arange(times))
        rate = np.diff(psi, axis=-1) / (2 * np.pi * dt)
        if rate.min() < frequency / 2 or rate.max() > 2 * frequency:
            return None
    z = z * np.exp(-1j * turned)[:, None]
    # A constant phase per run aligns the envelopes of all runs, except for their sign: so an
    # amplitude that passes through zero stays a smooth function of the inputs.
    overlap = np.sum(z * z[len(z) // 2].conj() / scale[:, None] ** 2, axis=(1, 2))
    shift = 0.5 * np.angle(overlap**2) if passes else np.zeros(len(F))
    z = z * np.exp(-1j * shift)[:, None, None]
    return Carrier(psi + shift[:, None], CubicSpline(at, z, axis=-1)(np.arange(times)), frequency)


def split(
    F: np.ndarray, psi: np.ndarray, half: int, at: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the envelope z₀ of the carrier of phase ψ, and its share of the fast energy.

    Both have shape (runs, outputs, len(at)). The share is the carrier's energy in the window over
    the sum of this energy and that of the residual.

    With the basis τ^p e^{imψ}, m = 0, ±1, the matrix of the normal equations consists of window
    sums of τ^{p+q} e^{i(m′−m)ψ}, the same for all outputs, their right-hand side of window sums of
    τ^p F e^{−imψ}.
    """
    e = np.exp(1j * psi)
    one = np.ones((1, F.shape[-1]))
    sums = [window_sums(g, half, 2 * DEGREE, at) for g in (one, e, e * e)]
    terms = [(m, p) for m in (0, 1, -1) for p in range(DEGREE + 1)]
    G = np.empty((len(F), len(at), len(terms), len(terms)), complex)
    for a, (m, p) in enumerate(terms):
        for b, (k, q) in enumerate(terms):
            entry = sums[abs(k - m)][p + q]
            G[:, :, a, b] = entry if k >= m else entry.conj()
    G[..., range(len(terms)), range(len(terms))] += 1e-9 * (half + 1)
    slow = window_sums(F, half, DEGREE, at)
    ring = window_sums(F * e.conj()[:, None], half, DEGREE, at)
    right = np.stack([*slow, *ring, *(r.conj() for r in ring)], axis=-1)
    z = np.linalg.solve(G, np.moveaxis(right, 1, 3))
    rest = window_sums(F * F, half, 0, at)[0]
    rest = rest - np.moveaxis(np.sum(z * np.moveaxis(right, 1, 3).conj(), axis=2).real, 1, 2)
    envelope = 2 * np.moveaxis(z[:, :, DEGREE + 1], 2, 1)
    own = np.abs(envelope) ** 2 / 2 * np.real(sums[0][0])
    return envelope, own / np.maximum(own + np.maximum(rest, 0.0), 1e-300)


def window_sums(g: np.ndarray, half: int, powers: int, at: np.ndarray) -> list[np.ndarray]:
    """Return Σ_τ w(τ) τ^p g(t + τ) for p = 0 … powers at the times with the numbers `at`.

    τ is in units of the window's half width, w = (1 − τ²)². Outside the record g is zero, so
    windows at its ends are one-sided.
    """
    tau = np.arange(-half, half + 1) / half
    weight = (1 - tau**2) ** 2 + 1e-3
    flat = np.ascontiguousarray(g.reshape(-1, g.shape[-1]).T)
    places = at[:, None] + np.arange(-half, half + 1)
    inside = (places >= 0) & (places < len(flat))
    ends = np.concatenate([[0], np.cumsum(inside.sum(axis=1))])
    kernels = (np.broadcast_to(weight * tau**p, places.shape)[inside] for p in range(powers + 1))
    shape = len(at), len(flat)
    sums = (csr_array((kernel, places[inside], ends), shape) @ flat for kernel in kernels)
    return [s.T.reshape(*g.shape[:-1], len(at)) for s in sums]


def turning(z: np.ndarray, scale: np.ndarray, smooth: int) -> np.ndarray:
    """Return the common rotation of the envelopes of all outputs, zero at the start, (runs, at).

    From one time to the next it is arg Σ_o z_o,j+1 z̄_o,j / s_o², averaged over ±`smooth` times.
    If an output or all of them pass through zero, the outputs and times that ring dominate the
    average. So no phase has to be unwrapped.
    """
    u = z / scale[:, None]
    lag = np.sum(u[..., 1:] * u[..., :-1].conj(), axis=1)
    weight = np.hanning(2 * smooth + 3)[1:-1]
    lag = fftconvolve(lag, weight[None] / weight.sum(), mode="same", axes=-1)
    mean = np.exp(1j * np.angle(lag.sum(-1, keepdims=True)))
    lag = lag + SILENT_ENERGY * np.abs(lag).max(-1, keepdims=True) * mean
    return np.concatenate([np.zeros((len(z), 1)), np.cumsum(np.angle(lag), -1)], -1)
