"""What a page needs of an expansion to compute bounds of μ + c σ on any part of its inputs.

ξ of an input of less scatter is s ξ′, with 0 ≤ s ≤ 1 and ξ′ distributed as ξ was. A direct
expansion is given by its coefficients, since orthogonal polynomials of s ξ′ are sums of those of
ξ′. A phase expansion is given by its parts and a rule of points ξ′ for its smooth moments; if that
would have too many points, by the smooth moments themselves, and the scatter cannot change.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from flexband.report.page.arrays import JsonRecord, pack
from flexband.uncertainty.expansions.bounds.discs import in_discs
from flexband.uncertainty.expansions.bounds.scan import scan, scatter_points, tensor_grid
from flexband.uncertainty.expansions.direct import DirectExpansion
from flexband.uncertainty.expansions.expansion import Expansion
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.points.sobol import scrambled_sobol
from flexband.uncertainty.phases.expansion import PhaseExpansion
from flexband.uncertainty.phases.integration.rules import Rule, axis_rule, resolving_rule
from flexband.uncertainty.phases.moment_orders import MomentPolynomials, moment_orders
from flexband.uncertainty.phases.moments import mean_and_std
from flexband.uncertainty.phases.phase_options import SEARCH
from flexband.uncertainty.phases.terms import PartTerms, corners


def model(expansion: Expansion, scale: np.ndarray) -> JsonRecord:
    """Return an expansion over the scale of its outputs as a tree with packed arrays.

    Its `error` is by how much μ ± σ of a page is off from that of the expansion, of each output.
    """
    tree = {"outputs": expansion.outputs.tolist(), "scale": scale.tolist()}
    if isinstance(expansion, PhaseExpansion):
        return tree | _of_phases(expansion, scale)
    assert isinstance(expansion, DirectExpansion)
    values = expansion.values
    rows = values.coefficients.reshape(len(values.index), len(scale), -1) / scale[:, None]
    points, beside = scan(values.interval_orders)
    points = _polar(in_discs(points, values.discs), values.discs)
    error = {"error": [0.0] * len(scale)}
    return tree | _terms(values, rows) | _scan(points, beside) | {"kind": "direct"} | error


def _polar(points: np.ndarray, discs: Sequence[int]) -> np.ndarray:
    """Return points (points, m) with the radius and the angle of each pair in a disc."""
    for first in discs:
        x, y = points[:, first : first + 2].T.copy()
        points[:, first : first + 2] = np.stack([np.hypot(x, y), np.arctan2(y, x)], axis=1)
    return points


def _of_phases(expansion: PhaseExpansion, scale: np.ndarray) -> JsonRecord:
    parts = expansion.parts
    columns = expansion.columns
    terms = PartTerms.from_expansion(parts, columns)
    m = terms.interval_dimension
    moments = terms.moments
    # What the page needs in any case: polynomials of the moments, and points of the scan.
    smooth_moments = MomentPolynomials.from_index(*moment_orders([terms]))
    polynomials, eta, inverse = smooth_moments
    rule = _rule(terms, eta, scale)
    tree = _scan(*_scan_of_waves(terms.orders[:m], terms.reach()[:m])) | {
        "kind": "phases",
        "carriers": columns.carriers,
        "turning": terms.phase_combinations.tolist(),
        "orders": polynomials.index.tolist(),
        "error": _difference(expansion, terms, smooth_moments, rule).tolist(),
    }
    if rule is None:
        # The smooth moments themselves, over the scale of their outputs.
        smooth = np.moveaxis(inverse @ terms.table(eta), 0, 2)
        size = np.ones((len(scale), moments.block)) * scale[:, None]
        size[:, [moments.variance, *range(moments.turn_real, moments.block)]] *= scale[:, None]
        smooth[:, : moments.phase] /= size.reshape(-1, 1)
        smooth[0, moments.phase :] = _turned_back(smooth[0, moments.phase :])
        return tree | _round_coefficients(smooth)
    # The parts over the scale of their outputs, and the rule that integrates their moments.
    points, weights = rule
    rows = np.moveaxis(terms.coefficients, 0, 2).copy()
    rows[:, : columns.phase] /= scale[:, None]
    for first in range(columns.phase, columns.width, columns.block):
        rows[0, first] = _turned_back(rows[0, first])
        rows[:, first + 1 : first + columns.block] /= np.tile(scale, 2)[:, None]
    variables = enumerate(zip(parts.families, terms.orders[m:], strict=True))
    values = {str(v): pack(family.values(int(k), points[:, v])) for v, (family, k) in variables}
    rules = {"nodes": eta, "inverse": inverse, "points": points, "weights": weights}
    packed_rules = {name: pack(array) for name, array in rules.items()}
    return tree | _terms(parts, rows) | packed_rules | {"polynomials": values}


def _difference(
    expansion: PhaseExpansion, terms: PartTerms, smooth: MomentPolynomials, rule: Rule | None
) -> np.ndarray:
    """Return the largest difference of μ ± σ from that of the expansion, (outputs,).

    It is measured at some times, and at the middle, corners and other places of the intervals.
    """
    most_times = 40
    places = 8
    times = np.unique(np.linspace(0, len(terms.coefficients) - 1, most_times).astype(int))
    few = replace(terms, coefficients=np.ascontiguousarray(terms.coefficients[times]))
    m = terms.interval_dimension
    sobol_points = 2 * scrambled_sobol(places * (m > 0), m, seed=2) - 1
    eta = np.concatenate([corners(m), sobol_points])
    basis = smooth.expansion.chebyshev(eta)[:, smooth.expansion.i]
    table = basis @ (smooth.inverse @ few.table(smooth.eta, rule))
    page_moments = np.array(mean_and_std(table, few.moments))  # (2, times, places, outputs)
    python = np.moveaxis(np.array(expansion.select(expansion.outputs, times).moments(eta)), 3, 1)
    return np.abs(page_moments - python).sum(axis=0).max(axis=(0, 1))


def _rule(terms: PartTerms, eta: np.ndarray, scale: np.ndarray) -> Rule | None:
    """Return ξ and weights for the smooth moments at η, along axes if they do; or None."""
    # Largest error of moments by a rule along axes, relative to the width of the bands, and
    # at how many times and η it is checked
    tolerance = 3e-7
    check_points = 10
    # Most points times η times times at which a page may compute an output for a new scatter: 3 s
    max_evaluations = 3e7
    change = terms.over_random
    if (rule := resolving_rule(change)) is not None:
        return rule
    strides = [
        slice(0, None, max(1, -(-len(array) // check_points)))
        for array in (terms.coefficients, eta)
    ]
    few = replace(terms, coefficients=np.ascontiguousarray(terms.coefficients[strides[0]]))
    reference = np.array(mean_and_std(few.table(eta[strides[1]]), terms.moments))
    for in_pairs in (3, 5):  # points per axis for pairs of axes
        points, weights = axis_rule(change, in_pairs)
        if len(terms.coefficients) * len(eta) * len(weights) * len(scale) > max_evaluations:
            return None
        table = few.table(eta[strides[1]], (points, weights))
        if np.all(np.abs(mean_and_std(table, terms.moments) - reference) < tolerance * scale):
            return points, weights
    return None


def _turned_back(phase: np.ndarray) -> np.ndarray:
    """Return phases [rad] less their whole turns, which change nothing."""
    return phase - 2 * np.pi * np.rint(phase / (2 * np.pi))


def _terms(expansion: HybridExpansion, rows: np.ndarray) -> JsonRecord:
    """Return Φ, Ψ, the terms Φ_i Ψ_j and their coefficients, shape (terms, rows, times)."""
    families = expansion.families
    orders = expansion.random_orders
    return {
        "interval_index": expansion.interval_index.tolist(),
        "random_index": expansion.random_index.tolist(),
        "i": expansion.i.tolist(),
        "j": expansion.j.tolist(),
        "families": [family.name for family in families],
        "norms": [family.norms(k).tolist() for family, k in zip(families, orders, strict=True)],
        **_round_coefficients(rows),
    }


def _round_coefficients(coefficients: np.ndarray) -> JsonRecord:
    """Return coefficients, the constants, which are by far the largest, apart."""
    # Coefficients are rounded to multiples of it, relative to the width of an output's bands
    quantum = 1e-8
    parts = {"constant": coefficients[0], "others": coefficients[1:]}
    return {name: pack(values, quantum) for name, values in parts.items()}


def _scan_of_waves(orders: np.ndarray, reach: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the η of a scan for phases that change by `reach`, and those next to each.

    σ of little scatter has a kink wherever the slope of the wave vanishes.
    """
    # Points of a scan for phases relative to those of `scan_points`, the first ones that
    # are not too many; and points of a scan in more variables than a grid can have
    scan_densities = (2.0, 1.5, 1.0)
    max_scan_points = 4000
    scattered_points = 2048
    for density in scan_densities:
        waves = np.where(reach > SEARCH.scanned_reach, 3 * reach + 2 * np.cbrt(reach), 0.0)
        counts = np.where(orders > 0, np.ceil(density * (2 * orders + waves)) + 2, 1)
        if counts.prod() <= max_scan_points:
            return tensor_grid(counts.astype(int).tolist())
    return scatter_points(scattered_points, orders > 0)


def _scan(points: np.ndarray, beside: np.ndarray) -> JsonRecord:
    """Return the points η of a scan, and the numbers of the points next to each."""
    return {"scan": pack(points), "beside": pack(beside, 1.0)}
