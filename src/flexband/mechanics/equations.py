"""The equations of motion, Eq. (26), on lanes: residual and tangent, assembled from the parts.

With z = [1, q, λ] the constraints enter through the potential Σ c f(t) z_k z_i z_j, where z_k is
the multiplier of the row: its derivative by z_k is the constraint Φ_k, by z_i and z_j the
constraint force Φ_qᵀλ, and its second derivatives are Φ_q and Σ λ Φ_qq. One loop serves every
joint.

State `z` also holds velocities and accelerations: z = [1, q, λ | 0, v | 0, a], in rows of lanes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexband.lanes import (
    add_to,
    compiled,
    filled,
    inlined,
    less,
    load,
    magnitude,
    maximum,
    store,
    where,
    zeros,
)
from flexband.mechanics.cable_forces import add_cable_forces, add_cable_tangent
from flexband.mechanics.centre_line import GAUSS_POINTS
from flexband.mechanics.elastic_forces import HESSIAN_ROWS, add_elastic_forces, add_elastic_tangent
from flexband.mechanics.factorization import Pattern
from flexband.mechanics.spring_forces import add_spring_forces, add_spring_tangent

CONSTRAINT_TOLERANCE = 1e-9
"""What constraints may be off, relative to the size of the mechanism."""


class Mass(NamedTuple):
    """Entries (i, j), i ≤ j, of the mass matrix."""

    i: np.ndarray
    j: np.ndarray
    slot: np.ndarray


class Beams(NamedTuple):
    """Elements of all beams."""

    first: np.ndarray  # of the element's twelve coordinates
    damped: np.ndarray  # whether its material is
    slot: np.ndarray  # (elements, 12, 12)


class Cables(NamedTuple):
    """Elements of all cables."""

    first: np.ndarray  # of the element's eight coordinates
    slot: np.ndarray  # (elements, 8, 8)


class Springs(NamedTuple):
    """Springs and the coordinates that each depends on."""

    start: np.ndarray  # spring -> first of its coordinates
    coordinate: np.ndarray
    f: np.ndarray  # function of time that multiplies the pull
    slot: np.ndarray  # (springs, most coordinates, most coordinates)


class Terms(NamedTuple):
    """Products of the constraints, those with two variables first."""

    k: np.ndarray  # multiplier
    i: np.ndarray
    j: np.ndarray
    f: np.ndarray  # function of time
    slot: np.ndarray  # (terms, 3): of (k, i), (k, j), (i, j)
    products: int  # how many have i > 0


class Products(NamedTuple):
    """Products c f(t) z_i z_j, each for a row of forces or of sensors."""

    row: np.ndarray
    i: np.ndarray
    j: np.ndarray
    f: np.ndarray


class Structure(NamedTuple):
    """What is the same for all samples: sizes, and which number goes where."""

    coordinates: int
    multipliers: int
    velocity: int  # row of z where [0, v] starts
    acceleration: int  # row of z where [0, a] starts
    functions: int  # of time, the constant one included
    mass: Mass
    beams: Beams
    cables: Cables
    springs: Springs
    terms: Terms
    forces: Products  # rows as [1, q]
    sensors: Products
    pattern: Pattern


class BeamValues(NamedTuple):
    """Numbers of the elements."""

    inverse_length: np.ndarray
    stiffness: np.ndarray  # nine rows a Gauss point
    retardation: np.ndarray  # of Kelvin and Voigt's solid [s]


class CableValues(NamedTuple):
    """Numbers of the cables' elements."""

    inverse_length: np.ndarray
    stiffness: np.ndarray  # four rows a Gauss point


class SpringValues(NamedTuple):
    """Numbers of the springs; x and y are coefficients of their coordinates."""

    x: np.ndarray
    y: np.ndarray
    stiffness: np.ndarray
    rest_length: np.ndarray  # negative: relaxed at the start
    cubic: np.ndarray
    damping: np.ndarray
    pull: np.ndarray


class Values(NamedTuple):
    """The numbers of one block of samples, each of shape (rows, WIDTH)."""

    start: np.ndarray  # guess of [1, q]
    velocity: np.ndarray  # wish for [0, v]
    inverse_scale: np.ndarray  # of [1, q]: one over the size of the mechanism, or one
    mass: np.ndarray
    force: np.ndarray  # constant forces on [1, q]
    rigidity: np.ndarray  # weight of K against M in the projections at the start [s²]
    coefficient: np.ndarray  # of terms
    load: np.ndarray  # coefficients of forces
    sensor: np.ndarray
    functions: np.ndarray  # `Structure.functions` rows a time
    rates: np.ndarray  # values, first and second derivatives of the functions at the start
    beams: BeamValues
    cables: CableValues
    springs: SpringValues


class Work(NamedTuple):
    """Work space of one block, each array of shape (rows, WIDTH)."""

    z: np.ndarray
    a: np.ndarray  # the integrator's acceleration-like variable, rows as [1, q]
    r: np.ndarray  # residual, then solution, rows as [1, q, λ]
    matrix: np.ndarray
    inverse_pivots: np.ndarray
    row: np.ndarray  # of the factor, while it is made
    blocks: np.ndarray  # second derivatives at the Gauss points of an element
    rate: np.ndarray  # of Newton's convergence, one row

    @staticmethod
    def of(structure: Structure) -> Work:
        """Return work space for a mechanism, zeros."""
        pattern, q = structure.pattern, structure.coordinates + 1
        rows = (pattern.unknowns + 1 + 2 * q, q, pattern.unknowns + 1, pattern.rows)
        rows += (4 * pattern.tiles, 4 * pattern.longest_row, GAUSS_POINTS * HESSIAN_ROWS, 1)
        return Work(*(zeros(count) for count in rows))


