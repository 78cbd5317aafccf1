"""Gentle moments of a phase-resolved response: what its mean and variance are made of.

With φ̄_c = E φ_c and u_c = Z_c e^{i(φ_c − φ̄_c)} the moments over ξ are

    μ  = E b + Re Σ_c E[u_c] e^{iφ̄_c}
    σ² = Var b + ½ Σ_c Var u_c + Re Σ_c 2 Cov(b, u_c) e^{iφ̄_c}
         + Re Σ_cd ½ Cov(u_c, u_d) e^{i(φ̄_c + φ̄_d)} + Re Σ_{c<d} Cov(u_c, ū_d) e^{i(φ̄_c − φ̄_d)}

The phases φ̄ are polynomials in η; expectations and covariances are gentle functions of η.
Each row of these tables belongs to one time and η: for every output E b, the part of σ² that does
not turn, Re and Im of E[u_c], Re and Im of the factor of every turning part of σ²; then all φ̄.
"""

from __future__ import annotations

import numpy as np
from numba import njit


def turning_parts(carriers: int) -> np.ndarray:
    """Return what turns in σ²: first rows (c, −1, 0) for φ̄_c, then (c, d, ±1) for φ̄_c ± φ̄_d."""
    pairs = [(c, d, s) for s in (1, -1) for c in range(carriers) for d in range(carriers) if c <= d]
    pairs = [(c, d, s) for c, d, s in pairs if s > 0 or c < d]
    return np.array([(c, -1, 0) for c in range(carriers)] + pairs, dtype=int).reshape(-1, 3)


def table_width(outputs: int, carriers: int) -> int:
    """Return the length of a row."""
    return outputs * (2 + 2 * carriers + 2 * len(turning_parts(carriers))) + carriers


def put_together(table: np.ndarray, outputs: int, carriers: int) -> np.ndarray:
    """Return μ and σ of rows of the table (…, width), shape (2, …, outputs)."""
    turning = turning_parts(carriers)
    phases = table[..., -carriers:]
    c, d, s = turning.T
    angles = phases[..., c] + s * phases[..., d] * (s != 0)
    own = table[..., :-carriers].reshape(*table.shape[:-1], outputs, -1)
    mean, square, first, second = np.split(own, [1, 2, 2 + 2 * carriers], axis=-1)

    def turned(parts: np.ndarray, angles: np.ndarray) -> np.ndarray:
        re, im = np.split(parts, 2, axis=-1)
        return np.sum(re * np.cos(angles)[..., None, :] - im * np.sin(angles)[..., None, :], -1)

    mean = mean[..., 0] + turned(first, phases)
    return np.stack([mean, np.sqrt(np.maximum(square[..., 0] + turned(second, angles), 0.0))])


@njit(nogil=True, cache=True, error_model="numpy")
def section(coefficients, interval_term, random_term, phi, rows):
    """Fill the coefficients of Ψ_j at one η, (N, parts), from those of all terms."""
    rows[:] = 0.0
    for k in range(len(interval_term)):
        j, factor = random_term[k], phi[interval_term[k]]
        for p in range(rows.shape[1]):
            rows[j, p] += factor * coefficients[k, p]


@njit(nogil=True, cache=True, error_model="numpy")
def fill(rows, outputs, carriers, turning, mean, base, first, square, second, row):
    """Fill a row of the table.

    Parameters
    ----------
    mean, base : E and E of the square of b − rows[0], shape (outputs,).
    first, square : E[u_c] and E|u_c|², shape (outputs, carriers).
    second : E of the products that `turning` says, shape (outputs, turning parts).
    """
    width = 2 + 2 * carriers + 2 * len(turning)
    for o in range(outputs):
        own, A = row[o * width : (o + 1) * width], first[o]
        own[0] = rows[0, o] + mean[o]
        own[1] = base[o] - mean[o] ** 2
        for c in range(carriers):
            own[1] += 0.5 * (square[o, c] - A[c].real ** 2 - A[c].imag ** 2)
            own[2 + c], own[2 + carriers + c] = A[c].real, A[c].imag
        for k in range(len(turning)):
            c, d, s = turning[k]
            if s == 0:
                G = 2 * (second[o, k] - mean[o] * A[c])
            elif s > 0:
                G = (second[o, k] - A[c] * A[d]) * (0.5 if c == d else 1.0)
            else:
                G = second[o, k] - A[c] * np.conj(A[d])
            at = 2 + 2 * carriers + k
            own[at], own[at + len(turning)] = G.real, G.imag
    for c in range(carriers):
        row[outputs * width + c] = rows[0, outputs + c * (1 + 2 * outputs)]


@njit(nogil=True, cache=True, error_model="numpy")
def by_points(coefficients, interval_term, random_term, phi, psi, weights, outputs, turning, table):
    """Fill the table, (times, points of η, width), by a rule in ξ shared by all.

    Parameters
    ----------
    coefficients : shape (times, terms, parts): base, then φ, Re Z and Im Z of each carrier.
    interval_term, random_term : which Φ_i and Ψ_j each term has.
    phi, psi : Φ at points of η, (points, M), and Ψ at those of ξ, (points, N).
    """
    times, _, parts = coefficients.shape
    carriers = (parts - outputs) // (1 + 2 * outputs)
    rows, values = np.empty((psi.shape[1], parts)), np.empty((len(psi), parts))
    turn, u = np.empty(carriers, np.complex128), np.empty(carriers, np.complex128)
    mean, base = np.empty(outputs), np.empty(outputs)
    first = np.empty((outputs, carriers), np.complex128)
    square = np.empty((outputs, carriers))
    second = np.empty((outputs, len(turning)), np.complex128)
    for t in range(times):
        for e in range(len(phi)):
            section(coefficients[t], interval_term, random_term, phi[e], rows)
            np.dot(psi, rows, values)
            mean[:], base[:], first[:], square[:], second[:] = 0.0, 0.0, 0.0, 0.0, 0.0
            for q in range(len(psi)):
                for c in range(carriers):
                    at = outputs + c * (1 + 2 * outputs)
                    angle = values[q, at] - rows[0, at]
                    turn[c] = complex(np.cos(angle), np.sin(angle))
                for o in range(outputs):
                    b, w = values[q, o] - rows[0, o], weights[q]
                    mean[o] += w * b
                    base[o] += w * b * b
                    for c in range(carriers):
                        at = outputs + c * (1 + 2 * outputs) + 1 + o
                        re, im = values[q, at], values[q, at + outputs]
                        u[c] = complex(re, im) * turn[c]
                        first[o, c] += w * u[c]
                        square[o, c] += w * (re * re + im * im)
                    for k in range(len(turning)):
                        c, d, s = turning[k]
                        other = b + 0j if s == 0 else (u[d] if s > 0 else np.conj(u[d]))
                        second[o, k] += w * u[c] * other
            fill(rows, outputs, carriers, turning, mean, base, first, square, second, table[t, e])
