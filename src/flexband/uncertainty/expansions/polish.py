"""Polish extremes of μ + c σ over the box of the interval variables: Newton's method, compiled.

σ² is the sum over j ≥ 1 of squared polynomials in η, so the derivatives of σ follow from those of
the polynomials. Each row is a small problem of its own.
"""

from __future__ import annotations

import numpy as np

from flexband.caching import cached_on_disk

MAX_STEPS = 12
MIN_RELATIVE_GAIN = 1e-13
"""The descent ends when a step is expected to gain less than this fraction of the value."""


@cached_on_disk
def polish(index, coefficients, series, c, sign, places, values):
    """Move `places`, in place, to the nearby minima of sign (μ + c σ), and update `values`.

    Parameters
    ----------
    index : orders of the Chebyshev polynomials in every term, shape (M, m).
    coefficients : shape (all series, M, N), weighted so that σ² is a sum of squares.
    series, c, sign : number of the series, c and sign of every row.
    places, values : η, shape (rows, m), and μ + c σ there, which never gets worse.
    """
    m = places.shape[1]
    rows = 1 + m + m * (m + 1) // 2
    work = (
        np.empty((3, m, index.max() + 1)),
        np.empty((rows, coefficients.shape[1])),
        np.empty((rows, coefficients.shape[2])),
    )
    gradient, hessian, trial = np.empty(m), np.empty((m, m)), np.empty(m)
    new_gradient, new_hessian = np.empty(m), np.empty((m, m))
    for row in range(len(series)):
        own, eta = coefficients[series[row]], places[row]
        best = _value(own, index, eta, c[row], sign[row], work, gradient, hessian)
        reach = 1.0
        for _ in range(MAX_STEPS):
            if not step(eta, gradient, hessian, reach, trial) > MIN_RELATIVE_GAIN * abs(best):
                break
            value = _value(own, index, trial, c[row], sign[row], work, new_gradient, new_hessian)
            if value < best:
                best, reach = value, 1.0
                eta[:], gradient[:], hessian[:] = trial, new_gradient, new_hessian
            else:
                reach *= 0.25
        values[row] = sign[row] * best


@cached_on_disk
def sweep(index, coefficients, series, c, sign, places, values):
    """Improve `places` as `polish` does, by steps to −1, 0 or 1 in one variable after the other.

    It leaves vertices that are only local minima, if a scan could not visit all vertices.
    """
    m = places.shape[1]
    powers = np.empty((3, m, index.max() + 1))
    own, terms = np.empty(len(index)), np.empty(coefficients.shape[2])
    trial = np.empty(m)
    for row in range(len(series)):
        better = True
        while better:
            better = False
            for a in range(m):
                for x in (-1.0, 0.0, 1.0):
                    trial[:] = places[row]
                    trial[a] = x
                    chebyshev_powers(trial, powers)
                    for i in range(len(index)):
                        own[i] = 1.0
                        for v in range(m):
                            own[i] *= powers[0, v, index[i, v]]
                    np.dot(own, coefficients[series[row]], terms)
                    value = terms[0] + c[row] * np.sqrt((terms[1:] ** 2).sum())
                    if sign[row] * (value - values[row]) < -MIN_RELATIVE_GAIN * abs(value):
                        values[row], places[row, a], better = value, x, True


@cached_on_disk
def _value(coefficients, index, eta, c, sign, work, gradient, hessian):
    """Return sign (μ + c σ) at η and fill its gradient and Hessian."""
    m, (powers, basis, terms) = len(eta), work
    chebyshev_powers(eta, powers)
    _products(powers, index, basis)
    np.dot(basis, coefficients, terms)
    variance = 0.0
    for j in range(1, terms.shape[1]):
        variance += terms[0, j] ** 2
    std = np.sqrt(variance)
    per_std = c / std if std > 0 else 0.0  # at σ = 0 its derivatives count as zero
    for a in range(m):
        gradient[a] = sign * (terms[1 + a, 0] + per_std * _dot(terms, 0, 1 + a))
    pair = 1 + m
    for a in range(m):
        for b in range(a, m):
            curve = _dot(terms, 1 + a, 1 + b) + _dot(terms, 0, pair)
            if std > 0:
                curve -= _dot(terms, 0, 1 + a) * _dot(terms, 0, 1 + b) / variance
            hessian[a, b] = hessian[b, a] = sign * (terms[pair, 0] + per_std * curve)
            pair += 1
    return sign * (terms[0, 0] + c * std)


