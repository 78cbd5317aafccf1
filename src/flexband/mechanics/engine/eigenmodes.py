"""Eigenvalues and shapes of small motions, M ẍ + D ẋ + (K + L) x = 0, on allowed directions.

A motion is exp(st) φ. Without velocities in the equations and with a symmetric stiffness, s² is
real and found by the symmetric eigenproblem; otherwise s is complex in general.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh, qr, solve_triangular

from flexband.mechanics.engine.linearize import Linear
from flexband.mechanics.engine.redundancy import RANK

ROUNDING = 16 * np.finfo(float).eps
"""Of the stiffness of a mode, relative to the sum of the magnitudes of its terms."""

SYMMETRY = 1e-7
"""Relative asymmetry below which the stiffness of loads counts as symmetric."""

PURE = 1e-9
"""Relative real part below which an eigenvalue counts as imaginary."""


class Eigenmodes(NamedTuple):
    """Eigenvalues s [1/s] in order of their frequencies, and their vectors φ as columns.

    One of each conjugate pair is given, and one of each pair ±s if velocities do not enter. The
    vectors have φᴴMφ = 1; they are real if all that could make them complex is absent.
    """

    s: np.ndarray
    vectors: np.ndarray
    conservative: bool

    @property
    def frequency(self) -> np.ndarray:
        """|s|/2π [Hz], negative for a motion that grows without oscillating."""
        growing = (self.s.imag == 0) & (self.s.real > 0)
        return np.where(growing, -1.0, 1.0) * np.abs(self.s) / (2 * np.pi)

    @property
    def damping_ratio(self) -> np.ndarray:
        """−Re s/|s|, 0 where s is."""
        return -self.s.real / np.maximum(np.abs(self.s), np.finfo(float).tiny)


def allowed(Phi: np.ndarray, size: np.ndarray, rank: float = RANK) -> np.ndarray:
    """Return a basis of the displacements with Φ_q δq = 0, as columns.

    Its variables are some of the coordinates, so that parts of very different stiffness that are
    not joined stay apart. `size` is that of each coordinate.
    """
    n = len(size)
    if not len(Phi):
        return np.diag(size)
    rows = Phi * size
    rows = rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-300)
    _, R, order = qr(rows, mode="economic", pivoting=True)
    count = int(np.sum(np.abs(np.diag(R)) > rank * max(abs(R[0, 0]), rank)))
    basis = np.zeros((n, n - count))
    basis[order[count:]] = np.eye(n - count)
    if count:
        dependent = -solve_triangular(R[:count, :count], R[:count, count:])
        basis[order[:count]] = np.where(np.abs(dependent) > 1e-15, dependent, 0.0)
    return basis * size[:, None]


def eigenmodes(linear: Linear, basis: np.ndarray, count: int) -> Eigenmodes:
    """Return the `count` modes of lowest frequency, or all if there are fewer."""
    M, D, L = (basis.T @ part @ basis for part in (linear.M, linear.D, linear.L))
    symmetric = np.abs(L - L.T).max() <= SYMMETRY * np.abs(L).max()
    if symmetric:
        linear = linear._replace(L=(linear.L + linear.L.T) / 2)
    K = basis.T @ (linear.K + linear.L) @ basis
    if D.any():
        s, vectors = _general(linear, M, D, K, basis, count)
    elif symmetric:
        s, vectors = _conservative(linear, M, (K + K.T) / 2, basis, count)
    else:
        s, vectors = _circulatory(linear, M, K, basis, count)
    largest = np.take_along_axis(vectors, np.abs(vectors).argmax(axis=0)[None], axis=0)
    vectors = vectors * np.where(largest.real < 0, -1.0, 1.0)
    found = Eigenmodes(s, vectors, symmetric and not D.any())
    order = np.argsort(found.frequency, kind="stable")[:count]
    return found._replace(s=s[order], vectors=vectors[:, order])


def _conservative(linear: Linear, M, K, basis: np.ndarray, count: int):
    """Solve K φ = ω² M φ. A second projection removes what stiff modes leave in soft ones."""
    _, y = eigh(K, M, subset_by_index=[0, min(count, len(M)) - 1])
    soft = basis @ y
    squares, z = eigh(soft.T @ (linear.K + linear.L) @ soft, soft.T @ linear.M @ soft)
    vectors = soft @ z
    squares = np.where(np.abs(squares) > rounding(linear, vectors), squares, 0.0)
    return np.sqrt(-squares.astype(complex)), vectors


def _circulatory(linear: Linear, M, K, basis: np.ndarray, count: int):
    """Solve K φ = −s² M φ; a complex s² has a root that grows and one that decays."""
    far = np.sort(np.abs(np.linalg.eigvals(np.linalg.solve(M, K))))
    shift = 1.3 * far[min(count, len(far)) - 1] + np.finfo(float).tiny
    inverse, y = np.linalg.eig(np.linalg.solve(K + shift * M, shift * M))
    squares = shift / inverse - shift
    squares, y = squares[squares.imag >= 0], y[:, squares.imag >= 0]
    vectors = _normalized(linear, basis @ y)
    squares = np.where(np.abs(squares) > rounding(linear, vectors), squares, 0.0)
    s = np.sqrt(-squares.astype(complex))
    s = np.where(s.imag < 0, -s, s)
    flutter = squares.imag > 0
    vectors = np.hstack([vectors, np.conj(vectors[:, flutter])])
    return np.append(s, -np.conj(s[flutter])), vectors


def _general(linear: Linear, M, D, K, basis: np.ndarray, count: int):
    """Solve (s² M + s D + K) φ = 0, shifted to the modes of low frequency and inverted."""
    n = len(M)
    one, none = np.eye(n), np.zeros((n, n))
    unit = np.sqrt(np.abs(np.linalg.solve(M, K)).max()) or 1.0
    below = [-np.linalg.solve(M, K) / unit, -np.linalg.solve(M, D)]
    far = np.sort(np.abs(np.linalg.eigvals(np.block([[none, unit * one], below]))))
    shift = 1.3 * far[min(2 * count, len(far)) - 1] + np.finfo(float).tiny
    M, D = shift**2 * M, shift * D
    upper = [-np.linalg.solve(M + D + K, part) for part in (M + D, M)]
    inverse, y = np.linalg.eig(np.block([upper, [one + upper[0], upper[1]]]))
    inverse = np.where(inverse == 0, np.finfo(float).tiny, inverse)
    s = shift * (1 + 1 / inverse)
    s, vectors = s[s.imag >= 0], _normalized(linear, basis @ y[:n, s.imag >= 0])
    noise, size = rounding(linear, vectors), np.abs(s)
    damping = np.abs(np.einsum("im,ij,jm->m", vectors.conj(), linear.D, vectors))
    resting = np.maximum(size**2, size * damping) <= noise
    s[resting] = 0.0
    pure = np.abs(s.real) * size <= PURE * size**2 + noise
    s = np.where(pure, 1j * s.imag, s)
    keep = np.flatnonzero(~resting)
    if resting.any():  # a motion that is free has the eigenvalue 0 twice, with one vector
        _, R, order = qr(vectors[:, resting], mode="economic", pivoting=True)
        own = np.abs(np.diag(R)) > 1e-3 * abs(R[0, 0])
        keep = np.append(np.flatnonzero(resting)[order[: len(own)][own]], keep)
    return s[keep], vectors[:, keep]


def _normalized(linear: Linear, vectors: np.ndarray) -> np.ndarray:
    """Return vectors with φᴴMφ = 1 and the smallest imaginary part, real if there is none."""
    weighted = linear.M @ vectors
    turn = np.exp(-0.5j * np.angle(np.sum(vectors * weighted, axis=0)))
    size = np.sqrt(np.sum(np.conj(vectors) * weighted, axis=0).real)
    vectors = vectors * (turn / size)
    small = np.abs(vectors.imag).max(axis=0) < PURE * np.abs(vectors).max(axis=0)
    return vectors.real if small.all() else vectors


def rounding(linear: Linear, vectors: np.ndarray) -> np.ndarray:
    """Return what rounding of the stiffness makes of s² of each mode."""
    size = np.abs(vectors)
    return ROUNDING * np.einsum("im,ij,jm->m", size, np.abs(linear.K) + np.abs(linear.L), size)
