"""Eigenvalues and shapes of small motions, M ẍ + D ẋ + (K + L) x = 0, on allowed directions.

A motion is exp(st) φ. Without velocities in the equations and with a symmetric stiffness, s² is
real and found by the symmetric eigenproblem; otherwise s is complex in general.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from scipy.linalg import LinAlgError, cholesky, eigh, qr, solve_triangular
from scipy.sparse import csr_array

from flexband.mechanics.engine.redundancy import RANK
from flexband.mechanics.linearization.linearize import Linear, LinearStates

ROUNDING = 16 * np.finfo(float).eps
"""Of the stiffness of a mode, relative to the sum of the magnitudes of its terms."""

RESOLVED = 1e-12
"""Eigenvalues of a shifted and inverted problem below this are nothing but rounding."""

PURE = 1e-9
"""Relative real part below which an eigenvalue counts as imaginary."""


class Eigenmodes(NamedTuple):
    """Eigenvalues s [1/s] by frequency, one of each conjugate pair, and vectors, φᴴMφ = 1.

    Of pairs ±s, one is given if velocities do not enter. The vectors are real if all that could
    make them complex is absent.
    """

    s: np.ndarray
    vectors: np.ndarray
    thickness: np.ndarray = np.zeros(0, dtype=bool)  # whether each is of the thickness of beams
    states: np.ndarray = np.zeros((0, 0))  # what each moves of states of force laws, as columns

    def select(self, selection: np.ndarray) -> Eigenmodes:
        """Return some of the modes."""
        states = self.states[:, selection] if len(self.states) else self.states
        s, vectors, thickness = (part[..., selection] for part in self[:3])
        return Eigenmodes(s, vectors, thickness, states)

    @property
    def frequency(self) -> np.ndarray:
        """|s|/2π [Hz], negative for a motion that grows without oscillating."""
        growing = (np.imag(self.s) == 0) & self.unstable
        return np.where(growing, -1.0, 1.0) * np.abs(self.s) / (2 * np.pi)

    @property
    def unstable(self) -> np.ndarray:
        """Whether the motion grows."""
        return np.real(self.s) > 0

    @property
    def damping_ratio(self) -> np.ndarray:
        """−Re s/|s|, 0 where s is."""
        return 0.0 - np.real(self.s) / np.maximum(np.abs(self.s), np.finfo(float).tiny)


def nullspace_basis(Phi: np.ndarray, size: np.ndarray, rank: float = RANK) -> np.ndarray:
    """Return a basis of Φ_q δq = 0 in some coordinates, which keeps soft and stiff parts apart."""
    n = len(size)
    if not len(Phi):
        return np.diag(size)
    rows = Phi * size
    rows = rows / np.maximum(np.linalg.norm(rows, axis=1, keepdims=True), 1e-300)
    R, order = _pivoted_qr(rows)
    count = int(np.sum(np.abs(np.diag(R)) > rank * max(abs(R[0, 0]), rank)))
    basis = np.zeros((n, n - count))
    basis[order[count:]] = np.eye(n - count)
    if count:
        dependent = -solve_triangular(R[:count, :count], R[:count, count:])
        basis[order[:count]] = np.where(np.abs(dependent) > 1e-15, dependent, 0.0)
    return basis * size[:, None]


def reduce_matrix(matrix: np.ndarray, basis: np.ndarray, *, sparse_from: int = 150) -> np.ndarray:
    """Return a matrix on the directions of a basis, by sparse products of large ones."""
    if not matrix.any():
        return np.zeros((basis.shape[1],) * 2)
    if len(matrix) < sparse_from:
        return basis.T @ matrix @ basis
    directions = csr_array(basis)
    return (directions.T @ (csr_array(matrix) @ directions)).toarray()


def _pivoted_qr(matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return R of a QR factorization with exchanged columns, and their order."""
    factors: Any = qr(matrix, mode="economic", pivoting=True)
    return factors[1], factors[2]