@cached_on_disk
def _dot(terms, a, b):
    """Return Σ_j≥1 of two rows of terms."""
    total = 0.0
    for j in range(1, terms.shape[1]):
        total += terms[a, j] * terms[b, j]
    return total


@cached_on_disk
def chebyshev_powers(eta, powers):
    """Fill T_i, T_i′ and T_i″ of every variable by their recurrences."""
    for a in range(len(eta)):
        x, T, D, S = eta[a], powers[0, a], powers[1, a], powers[2, a]
        T[0], D[0], S[0] = 1.0, 0.0, 0.0
        if len(T) > 1:
            T[1], D[1], S[1] = x, 1.0, 0.0
        for i in range(2, len(T)):
            T[i] = 2 * x * T[i - 1] - T[i - 2]
            D[i] = 2 * T[i - 1] + 2 * x * D[i - 1] - D[i - 2]
            S[i] = 4 * D[i - 1] + 2 * x * S[i - 1] - S[i - 2]


@cached_on_disk
def _products(powers, index, basis):
    """Fill Φ_i, then its derivatives by each η_a, then by each pair a ≤ b, one row each."""
    terms, m = index.shape
    row = 0
    for a in range(-1, m):  # −1: not differentiated
        for b in range(a, m):
            # pairs (−1, −1), (−1, b) and (a, b) in the order of the rows
            basis[row] = 1.0
            for v in range(m):
                power = powers[(v == a) + (v == b), v]
                for i in range(terms):
                    basis[row, i] *= power[index[i, v]]
            row += 1


@cached_on_disk
def step(eta, gradient, hessian, reach, trial):
    """Fill η − reach (H + τ I)⁻¹ gradient, clipped to the box; return the expected gain.

    Variables that are held by a bound do not move. τ is zero if the Hessian H of the others is
    positive definite; otherwise it grows until H + τ I is.
    """
    m = len(eta)
    held, factor = np.empty(m, np.bool_), np.empty((m, m))
    size, shift, gain = 1e-300, 0.0, 0.0
    for a in range(m):
        held[a] = (eta[a] <= -1 and gradient[a] > 0) or (eta[a] >= 1 and gradient[a] < 0)
        trial[a] = 0.0 if held[a] else -gradient[a]
        for b in range(m):
            size = max(size, abs(hessian[a, b]))
    while not _cholesky(hessian, held, shift, 1e-10 * size, factor):
        shift = max(4 * shift, 1e-3 * size)
    substitute(factor, trial)
    for a in range(m):
        trial[a] = min(1.0, max(-1.0, eta[a] + reach * trial[a]))
        gain -= gradient[a] * (trial[a] - eta[a])
    return gain


@cached_on_disk
def substitute(factor, x):
    """Solve L Lᵀ y = x in place for a lower triangular L, real or complex."""
    n = len(x)
    for a in range(n):
        for b in range(a):
            x[a] -= factor[a, b] * x[b]
        x[a] /= factor[a, a]
    for a in range(n - 1, -1, -1):
        for b in range(a + 1, n):
            x[a] -= factor[b, a] * x[b]
        x[a] /= factor[a, a]


@cached_on_disk
def _cholesky(hessian, held, shift, least, factor):
    """Factor H + shift I without held variables; return whether all pivots exceed `least`."""
    for a in range(len(held)):
        for b in range(a + 1):
            free = not (held[a] or held[b])
            total = hessian[a, b] if free else 0.0
            if a == b:
                total = total + shift if free else 1.0
            for k in range(b):
                total -= factor[a, k] * factor[b, k]
            if a > b:
                factor[a, b] = total / factor[b, b]
            elif total > least or held[a]:
                factor[a, a] = np.sqrt(total)
            else:
                return False
    return True
