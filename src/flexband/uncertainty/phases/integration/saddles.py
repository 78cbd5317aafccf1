"""Smooth moments with many random variables: Gaussian integrals along contours through saddles.

    E[P e^{iψ}] = E_ζ[det L e^{(ζᵀζ − ξᵀξ)/2 + iψ(ξ)} P(ξ)],   ξ = s + L ζ,   L Lᵀ = (I − i ∇²ψ)⁻¹

with the saddle s = i ∇ψ(s), a complex point: ξ is turned into the direction in which the integrand
decays without oscillating. If the phase is quadratic in ξ, e^{…} is constant; then a rule that is
exact for P is enough, and none has to resolve the phase. Each pair of carriers has its own saddle.
"""

from __future__ import annotations

import numpy as np

from flexband.compilation.caching import cached_on_disk
from flexband.compilation.functions import compiled
from flexband.uncertainty.expansions.bounds.polish import substitute
from flexband.uncertainty.expansions.bounds.terms import inner, largest, multiply, sum_of
from flexband.uncertainty.phases.moments import (
    average,
    fill,
    moment_arrays,
    section,
    squares,
    workspace,
)
from flexband.uncertainty.phases.phase_options import MOMENTS


@cached_on_disk
def by_saddles(sections, orders, norms, rule, weights, psi, parts, columns, turning, table):
    """Fill the table, as `by_points` does.

    `orders`, (N, n), and `norms` are the orders of Ψ_j in each variable, and γ_j. The points ζ of
    the `rule`, the first axis along the slope of the phase, have `weights`; `psi` is Ψ at samples
    of ξ, (N, samples), for phases that have no saddle nearby.
    """
    outputs = parts.outputs
    carriers = parts.carriers
    times, _, width = sections.coefficients.shape
    N, n = orders.shape
    rows = np.empty((N, width))
    phase = np.empty(N)
    mean, base, first, square, second = moment_arrays(outputs, carriers, len(turning))
    saddle = np.empty(n, np.complex128)
    frame = np.empty((n, n), np.complex128)
    powers = np.empty((n, largest(orders.flat, 0, orders.size) + 1), np.complex128)
    basis = np.empty((2 * len(rule), N))
    values = np.empty((2 * len(rule), width))
    factors = np.empty(len(rule), np.complex128)
    sampled = np.full(psi.shape[1], 1 / psi.shape[1])
    work = workspace(width, len(sampled), carriers)
    for t in range(times):
        for e in range(len(sections.phi)):
            section(sections, t, e, rows)
            squares(rows, norms, parts, base, square)
            mean[:] = 0.0
            first[:] = 0.0
            second[:] = 0.0
            for k in range(len(turning)):
                c, d, s = turning[k]
                phase[:] = rows[:, parts.phase + c * parts.block]
                if s != 0:
                    phase += s * rows[:, parts.phase + d * parts.block]
                if is_saturated(phase, orders):
                    continue
                # The integrand on the contour through the saddle, unless the average vanishes.
                is_exact, scale = _contour(phase, orders, powers, saddle, frame)
                if is_exact:
                    _integrand(phase, orders, saddle, frame, rule, powers, basis, factors)
                    is_exact = _weight_integrand(factors, weights, scale)
                if not is_exact:
                    # all by the same samples, so that no small σ² is lost in differences
                    average(
                        rows, psi, sampled, parts, turning, work, mean, base, first, square, second
                    )
                    break
                # The products of parts that turn with this phase.
                multiply(basis, rows, values)
                for q in range(len(rule)):
                    re = values[q]
                    im = values[len(rule) + q]
                    for o in range(outputs):
                        at = c * parts.block + o
                        x = parts.real + at
                        y = parts.imag + at
                        term = factors[q] * complex(re[x] - im[y], im[x] + re[y])
                        if s == 0:
                            first[o, c] += term
                            second[o, k] += term * complex(re[o] - rows[0, o], im[o])
                        else:
                            at = d * parts.block + o
                            x = parts.real + at
                            y = parts.imag + at
                            second[o, k] += term * complex(re[x] - s * im[y], im[x] + s * re[y])
            fill(rows, parts, columns, turning, mean, base, first, square, second, table[t, e])


@compiled
def _integrand(phase, orders, saddle, frame, points, powers, basis, factors):
    """Fill Re Ψ_j and Im Ψ_j on a contour, (2 points, N), and e^{(ζᵀζ − ξᵀξ)/2 + iψ(ξ)}."""
    N, n = orders.shape
    terms = np.empty(N, np.complex128)
    xi = np.empty(n, np.complex128)
    for q in range(len(points)):
        exponent = -1j * phase[0]
        for v in range(n):
            xi[v] = saddle[v]
            for w in range(n):
                if points[q, w] != 0:
                    xi[v] += frame[v, w] * points[q, w]
            exponent += 0.5 * (points[q, v] ** 2 - xi[v] ** 2)
        _hermite(xi, orders, powers, terms)
        for j in range(N):
            exponent += 1j * phase[j] * terms[j]
            basis[q, j] = terms[j].real
            basis[len(points) + q, j] = terms[j].imag
        factors[q] = np.exp(exponent)


