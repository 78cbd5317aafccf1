"""Smooth moments with many random variables that are not all normal: Filon's quadrature.

A phase is nearly a sum of functions of one variable each, ψ(ξ) = Σ_v ψ_v(ξ_v) + r(ξ). So

    E[P e^{iψ}] = E[f Π_v e^{iψ_v(ξ_v)}],   f = P e^{ir},

where f hardly oscillates. It is interpolated at few points, and the products of one-dimensional
Lagrange polynomials ℓ_k with the fast factors are integrated exactly: W_vk = E[ℓ_k e^{iψ_v}]. With
the rules Q_v of these weights, and M_v that takes the middle point only,

    Π_v Q_v ≈ Π_v M_v + Σ_v (Q_v − M_v) Π_{w≠v} M_w + Σ_{u<v} (Q_u − M_u)(Q_v − M_v) Π_{w≠u,v} M_w,

with five points along each axis and three by three in each plane.
"""

from __future__ import annotations

from itertools import combinations, product
from typing import NamedTuple

import numpy as np

from flexband.compilation.caching import cached_on_disk
from flexband.compilation.functions import compiled
from flexband.uncertainty.expansions.bounds.terms import multiply, sum_of
from flexband.uncertainty.phases.integration.rules import PhaseChange, rule
from flexband.uncertainty.phases.moments import fill, moment_arrays, section, squares
from flexband.uncertainty.phases.phase_options import MOMENTS


class Grid(NamedTuple):
    """Points, and what the weights of the rules consist of."""

    fine: np.ndarray  # P_j at the points of a fine rule in each variable, (n, count, orders)
    lagrange: np.ndarray  # ℓ_k there times its weights, of an axis and then of one in a plane
    nodes: np.ndarray  # P_j at the points of an axis, (n, points, orders)
    where: np.ndarray  # number of the node in each variable of every point, (points, n)
    products: np.ndarray  # rows (v, k, u, l, point): node k of the axis v, and l of u; −1 for none

    @staticmethod
    def from_change(change: PhaseChange) -> Grid:
        """Return the grid for these families, highest orders, and changes of phases."""
        families = change.families
        orders = change.orders
        axis = MOMENTS.axis_points
        plane = MOMENTS.plane_points
        n = len(families)
        highest = int(orders.max(initial=0))
        rules = [
            rule(f, max(k, plane), a)
            for f, k, a in zip(families, orders, change.turns, strict=True)
        ]
        fine = np.zeros((n, max(len(x) for x, _ in rules), highest + 1))
        lagrange = np.zeros((*fine.shape[:2], axis + plane))
        nodes = np.zeros((n, axis, highest + 1))
        for v, (family, (x, w)) in enumerate(zip(families, rules, strict=True)):
            fine[v, : len(x)] = family.values(highest, x)
            coordinates = family.sequence(axis)
            nodes[v] = family.values(highest, coordinates)
            polynomials = [family.values(count - 1, x) for count in (axis, plane)]
            inverse = [np.linalg.inv(family.values(c - 1, coordinates[:c])) for c in (axis, plane)]
            ell = [p @ i for p, i in zip(polynomials, inverse, strict=True)]
            lagrange[v, : len(x)] = np.concatenate(ell, axis=1) * w[:, None]
        # The points of the axes and planes, each listed once.
        axes = [(v, k, -1, 0) for v in range(n) for k in range(axis)]
        planes = product(combinations(range(n), 2), range(plane), range(plane))
        products = [(-1, 0, -1, 0), *axes, *((v, k, u, i) for (v, u), k, i in planes)]
        points = np.zeros((len(products), n), dtype=int)
        for coordinates, (v, k, u, i) in zip(points, products, strict=True):
            if v >= 0:
                coordinates[v] = k
            if u >= 0:
                coordinates[u] = i
        where, point = np.unique(points, axis=0, return_inverse=True)
        return Grid(fine, lagrange, nodes, where, np.column_stack([products, point.ravel()]))

    def values(self, orders: np.ndarray) -> np.ndarray:
        """Return products Ψ_j of the orders (N, n) at the points, shape (points, N)."""
        v = np.arange(len(self.nodes))
        return self.nodes[v, self.where[:, None], orders].prod(axis=2)