@compiled
def add_constraints(terms, coefficient, functions, now, z, r):
    """Add Φ to the multipliers' rows and Φ_qᵀλ to the coordinates'."""
    for t in range(len(terms.k)):
        k, i, j = terms.k[t], terms.i[t], terms.j[t]
        c = load(coefficient, t) * load(functions, now + terms.f[t])
        zi, zj, zk = load(z, i), load(z, j), c * load(z, k)
        add_to(r, k, c * zi * zj)
        add_to(r, j, zk * zi)
        if t < terms.products:
            add_to(r, i, zk * zj)


@compiled
def add_constraint_tangent(terms, coefficient, functions, now, z, weight, matrix):
    """Add Φ_q, and `weight` times Σ λ Φ_qq."""
    for t in range(len(terms.k)):
        i, j, slot = terms.i[t], terms.j[t], terms.slot[t]
        c = load(coefficient, t) * load(functions, now + terms.f[t])
        add_to(matrix, slot[1], c * load(z, i))
        if t < terms.products:
            add_to(matrix, slot[0], c * load(z, j))
            curvature = weight * c * load(z, terms.k[t])
            add_to(matrix, slot[2], curvature if i != j else curvature + curvature)


@compiled
def add_products(products, coefficient, functions, now, z, rows, sign):
    """Add `sign` c f(t) z_i z_j to each product's row."""
    for t in range(len(products.row)):
        c = sign * load(coefficient, t) * load(functions, now + products.f[t])
        add_to(rows, products.row[t], c * load(z, products.i[t]) * load(z, products.j[t]))


@inlined
def violated_constraint(structure, values, now, z, r):
    """Return the multiplier of the constraint that is furthest off, 0 where all are met.

    `r` is work space.
    """
    clear(r)
    add_constraints(structure.terms, values.coefficient, values.functions, now, z, r)
    largest, worst = filled(0.0), filled(0.0)
    for k in range(structure.coordinates + 1, structure.pattern.unknowns + 1):
        off = magnitude(load(r, k)) * load(values.inverse_scale, 1)
        worst = where(less(off, largest), worst, filled(float(k)))
        largest = maximum(off, largest)
    return where(less(largest, filled(CONSTRAINT_TOLERANCE)), filled(0.0), worst)


@compiled
def add_mass_product(mass, values, z, first, r):
    """Add M x, where x₀ = 0, x₁, x₂, … start in row `first` of z."""
    for p in range(len(mass.i)):
        i, j = mass.i[p], mass.j[p]
        entry = load(values, p)
        add_to(r, i, entry * load(z, first + j))
        if i != j:
            add_to(r, j, entry * load(z, first + i))


@compiled
def add_mass(mass, values, matrix):
    """Add M."""
    for p in range(len(mass.slot)):
        add_to(matrix, mass.slot[p], load(values, p))


@compiled
def clear(array):
    """Set all rows to zero."""
    for row in range(array.shape[0]):
        for k in range(array.shape[1]):
            array[row, k] = 0.0


@inlined
def clear_matrix(pattern, matrix):
    """Set the matrix to zero, and to one what fills up its tiles."""
    clear(matrix)
    for row in pattern.filled_up:
        store(matrix, row, filled(1.0))


@inlined
def residual(structure, values, now, z, r):
    """Set r to [M a + Φ_qᵀλ + F(q) − Q; Φ(q, t)] of Eq. (27), rows numbered as z."""
    clear(r)
    add_mass_product(structure.mass, values.mass, z, structure.acceleration, r)
    for i in range(1, structure.coordinates + 1):
        add_to(r, i, -load(values.force, i))
    add_elastic_forces(structure.beams, values.beams, z, structure.velocity, r)
    add_cable_forces(structure.cables, values.cables, z, r)
    add_spring_forces(
        structure.springs, values.springs, values.functions, now, z, structure.velocity, r
    )
    add_products(structure.forces, values.load, values.functions, now, z, r, -1.0)
    add_constraints(structure.terms, values.coefficient, values.functions, now, z, r)


@inlined
def to_right_side(structure, r, weight):
    """Turn a residual into the right-hand side of `tangent`'s system, −[r_q; Φ/weight]."""
    for i in range(1, structure.pattern.unknowns + 1):
        part = load(r, i)
        store(r, i, -part if i <= structure.coordinates else -part / weight)


@inlined
def tangent(structure, values, now, z, weight, rate, matrix, blocks):
    """Set the matrix to [M + weight (K + rate C + Σ λ Φ_qq), Φ_qᵀ; Φ_q, 0].

    C is the damping of springs and beams. Forces that are products are left out: they are small
    changes, and not symmetric.
    """
    clear_matrix(structure.pattern, matrix)
    add_mass(structure.mass, values.mass, matrix)
    add_elastic_tangent(
        structure.beams, values.beams, z, structure.velocity, weight, rate, matrix, blocks
    )
    add_cable_tangent(structure.cables, values.cables, z, weight, matrix, blocks)
    add_spring_tangent(
        structure.springs, values.springs, values.functions, now, z, structure.velocity, weight,
        rate, matrix,
    )  # fmt: skip
    add_constraint_tangent(
        structure.terms, values.coefficient, values.functions, now, z, weight, matrix
    )


@compiled
def sense(sensors, coefficient, functions, now, z, outputs):
    """Set the sensors' rows."""
    clear(outputs)
    add_products(sensors, coefficient, functions, now, z, outputs, 1.0)
