"""Smooth moments of a phase-resolved response, from which its mean and variance are computed.

With φ̄_c = E φ_c and u_c = Z_c e^{i(φ_c − φ̄_c)} the moments over ξ are

    μ  = E b + Re Σ_c E[u_c] e^{iφ̄_c}
    σ² = Var b + ½ Σ_c Var u_c + Re Σ_c 2 Cov(b, u_c) e^{iφ̄_c}
         + Re Σ_cd ½ Cov(u_c, u_d) e^{i(φ̄_c + φ̄_d)} + Re Σ_{c<d} Cov(u_c, ū_d) e^{i(φ̄_c − φ̄_d)}

The phases φ̄ are polynomials in η; expectations and covariances are smooth functions of η. A table
has one row of them, with the columns of `MomentColumns`, for each time and η.
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np

from flexband.compilation.caching import cached_on_disk
from flexband.compilation.functions import compiled
from flexband.uncertainty.expansions.bounds.terms import multiply
from flexband.uncertainty.phases.layout import MomentColumns, turning_parts
from flexband.uncertainty.phases.trigonometry import cos_and_sin


def mean_and_std(table: np.ndarray, columns: MomentColumns) -> tuple[np.ndarray, np.ndarray]:
    """Return μ and σ of rows of the table (…, width), each of shape (…, outputs)."""
    c, d, s = turning_parts(columns.carriers).T
    phases = table[..., columns.phase :]
    angles = phases[..., c] + s * phases[..., d] * (s != 0)
    blocks = table[..., : columns.phase].reshape(*table.shape[:-1], columns.outputs, -1)

    def harmonic_sum(real: int, imag: int, angles: np.ndarray) -> np.ndarray:
        count = angles.shape[-1]
        re = blocks[..., real : real + count]
        im = blocks[..., imag : imag + count]
        return np.sum(re * np.cos(angles)[..., None, :] - im * np.sin(angles)[..., None, :], -1)

    mean = blocks[..., columns.mean] + harmonic_sum(columns.mean_real, columns.mean_imag, phases)
    turning = harmonic_sum(columns.turn_real, columns.turn_imag, angles)
    return mean, np.sqrt(np.maximum(blocks[..., columns.variance] + turning, 0.0))


class Sections(NamedTuple):
    """What an expansion of parts is at some times and η."""

    coefficients: np.ndarray  # (times, terms, parts)
    interval_term: np.ndarray  # which Φ_i each term has
    random_term: np.ndarray  # which Ψ_j
    phi: np.ndarray  # Φ at the η, (points, M)


@compiled
def moment_arrays(outputs, carriers, turns):
    """Return the arrays that `fill` takes, from `mean` to `second`."""
    first = np.zeros((outputs, carriers), np.complex128)
    second = np.zeros((outputs, turns), np.complex128)
    return np.zeros(outputs), np.zeros(outputs), first, np.zeros((outputs, carriers)), second


@compiled
def section(sections, t, e, rows):
    """Fill the coefficients of Ψ_j at one time and η, (N, parts), from those of all terms."""
    coefficients = sections.coefficients[t]
    phi = sections.phi[e]
    interval_term = sections.interval_term
    random_term = sections.random_term
    rows[:] = 0.0
    for k in range(len(interval_term)):
        j = random_term[k]
        factor = phi[interval_term[k]]
        for p in range(rows.shape[1]):
            rows[j, p] += factor * coefficients[k, p]


@compiled
def squares(rows, norms, parts, base, square):
    """Fill Var b and E|Z_c|² by their closed forms."""
    base[:] = 0.0
    square[:] = 0.0
    for j in range(len(norms)):
        for o in range(parts.outputs):
            base[o] += norms[j] * rows[j, o] ** 2 if j else 0.0
            for c in range(parts.carriers):
                re = rows[j, parts.real + c * parts.block + o]
                im = rows[j, parts.imag + c * parts.block + o]
                square[o, c] += norms[j] * (re**2 + im**2)


@compiled
def fill(rows, parts, columns, turning, mean, base, first, square, second, row):
    """Fill a row of the table.

    Parameters
    ----------
    rows : coefficients of Ψ_j, (N, parts).
    mean, base : E and E of the square of b − rows[0], shape (outputs,).
    first, square : E[u_c] and E|u_c|², shape (outputs, carriers).
    second : E of the products of each row of `turning`, shape (outputs, turns).
    """
    for o in range(columns.outputs):
        block = row[o * columns.block : (o + 1) * columns.block]
        A = first[o]
        block[columns.mean] = rows[0, o] + mean[o]
        block[columns.variance] = base[o] - mean[o] ** 2
        for c in range(columns.carriers):
            block[columns.variance] += 0.5 * (square[o, c] - A[c].real ** 2 - A[c].imag ** 2)
            block[columns.mean_real + c] = A[c].real
            block[columns.mean_imag + c] = A[c].imag
        for k in range(columns.turns):
            c, d, s = turning[k]
            if s == 0:
                G = 2 * (second[o, k] - mean[o] * A[c])
            elif s > 0:
                G = (second[o, k] - A[c] * A[d]) * (0.5 if c == d else 1.0)
            else:
                G = second[o, k] - A[c] * np.conj(A[d])
            block[columns.turn_real + k] = G.real
            block[columns.turn_imag + k] = G.imag
    for c in range(columns.carriers):
        row[columns.phase + c] = rows[0, parts.phase + c * parts.block]


@partial(compiled, fastmath={"reassoc", "contract"})
def product(a, b):
    """Return Σ_q a_q b_q, in an order that suits registers."""
    total = 0.0
    for q in range(len(a)):
        total += a[q] * b[q]
    return total


@compiled
def workspace(width, points, carriers):
    """Return arrays for `average`."""
    shape = carriers, points
    waves = np.empty(shape), np.empty(shape), np.empty(shape), np.empty(shape)
    return np.empty((width, points)), np.empty(points), *waves, np.empty(shape), np.empty(shape)


@compiled
def average(rows, psi, weights, parts, turning, work, mean, base, first, square, second):
    """Fill what `fill` takes by a rule in ξ, at whose points Ψ has the shape (N, points)."""
    values, wb, cos, sin, re, im, w_re, w_im = work
    multiply(rows.T, psi, values)
    for c in range(parts.carriers):
        at = parts.phase + c * parts.block
        cos_and_sin(values[at], rows[0, at], cos[c], sin[c])
    for o in range(parts.outputs):
        b = values[o]
        for q in range(len(weights)):
            b[q] -= rows[0, o]
            wb[q] = weights[q] * b[q]
        mean[o] = product(weights, b)
        base[o] = product(wb, b)
        for c in range(parts.carriers):  # u = re + i im
            at = c * parts.block + o
            x = values[parts.real + at]
            y = values[parts.imag + at]
            for q in range(len(weights)):
                re[c, q] = x[q] * cos[c, q] - y[q] * sin[c, q]
                im[c, q] = x[q] * sin[c, q] + y[q] * cos[c, q]
                w_re[c, q] = weights[q] * re[c, q]
                w_im[c, q] = weights[q] * im[c, q]
            first[o, c] = complex(product(weights, re[c]), product(weights, im[c]))
            square[o, c] = product(w_re[c], re[c]) + product(w_im[c], im[c])
        for k in range(len(turning)):
            c, d, s = turning[k]
            if s == 0:
                second[o, k] = complex(product(wb, re[c]), product(wb, im[c]))
            else:
                real = product(w_re[c], re[d]) - s * product(w_im[c], im[d])
                imag = product(w_im[c], re[d]) + s * product(w_re[c], im[d])
                second[o, k] = complex(real, imag)


@cached_on_disk
def by_points(sections, psi, weights, parts, columns, turning, table):
    """Fill the table, (times, points of η, width), by a rule in ξ shared by all.

    The sections have parts of the columns `parts`; `psi` is Ψ at points of ξ, (N, points).
    """
    times, _, width = sections.coefficients.shape
    rows = np.empty((len(psi), width))
    work = workspace(width, len(weights), parts.carriers)
    mean, base, first, square, second = moment_arrays(parts.outputs, parts.carriers, len(turning))
    for t in range(times):
        for e in range(len(sections.phi)):
            section(sections, t, e, rows)
            average(rows, psi, weights, parts, turning, work, mean, base, first, square, second)
            fill(rows, parts, columns, turning, mean, base, first, square, second, table[t, e])


@cached_on_disk
def without_turning(sections, norms, parts, columns, turning, table):
    """Fill the table, as `by_points` does, where the averages of all e^{iφ} vanish."""
    times, _, width = sections.coefficients.shape
    rows = np.empty((len(norms), width))
    mean, base, first, square, second = moment_arrays(parts.outputs, parts.carriers, len(turning))
    for t in range(times):
        for e in range(len(sections.phi)):
            section(sections, t, e, rows)
            squares(rows, norms, parts, base, square)
            fill(rows, parts, columns, turning, mean, base, first, square, second, table[t, e])
