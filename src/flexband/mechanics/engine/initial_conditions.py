"""Consistent positions, velocities and accelerations at the start, by one projection each.

All three solve the saddle-point system of the integrator, [M + s K, Φ_qᵀ; Φ_q, 0], where K is the
stiffness of the beams. With a large s a beam prefers to move as a rigid body: positions minimize
the elastic energy, then the distance to the guess, in which turns count much more than places;
velocities minimize the rate of deformation, then the kinetic energy. With s = 0 the same system
gives accelerations and multipliers.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexband.mechanics.engine import projection
from flexband.mechanics.kernels.angles import pass_on_moments, update_angles
from flexband.mechanics.kernels.constraints import add_constraint_tangent, add_constraints
from flexband.mechanics.kernels.elements.elastic import add_elastic_forces, add_elastic_tangent
from flexband.mechanics.kernels.equations import (
    add_mass,
    add_mass_product,
    clear_matrix,
    to_right_side,
    violated_constraint,
)
from flexband.mechanics.kernels.factorization import factorize, solve
from flexband.mechanics.kernels.failure_codes import FAILURE
from flexband.mechanics.kernels.lanes import (
    any_true,
    clear,
    compiled,
    less,
    load,
    magnitude,
    maximum,
    splat,
    store,
    where,
)
from flexband.mechanics.kernels.laws.forces import start_states
from flexband.mechanics.kernels.laws.states import hold_states
from flexband.mechanics.kernels.springs import set_rest


class AssemblyOptions(NamedTuple):
    """How the start is found. Lengths are relative to the size of the mechanism."""

    iterations: int = 50
    """Of Newton's method, at most."""
    constraint_tolerance: float = 1e-9
    """Of Φ at the start."""
    position_tolerance: float = 1e-12
    """Of the last correction."""
    max_step: float = 0.2
    """Longer corrections might leave the branch."""
    min_pivot: float = 1e-12
    """As in `projection`, but smaller: members are almost rigid here."""
    velocity_sweeps: int = 4
    """Projections of the velocities."""


ASSEMBLY = AssemblyOptions()


@compiled
def elastic_matrix(structure, values, mass, s, work, smallest):
    """Factor [M + s K, Φ_qᵀ; Φ_q, 0], M with entries `mass`; return the multipliers left out."""
    z = work.z
    matrix = work.matrix
    blocks = work.blocks
    clear_matrix(structure.pattern, matrix)
    add_mass(structure.mass, mass, matrix)
    add_elastic_tangent(structure, values, z, s, splat(0.0), matrix, blocks)
    add_constraint_tangent(
        structure, values, structure.terms, values.terms, np.int64(0), z, splat(0.0), matrix
    )
    return factorize(structure.pattern, matrix, smallest, work.r)


@compiled
def assemble(structure, values, s, work, keeps_shape):
    """Move q to where Φ(q, 0) = 0; deformations relax unless it `keeps_shape`.

    Returns the multiplier of the constraint that is violated most, or 0 if all are met, and how
    many multipliers had to be left out at the guess.
    """
    state = structure.state
    z = work.z
    r = work.r
    moving = splat(1.0)
    redundant = splat(0.0)
    for iteration in range(ASSEMBLY.iterations):
        update_angles(structure, values, z)
        left_out = elastic_matrix(
            structure, values, values.metric, s, work, splat(ASSEMBLY.min_pivot)
        )
        if iteration == 0:
            redundant = left_out
        # Solve for the correction.
        clear(r, state.velocity)
        if not keeps_shape:
            add_elastic_forces(structure, values, z, r)
        add_constraints(structure.terms, values.terms, values.functions, np.int64(0), z, r)
        pass_on_moments(structure, values, z, r)
        to_right_side(structure, r, s)
        solve(structure.pattern, structure.pattern.below, work.matrix, (r,))
        largest = splat(0.0)
        for i in range(1, state.coordinates + 1):
            step = magnitude(s * load(r, i)) * load(values.inverse_scale, i)
            largest = maximum(largest, step)
        # Limit its length, and apply it where the search has not ended.
        short = less(largest, splat(ASSEMBLY.max_step))
        part = where(short, splat(1.0), ASSEMBLY.max_step / largest)
        for i in range(1, state.coordinates + 1):
            step = part * (s * load(r, i))
            store(z, i, where(moving, load(z, i) + step, load(z, i)))
        moving = where(less(largest, splat(ASSEMBLY.position_tolerance)), splat(0.0), moving)
        if not any_true(moving):
            break
    return violated_constraint(
        structure, values, np.int64(0), z, r, ASSEMBLY.constraint_tolerance
    ), redundant


@compiled
def project_velocities(structure, values, s, work):
    """Set v with Φ_q v + Φ_t = 0 and the least rate of deformation, nearest to the guess."""
    state = structure.state
    z = work.z
    r = work.r
    elastic_matrix(structure, values, values.regular_mass, s, work, splat(ASSEMBLY.min_pivot))
    velocity = state.velocity
    terms = structure.terms
    for i in range(1, state.coordinates + 1):
        store(z, velocity + i, load(values.velocity, i))
    for _ in range(ASSEMBLY.velocity_sweeps):
        clear(r, state.velocity)
        add_mass_product(structure.mass, values.mass, z, velocity, r)
        for t in range(len(terms.k)):
            k = terms.k[t]
            i = terms.i[t]
            j = terms.j[t]
            rate = load(values.rates, terms.f[t])
            drift = load(values.terms, t) * rate * load(z, i) * load(z, j)
            store(r, k, load(r, k) - drift)
        solve(structure.pattern, structure.pattern.below, work.matrix, (r,))
        projection.refine(structure, values, work, r)
        for i in range(1, state.coordinates + 1):
            store(z, velocity + i, load(r, i))


@compiled
def start(structure, values, work, failure, keeps_shape, number):
    """Fill the state z of one block of samples at time zero, and `failure`, see `entries`.

    The search begins at the coordinates in z, each angle on the turn nearest to that in z. If it
    `keeps_shape`, deformations stay as they are, and so do springs' elongations at rest that are
    known. `number` is the weight of rates of deformation in the projection of the velocities.
    """
    state = structure.state
    z = work.z
    for i in range(state.multiplier, state.rows):
        if (i < state.angle or i >= state.velocity) and not state.gap <= i < state.extreme:
            store(z, i, splat(0.0))
    s = load(values.rigidity, 0)
    failed, redundant = assemble(structure, values, s, work, keeps_shape)
    set_rest(structure, values, z)
    project_velocities(structure, values, number * s, work)
    if state.rule < state.extreme:
        start_states(structure, values, z, work.blocks)
        hold_states(state, z, splat(1.0))
    left_out = projection.accelerate(structure, values, np.int64(0), work, splat(1.0))
    if any_true(left_out):
        projection.share(structure, values, np.int64(0), work, left_out)
    code = where(redundant, splat(FAILURE.singular_start), splat(FAILURE.not_assembled))
    store(failure, 0, where(failed, code, splat(0.0)))
    store(failure, 1, splat(0.0))
    store(failure, 2, failed - float(state.multiplier))
    store(failure, 3, left_out)