@cached_on_disk
def by_axes(sections, orders, norms, grid, psi, parts, columns, turning, table):
    """Fill the table, as `by_points` does.

    `orders`, (N, n), and `norms` are the orders of Ψ_j in each variable, and γ_j; `psi`, (points,
    N), is Ψ_j at the points `grid`.
    """
    outputs = parts.outputs
    carriers = parts.carriers
    times, _, width = sections.coefficients.shape
    rows = np.empty((psi.shape[1], width))
    values = np.empty((len(psi), width))
    mean, base, first, square, second = moment_arrays(outputs, carriers, len(turning))
    rest = np.empty(len(psi))
    alone = np.empty(psi.shape[1])
    weights = np.empty(len(psi), np.complex128)
    for t in range(times):
        for e in range(len(sections.phi)):
            section(sections, t, e, rows)
            squares(rows, norms, parts, base, square)
            multiply(psi, rows, values)
            first[:] = 0.0
            second[:] = 0.0
            for k in range(len(turning)):
                c, d, s = turning[k]
                at = parts.phase + c * parts.block
                other = parts.phase + d * parts.block
                alone[:] = rows[:, at]
                rest[:] = values[:, at]
                if s != 0:
                    alone += s * rows[:, other]
                    rest += s * values[:, other]
                rest -= alone[0]
                _weigh(alone, orders, grid, rest, weights)
                for q in range(len(psi)):
                    factor = weights[q] * complex(np.cos(rest[q]), np.sin(rest[q]))
                    for o in range(outputs):
                        x = c * parts.block + o
                        u = factor * complex(values[q, parts.real + x], values[q, parts.imag + x])
                        if s == 0:
                            first[o, c] += u
                            second[o, k] += u * (values[q, o] - rows[0, o])
                        else:
                            x = d * parts.block + o
                            re = values[q, parts.real + x]
                            im = values[q, parts.imag + x]
                            second[o, k] += u * complex(re, s * im)
            fill(rows, parts, columns, turning, mean, base, first, square, second, table[t, e])


@compiled
def _weigh(phase, orders, grid, rest, weights):  # noqa: PLR0912
    """Fill the weights of all points, and subtract Σ_v ψ_v from the phase `rest` there."""
    fine, lagrange, nodes, where, products = grid
    n = fine.shape[0]
    highest = fine.shape[2]
    axis = MOMENTS.axis_points
    axis_phase = np.zeros((n, highest))
    fast = np.zeros((n, nodes.shape[1]))
    W = np.zeros((n, lagrange.shape[2]), np.complex128)
    M = np.zeros(n, np.complex128)
    # Collect the terms of the phase that have one variable only.
    for j in range(len(phase)):
        v = 0
        for w in range(n):
            v = w if orders[j, w] > orders[j, v] else v
        if sum_of(orders[j]) == orders[j, v]:
            axis_phase[v, orders[j, v]] = phase[j]
    # The weights of the rules along each axis, less those of the middle point.
    for v in range(n):
        axis_phase[v, 0] = 0.0
        for k in range(nodes.shape[1]):
            for j in range(highest):
                fast[v, k] += axis_phase[v, j] * nodes[v, k, j]
        for f in range(fine.shape[1]):
            angle = 0.0
            for j in range(highest):
                angle += axis_phase[v, j] * fine[v, f, j]
            turn = complex(np.cos(angle), np.sin(angle))
            for k in range(lagrange.shape[2]):
                W[v, k] += lagrange[v, f, k] * turn
        for k in range(axis):
            M[v] += W[v, k]
        W[v, 0] -= M[v]
        W[v, axis] -= M[v]
    # Multiply them to the weights of the points.
    weights[:] = 0.0
    for row in range(len(products)):
        v, k, u, i, q = products[row]
        weight = 1.0 + 0j
        for x in range(n):
            if x == v:
                weight *= W[v, k if u < 0 else axis + k]
            elif x == u:
                weight *= W[u, axis + i]
            else:
                weight *= M[x]
        weights[q] += weight
    for q in range(len(where)):
        for v in range(n):
            rest[q] -= fast[v, where[q, v]]
