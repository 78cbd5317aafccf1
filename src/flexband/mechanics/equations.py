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

from flexband.lanes import WIDTH, add_to, compiled, load
from flexband.mechanics.beam import GAUSS_POINTS
from flexband.mechanics.elastic_forces import (
    HESSIAN_ROWS,
    add_elastic_forces,
    add_elastic_tangent,
)
from flexband.mechanics.factorization import Pattern
from flexband.mechanics.spring_forces import add_spring_forces, add_spring_tangent


class Structure(NamedTuple):
    """What is the same for all samples: sizes, and which number goes where."""

    coordinates: int
    multipliers: int
    velocity: int  # row of z where [0, v] starts
    acceleration: int  # row of z where [0, a] starts
    functions: int  # of time, the constant one included
    mass_i: np.ndarray
    mass_j: np.ndarray
    mass_slot: np.ndarray
    element_first: np.ndarray  # first coordinate of the element's twelve
    element_slot: np.ndarray  # (elements, 12, 12)
    term_k: np.ndarray  # multiplier
    term_i: np.ndarray
    term_j: np.ndarray
    term_f: np.ndarray
    term_slot: np.ndarray  # (terms, 3): of (k, i), (k, j), (i, j)
    spring_start: np.ndarray  # spring -> first of its coordinates
    spring_coordinate: np.ndarray
    spring_slot: np.ndarray  # (springs, most coordinates, most coordinates)
    sensor_row: np.ndarray
    sensor_i: np.ndarray
    sensor_j: np.ndarray
    sensor_f: np.ndarray
    pattern: Pattern


class Values(NamedTuple):
    """The numbers of one block of samples, each of shape (rows, WIDTH)."""

    start: np.ndarray  # guess of [1, q]
    inverse_scale: np.ndarray  # of [1, q]: one over the size of the mechanism, or one
    mass: np.ndarray
    force: np.ndarray  # constant forces on [1, q]
    inverse_length: np.ndarray  # of elements
    stiffness: np.ndarray  # nine rows a Gauss point
    rigidity: np.ndarray  # weight of K against M in the projections at the start [s²]
    coefficient: np.ndarray  # of terms
    spring_x: np.ndarray  # of the spring's coordinates, in the X component of its vector
    spring_y: np.ndarray
    spring_stiffness: np.ndarray
    rest_length: np.ndarray  # negative: relaxed at the start
    sensor: np.ndarray
    functions: np.ndarray  # `Structure.functions` rows a time
    rates: np.ndarray  # values, first and second derivatives of the functions at the start


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
        unknowns, slots = structure.pattern.size, structure.pattern.slots + 1
        q = structure.coordinates + 1
        rows = (unknowns + 1 + 2 * q, q, unknowns + 1, slots, unknowns)
        rows += (structure.pattern.longest_row, GAUSS_POINTS * HESSIAN_ROWS, 1)
        return Work(*(np.zeros((count, WIDTH)) for count in rows))


@compiled
def add_constraints(structure, values, now, z, r):
    """Add Φ to the multipliers' rows and Φ_qᵀλ to the coordinates'."""
    for t in range(len(structure.term_k)):
        k, i, j = structure.term_k[t], structure.term_i[t], structure.term_j[t]
        c = load(values.coefficient, t) * load(values.functions, now + structure.term_f[t])
        zi, zj, zk = load(z, i), load(z, j), c * load(z, k)
        add_to(r, k, c * zi * zj)
        add_to(r, i, zk * zj)
        add_to(r, j, zk * zi)


@compiled
def add_constraint_tangent(structure, values, now, z, weight, matrix):
    """Add Φ_q, and `weight` times Σ λ Φ_qq."""
    for t in range(len(structure.term_k)):
        i, j = structure.term_i[t], structure.term_j[t]
        c = load(values.coefficient, t) * load(values.functions, now + structure.term_f[t])
        slot = structure.term_slot[t]
        add_to(matrix, slot[0], c * load(z, j))
        add_to(matrix, slot[1], c * load(z, i))
        curvature = weight * c * load(z, structure.term_k[t])
        add_to(matrix, slot[2], curvature if i != j else curvature + curvature)


@compiled
def add_mass_product(structure, values, z, first, r):
    """Add M x, where x₀ = 0, x₁, x₂, … start in row `first` of z."""
    for p in range(len(structure.mass_i)):
        i, j = structure.mass_i[p], structure.mass_j[p]
        mass = load(values.mass, p)
        add_to(r, i, mass * load(z, first + j))
        if i != j:
            add_to(r, j, mass * load(z, first + i))


@compiled
def add_mass(structure, values, matrix):
    """Add M."""
    for p in range(len(structure.mass_slot)):
        add_to(matrix, structure.mass_slot[p], load(values.mass, p))


@compiled
def clear(array):
    """Set all rows to zero."""
    for row in range(array.shape[0]):
        for k in range(array.shape[1]):
            array[row, k] = 0.0


@compiled
def residual(structure, values, now, z, r):
    """Set r to [M a + Φ_qᵀλ + F(q) − Q; Φ(q, t)] of Eq. (27), rows numbered as z."""
    clear(r)
    add_mass_product(structure, values, z, structure.acceleration, r)
    for i in range(1, structure.coordinates + 1):
        add_to(r, i, -load(values.force, i))
    add_elastic_forces(structure, values, z, r)
    add_spring_forces(structure, values, z, r)
    add_constraints(structure, values, now, z, r)


@compiled
def tangent(structure, values, now, z, weight, matrix, blocks):
    """Set the matrix to [M + weight (K + Σ λ Φ_qq), Φ_qᵀ; Φ_q, 0]."""
    clear(matrix)
    add_mass(structure, values, matrix)
    add_elastic_tangent(structure, values, z, weight, matrix, blocks)
    add_spring_tangent(structure, values, z, weight, matrix)
    add_constraint_tangent(structure, values, now, z, weight, matrix)


@compiled
def sense(structure, values, now, z, outputs):
    """Set the outputs, one row a component of a sensor."""
    clear(outputs)
    for t in range(len(structure.sensor_row)):
        c = load(values.sensor, t) * load(values.functions, now + structure.sensor_f[t])
        product = load(z, structure.sensor_i[t]) * load(z, structure.sensor_j[t])
        add_to(outputs, structure.sensor_row[t], c * product)
