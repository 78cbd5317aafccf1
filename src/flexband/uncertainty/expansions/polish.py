"""Polish extremes of μ + c σ over the box of the interval variables: Newton's method, compiled.

σ² is the sum over j ≥ 1 of squared polynomials in η, so the derivatives of σ follow from those of
the polynomials.
"""

from __future__ import annotations

import numpy as np

from flexband.caching import cached_on_disk

MAX_STEPS = 40
MIN_RELATIVE_GAIN = 1e-13
"""The descent ends when a step is expected to gain less than this fraction of the value."""


@cached_on_disk
def polish(terms, own, c, sign, eta):
    """Move η to the nearby minimum of sign (μ + c σ), and return the minimum.

    Parameters
    ----------
    terms, own : `SparseTerms` of a series, and their coefficients.
    """
    m, groups = len(eta), terms.group[-1] + 1 if c != 0 else 1
    highest = terms.order.max() + 1 if len(terms.order) else 1
    work = np.empty((3, m, highest)), np.empty(groups), np.empty((groups, m))
    gradient, hessian, trial = np.empty(m), np.empty((m, m)), np.empty(m)
    new_gradient, new_hessian = np.empty(m), np.empty((m, m))
    best = _value(terms, own, c, sign, eta, work, gradient, hessian)
    reach = 1.0
    for _ in range(MAX_STEPS):
        if not step(eta, gradient, hessian, reach, trial) > MIN_RELATIVE_GAIN * abs(best):
            break
        value = _value(terms, own, c, sign, trial, work, new_gradient, new_hessian)
        if value < best:
            best, reach = value, 1.0
            eta[:], gradient[:], hessian[:] = trial, new_gradient, new_hessian
        else:
            reach *= 0.25
    return best


@cached_on_disk
def _value(terms, own, c, sign, eta, work, gradient, hessian):  # noqa: PLR0912
    """Return sign (μ + c σ) at η and fill its gradient and Hessian."""
    powers, sums, slopes = work
    m, groups, count = len(eta), len(sums), len(own)
    chebyshev_powers(eta, powers)
    value = totals(terms, own, c, sign, powers, sums)
    variance = 0.0
    for j in range(groups):
        variance += sums[j] * sums[j] if j else 0.0
        for a in range(m):
            slopes[j, a] = 0.0
    for a in range(m):
        for b in range(m):
            hessian[a, b] = 0.0
    std = np.sqrt(variance)
    per_std = sign * c / std if std > 0 else 0.0  # at σ = 0 its derivatives count as zero
    for i in range(count):
        j = terms.group[i]
        if j >= groups:
            break
        begin, end = terms.first[i], terms.first[i + 1]
        weight = own[i] * (sign if j == 0 else per_std * sums[j])
        for f in range(begin, end):
            a = terms.variable[f]
            slope, curve = own[i], weight
            for g in range(begin, end):
                order = terms.order[g]
                other = powers[0, terms.variable[g], order]
                slope *= powers[1, a, order] if g == f else other
                curve *= powers[2, a, order] if g == f else other
            slopes[j, a] += slope
            hessian[a, a] += curve
            for g in range(begin, f):
                b = terms.variable[g]
                curve = weight * powers[1, a, terms.order[f]] * powers[1, b, terms.order[g]]
                for h in range(begin, end):
                    if h not in (f, g):
                        curve *= powers[0, terms.variable[h], terms.order[h]]
                hessian[a, b] += curve
                hessian[b, a] = hessian[a, b]
    for a in range(m):
        gradient[a] = 0.0
        for j in range(1, groups):
            gradient[a] += sums[j] * slopes[j, a]
    for a in range(m if std > 0 and c != 0 else 0):
        for b in range(a + 1):
            curve = -gradient[a] * gradient[b] / variance
            for j in range(1, groups):
                curve += slopes[j, a] * slopes[j, b]
            hessian[a, b] += per_std * curve
            hessian[b, a] = hessian[a, b]
    for a in range(m):
        gradient[a] = sign * slopes[0, a] + per_std * gradient[a]
    return value


@cached_on_disk
def totals(terms, own, c, sign, powers, sums):
    """Fill the sum of the terms of each Ψ_j, and return sign (μ + c σ)."""
    groups, variance = len(sums), 0.0
    for j in range(groups):
        sums[j] = 0.0
    for i in range(len(own)):
        j = terms.group[i]
        if j >= groups:
            break
        product = own[i]
        for f in range(terms.first[i], terms.first[i + 1]):
            product *= powers[0, terms.variable[f], terms.order[f]]
        sums[j] += product
    for j in range(1, groups):
        variance += sums[j] * sums[j]
    return sign * (sums[0] + c * np.sqrt(variance))


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
        if not shift < 1e6 * size:  # only if the Hessian is not finite
            return 0.0
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