def is_symmetric(loads: np.ndarray, *, asymmetry: float = 1e-7) -> bool:
    """Return whether the stiffness of loads is symmetric up to a relative `asymmetry`."""
    return bool(np.abs(loads - loads.T).max() <= asymmetry * np.abs(loads).max())


def eigenmodes(linear: Linear, basis: np.ndarray, count: int) -> Eigenmodes:
    """Return the `count` modes of lowest frequency, or all if there are fewer."""
    if linear.states is not None:
        return _with_states(linear, linear.states, basis, count)
    M, D, L = (reduce_matrix(part, basis) for part in (linear.inertia, linear.D, linear.L))
    symmetric = is_symmetric(L) and linear.carried is None
    if symmetric:
        linear = linear._replace(L=(linear.L + linear.L.T) / 2)
    K = reduce_matrix(linear.K + linear.L, basis)
    if D.any():
        s, vectors = _general(linear, M, D, K, basis, count, symmetric)
    elif symmetric:
        s, vectors = _conservative(linear, basis, count)
    else:
        s, vectors = _circulatory(linear, M, K, basis, count)
    largest = np.take_along_axis(vectors, np.abs(vectors).argmax(axis=0)[None], axis=0)
    vectors = vectors * np.where(np.real(largest) < 0, -1.0, 1.0)
    order = np.argsort(Eigenmodes(s, vectors).frequency, kind="stable")[:count]
    return Eigenmodes(s[order], vectors[:, order])