@compiled
def _weight_integrand(factors, weights, scale):
    """Multiply the integrand by the weights and det L; return whether the rule is exact enough."""
    size = 0.0
    mean = 0j
    for q in range(len(factors)):
        factors[q] *= scale
        mean += weights[q] * factors[q]
        if not abs(factors[q]) <= size:  # NaN, too
            size = abs(factors[q])
    spread = 0.0
    for q in range(len(factors)):
        spread += abs(weights[q]) * abs(factors[q] - mean)
        factors[q] *= weights[q]
    return size <= MOMENTS.max_integrand and abs(mean) <= 1 + 1e-6 and spread <= MOMENTS.max_spread


@compiled
def is_saturated(phase, orders):
    """Return whether the slope of the phase is large within `slope_range` standard deviations."""
    slope = 0.0
    bend = 0.0
    for j in range(len(phase)):
        if sum_of(orders[j]) == 1:
            slope += phase[j] ** 2
        else:
            for v in range(orders.shape[1]):
                if orders[j, v]:
                    range_factor = MOMENTS.slope_range ** (sum_of(orders[j]) - 1)
                    bend += abs(phase[j]) * orders[j, v] * range_factor
    return np.sqrt(slope) - bend >= MOMENTS.saturated


@compiled
def _hermite(xi, orders, powers, terms):
    """Fill He_k of every variable and their products Ψ_j at a complex point."""
    for v in range(len(xi)):
        He = powers[v]
        x = xi[v]
        He[0] = 1.0
        if len(He) > 1:
            He[1] = x
        for k in range(2, len(He)):
            He[k] = x * He[k - 1] - (k - 1) * He[k - 2]
    for j in range(len(terms)):
        terms[j] = 1.0
        for v in range(len(xi)):
            if orders[j, v]:
                terms[j] *= powers[v, orders[j, v]]


@compiled
def _contour(phase, orders, powers, saddle, frame):  # noqa: PLR0912
    """Fill s and L, and return whether there is a saddle nearby and det L."""
    n = len(saddle)
    step = np.empty(n, np.complex128)
    curve = np.empty((n, n), np.complex128)
    first = np.zeros(n)
    for j in range(len(phase)):
        if sum_of(orders[j]) == 1:
            for a in range(n):
                first[a] = phase[j] if orders[j, a] else first[a]
    # Newton steps towards the saddle.
    saddle[:] = 0.0
    is_definite = True
    step_size = 0.0
    for sweep in range(MOMENTS.newton_steps + 1):
        _slopes(phase, orders, saddle, powers, step, curve)
        for a in range(n):  # curve = I − i∇²ψ becomes its factor R
            step[a] = 1j * step[a] - saddle[a]
            for b in range(a + 1):
                total = (1.0 if a == b else 0.0) - 1j * curve[a, b]
                for k in range(b):
                    total -= curve[a, k] * curve[b, k]
                is_definite = is_definite and (a != b or total.real > 0.05)
                curve[a, b] = np.sqrt(total) if a == b else total / curve[b, b]
        step_size = 0.0
        for a in range(n):
            step_size += abs(step[a])
        if sweep == MOMENTS.newton_steps or not is_definite or step_size < 1e-6:
            break
        substitute(curve, step)
        saddle += step
    size = 0.0
    scale = 1.0 + 0j
    frame[:] = 0.0
    for a in range(n):
        size += saddle[a].real ** 2 + saddle[a].imag ** 2
        scale /= curve[a, a]
        frame[a, a] = 1.0
    if not (
        is_definite and size < 4 * MOMENTS.saturated**2 and step_size < 1e-3 * MOMENTS.saturated
    ):
        saddle[:] = 0.0
        return False, 1.0 + 0j
    for b in range(n):  # L = R⁻ᵀ
        for a in range(n - 1, -1, -1):
            for k in range(a + 1, n):
                frame[a, b] -= curve[k, a] * frame[k, b]
            frame[a, b] /= curve[a, a]
    first /= np.sqrt(inner(first, first)) + 1e-300  # the first axis of ζ along the slope
    first[0] -= 1.0
    long = inner(first, first)
    for a in range(n if long > 1e-12 else 0):
        factor = 2 * inner(frame[a], first) / long
        for b in range(n):
            frame[a, b] -= factor * first[b]
    return True, scale


@compiled
def _slopes(phase, orders, xi, powers, gradient, curve):
    """Fill the gradient and the Hessian of the phase at a complex point."""
    n = len(xi)
    _hermite(xi, orders, powers, np.empty(0, np.complex128))
    gradient[:] = 0.0
    curve[:] = 0.0
    for j in range(len(phase)):
        if phase[j] == 0:
            continue
        for a in range(n):
            if not orders[j, a]:
                continue
            for b in range(-1, a + 1):  # −1: by a alone
                if b >= 0 and not orders[j, b]:
                    continue
                value = phase[j] + 0j
                for v in range(n):
                    k = orders[j, v]
                    if k == 0:
                        continue
                    for _ in range((v == a) + (v == b)):
                        value *= k
                        k -= 1
                    value *= powers[v, k] if k >= 0 else 0.0
                if b < 0:
                    gradient[a] += value
                else:
                    curve[a, b] += value
                    curve[b, a] = curve[a, b]