def softest(linear: Linear, basis: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the `count` lowest ω² of the symmetric part of the stiffness, and their vectors."""
    K = reduce_matrix(linear.K + linear.L, basis)
    few = (0, min(count, len(K)) - 1)
    try:
        squares, y = eigh((K + K.T) / 2, reduce_matrix(linear.M, basis), subset_by_index=few)
    except LinAlgError:  # small inertias are lost next to large ones: make each direction's 1
        R = qr(cholesky(linear.M) @ basis, mode="r")[0][: len(K)]
        basis = solve_triangular(R, basis.T, trans=1).T
        K = reduce_matrix(linear.K + linear.L, basis)
        squares, y = eigh((K + K.T) / 2, subset_by_index=few)
    return squares, basis @ y


def _conservative(linear: Linear, basis: np.ndarray, count: int):
    """Solve K φ = ω² M φ. A second projection removes what stiff modes leave in soft ones."""
    _, soft = softest(linear, basis, count)
    squares, z = eigh(soft.T @ (linear.K + linear.L) @ soft, soft.T @ linear.M @ soft)
    vectors = soft @ z
    squares = np.where(np.abs(squares) > rounding_errors(linear, vectors), squares, 0.0)
    return np.sqrt(np.abs(squares)) * np.where(squares > 0, 1j, 1.0), vectors


def _circulatory(linear: Linear, M, K, basis: np.ndarray, count: int):
    """Solve K φ = −s² M φ; a complex s² has a root that grows and one that decays."""
    magnitudes = np.sort(np.abs(np.linalg.eigvals(np.linalg.solve(M, K))))
    shift = _shift(magnitudes, count)
    inverse, y = np.linalg.eig(np.linalg.solve(K + shift * M, shift * M))
    resolved = np.abs(inverse) > RESOLVED
    squares = shift / inverse[resolved] - shift
    y = y[:, resolved]
    upper = np.imag(squares) >= 0
    squares = squares[upper]
    y = y[:, upper]
    vectors = _normalize(linear, basis @ y)
    noise = rounding_errors(linear, vectors)
    squares = np.where(np.abs(squares) > noise, squares, 0.0)
    pure = np.abs(np.imag(squares)) <= PURE * np.abs(squares) + noise
    squares = np.where(pure, np.real(squares), squares)
    s = np.sqrt(-squares.astype(complex))
    s = np.where(np.imag(s) < 0, -s, s)
    flutter = np.imag(squares) > 0
    vectors = np.hstack([vectors, np.conj(vectors[:, flutter])])
    return np.append(s, -np.conj(s[flutter])), vectors


def _general(linear: Linear, M, D, K, basis: np.ndarray, count: int, symmetric: bool):
    """Solve (s² M + s D + K) φ = 0, shifted to the modes of low frequency and inverted."""
    # Shift to the size of the eigenvalues that are asked for.
    n = len(M)
    identity = np.eye(n)
    none = np.zeros((n, n))
    unit = np.sqrt(np.abs(np.linalg.solve(M, K)).max()) or 1.0
    below = [-np.linalg.solve(M, K) / unit, -np.linalg.solve(M, D)]
    magnitudes = np.sort(np.abs(np.linalg.eigvals(np.block([[none, unit * identity], below]))))
    shift = _shift(magnitudes, 2 * count)
    # Solve for the inverses, and leave out those that rounding hides.
    M = shift**2 * M
    D = shift * D
    upper = [-np.linalg.solve(M + D + K, part) for part in (M + D, M)]
    inverse, y = np.linalg.eig(np.block([upper, [identity + upper[0], upper[1]]]))
    resolved = np.abs(inverse) > RESOLVED
    s = shift * (1 + 1 / inverse[resolved])
    y = y[:n, resolved]
    upper_mask = np.imag(s) >= 0
    vectors = _normalize(linear, basis @ y[:, upper_mask])
    s = _balance_eigenvalues(linear, s[upper_mask], vectors)
    # Set to 0 what rounding cannot tell from it.
    noise = rounding_errors(linear, vectors)
    size = np.abs(s)
    damping = np.abs(np.einsum("im,ij,jm->m", vectors.conj(), linear.D, vectors))
    resting = np.maximum(size**2, size * damping) <= noise
    s[resting] = 0.0
    pure = np.abs(np.real(s)) * size <= PURE * size**2 + noise
    if symmetric and np.abs(D + D.T).max() <= PURE * np.abs(D).max():
        pure |= np.real(s) ** 2 <= noise  # a double eigenvalue, which rounding divides
    s = np.where(pure, 1j * np.imag(s), s)
    keep = np.flatnonzero(~resting)
    if resting.any():  # a motion that is free has the eigenvalue 0 twice, with one vector
        R, order = _pivoted_qr(vectors[:, resting])
        mask = np.abs(np.diag(R)) > 1e-3 * abs(R[0, 0])
        keep = np.append(np.flatnonzero(resting)[order[: len(mask)][mask]], keep)
    return s[keep], vectors[:, keep]


def _balance_eigenvalues(
    linear: Linear, s: np.ndarray, vectors: np.ndarray, *, unbalanced: float = 1e-3
) -> np.ndarray:
    """Return s, where φᴴ(s² M + s D + K) φ = 0 within rounding, else the nearest s that is so.

    Next to motions that are 10²⁰ times as fast, s of slow ones is nothing but rounding.
    """
    parts = linear.inertia, linear.D, linear.K + linear.L
    a, b, c = (np.einsum("im,ij,jm->m", vectors.conj(), part, vectors) for part in parts)
    root = np.sqrt(b.astype(complex) ** 2 - 4 * a * c)
    # The sum is free of cancellation; the other root follows from the product of both.
    half_sum = -(b + np.where(np.real(np.conj(b) * root) < 0, -root, root)) / 2
    roots = np.stack(
        [half_sum / a, np.divide(c, half_sum, out=np.zeros_like(half_sum), where=half_sum != 0)]
    )
    upper = np.argsort(-np.imag(roots), axis=0)  # of two conjugate ones the first, as all others
    roots = np.take_along_axis(roots, upper, axis=0)
    nearest = np.take_along_axis(roots, np.abs(roots - s).argmin(axis=0)[None], axis=0)[0]
    terms = np.abs(np.stack([a * s**2, b * s, c])).max(axis=0)
    rounded = np.abs(a * s**2 + b * s + c) > unbalanced * terms
    return np.where(rounded, nearest, s)


def _with_states(
    linear: Linear, states: LinearStates, basis: np.ndarray, count: int, *, alone: float = 1e-13
) -> Eigenmodes:
    """Solve for the modes of q, q̇ and states of laws; states `alone` have no modal mass."""
    # Set the matrix of the first-order system.
    n = basis.shape[1]
    m = len(states.by_state)
    parts = linear.inertia, linear.D, linear.K + linear.L
    M, D, K = (reduce_matrix(part, basis) for part in parts)
    right = np.hstack([-K, -D, basis.T @ states.loads])
    rows = [
        np.hstack([np.zeros((n, n)), np.eye(n), np.zeros((n, m))]),
        np.linalg.solve(M, right) if n else right,
        np.hstack([states.by_place @ basis, states.by_rate @ basis, states.by_state]),
    ]
    s, x = np.linalg.eig(np.vstack(rows))
    # Scale the modes to unit modal mass, or to unit states.
    upper_mask = np.imag(s) >= 0
    s = s[upper_mask]
    x = x[:, upper_mask]
    vectors = basis @ x[:n]
    y = x[2 * n :]
    mass = np.sqrt(np.einsum("im,ij,jm->m", vectors.conj(), linear.M, vectors).real)
    moving = np.abs(x[:n]).max(axis=0, initial=0.0) > alone
    scale = np.where(moving, mass, np.abs(y).max(axis=0, initial=0.0))
    vectors = vectors / scale
    y = y / scale
    # Remove what is due to rounding alone.
    noise = np.where(moving, np.sqrt(rounding_errors(linear, vectors)), 0.0)
    s = np.where(np.abs(s) <= np.maximum(noise, RESOLVED * np.abs(s).max()), 0.0, s)
    s = np.where(np.abs(np.real(s)) <= PURE * np.abs(s), 1j * np.imag(s), s)
    if not (np.imag(vectors).any() or np.imag(y).any()):
        vectors = np.real(vectors)
        y = np.real(y)
    order = np.argsort(np.abs(s), kind="stable")[:count]
    return Eigenmodes(s[order], vectors[:, order], states=y[:, order])


def _shift(magnitudes: np.ndarray, count: int, *, zero_ratio: float = 1e-9) -> float:
    """Return a shift beyond `count` of these sizes, which ascend, and beyond those that are 0."""
    shift = magnitudes[min(count, len(magnitudes)) - 1]
    if shift <= zero_ratio * magnitudes[-1]:  # that of motions that are free
        shift = min(magnitudes[magnitudes > zero_ratio * magnitudes[-1]], default=1.0)
    return 1.3 * float(shift)


def _normalize(linear: Linear, vectors: np.ndarray) -> np.ndarray:
    """Return vectors with φᴴMφ = 1 and the smallest imaginary part, real if there is none."""
    weighted = linear.M @ vectors
    turn = np.exp(-0.5j * np.angle(np.sum(vectors * weighted, axis=0)))
    size = np.sqrt(np.sum(np.conj(vectors) * weighted, axis=0).real)
    vectors = vectors * (turn / size)
    small = np.abs(np.imag(vectors)).max(axis=0) < PURE * np.abs(vectors).max(axis=0)
    return np.real(vectors) if small.all() else vectors


def rounding_errors(linear: Linear, vectors: np.ndarray) -> np.ndarray:
    """Return the error of s² of each mode by rounding of the stiffness.

    Stretched members round relative to their axial stiffness, so components of a vector count as
    one. What is far below that of other modes counts as none.
    """
    dimension = linear.dimension
    size = np.abs(vectors).reshape(-1, dimension, vectors.shape[1]).max(axis=1)
    terms = linear.terms.reshape(len(size), dimension, len(size), dimension).max(axis=(1, 3))
    error = ROUNDING * np.einsum("im,ij,jm->m", size, terms, size)
    return np.maximum(error, 1e-12 * error.max(initial=0.0))
