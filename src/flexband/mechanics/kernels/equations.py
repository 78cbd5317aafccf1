"""The equations of motion, Eq. (26), on lanes: residual and tangent, assembled from the parts.

`state.State` describes all rows of z, which are rows of lanes. `memory` is work space of force
laws.
"""

from __future__ import annotations

from flexband.mechanics.kernels.angles import (
    add_angle_tangent,
    pass_on_moments,
    update_angles,
    update_sensor_angles,
)
from flexband.mechanics.kernels.constraints import add_constraints, add_products
from flexband.mechanics.kernels.elements.elastic import (
    add_elastic_forces,
    add_elastic_tangent,
    elastic_energy,
    update_free_strains,
)
from flexband.mechanics.kernels.friction.rows import (
    add_friction,
    add_jacobian,
    add_to_contacts,
    update_friction,
)
from flexband.mechanics.kernels.lanes import (
    add_to,
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
from flexband.mechanics.kernels.laws.forces import add_law_forces, add_law_tangent, read_laws
from flexband.mechanics.kernels.running_extremes import update_extremes
from flexband.mechanics.kernels.springs import (
    add_spring_forces,
    add_spring_tangent,
    spring_energy,
    update_springs,
)


@compiled
def violated_constraint(structure, values, now, z, r, tolerance):
    """Return the multiplier of the constraint that is violated most, or 0; r is work space."""
    state = structure.state
    update_angles(structure, values, z)
    clear(r, state.velocity)
    add_constraints(structure.terms, values.terms, values.functions, now, z, r)
    largest = splat(0.0)
    worst = splat(0.0)
    for k in range(state.multiplier, state.friction):
        off = magnitude(load(r, k)) * load(values.inverse_scale, 1)
        worst = where(less(off, largest), worst, splat(float(k)))
        largest = maximum(off, largest)
    return where(less(largest, splat(tolerance)), splat(0.0), worst)


@compiled
def add_mass_product(mass, values, z, first, r):
    """Add M x, where x₀ = 0, x₁, x₂, … start in row `first` of z."""
    row = 0
    total = load(r, 0)
    for p in range(len(mass.i)):
        i = mass.i[p]
        j = mass.j[p]
        entry = load(values, p)
        if i != row:
            store(r, row, total)
            row = i
            total = load(r, i)
        total += entry * load(z, first + j)
        if i != j:
            add_to(r, j, entry * load(z, first + i))
    store(r, row, total)


@compiled
def add_mass(mass, values, matrix):
    """Add M, or what the matrices have in its place."""
    for p in range(len(mass.slot)):
        add_to(matrix, mass.slot[p], load(values, p))


@compiled
def clear_matrix(pattern, matrix):
    """Set the matrix to zero, and the pivots that fill up its tiles to one."""
    clear(matrix, pattern.rows)
    for k in range(len(pattern.filled_up)):
        store(matrix, pattern.filled_up[k], splat(1.0))


@compiled
def update_dependent(structure, values, now, z):
    """Set the rows of z that follow from q, and free strains, which follow from the time."""
    update_angles(structure, values, z)
    update_free_strains(structure.beams, values.beams, values.functions, now)
    update_free_strains(structure.cables, values.cables, values.functions, now)
    update_springs(structure, values, now, z)


@compiled
def _add_loads(structure, values, now, z, r, memory):
    """Add −Q of the forces that are products of z or force laws, without springs, and friction."""
    add_products(structure.forces, values.forces, values.functions, now, z, r, -1.0)
    add_law_forces(structure, values, now, z, r, memory)
    if structure.state.angle > structure.state.friction:
        update_friction(structure, values, now, z, r)
        add_friction(structure, values, now, z, r)


@compiled
def residual(structure, values, now, z, r, memory):
    """Set r to [M a + Φ_qᵀλ + F(q) − Q; Φ(q, t)] of Eq. (27), in the rows of z."""
    state = structure.state
    update_dependent(structure, values, now, z)
    clear(r, state.velocity)
    for i in range(1, state.coordinates + 1):
        store(r, i, -load(values.weight, i))
    add_mass_product(structure.mass, values.mass, z, state.acceleration, r)
    add_elastic_forces(structure, values, z, r)
    add_spring_forces(structure, values, z, r)
    _add_loads(structure, values, now, z, r, memory)
    add_constraints(structure.terms, values.terms, values.functions, now, z, r)
    pass_on_moments(structure, values, z, r)


@compiled
def loads(structure, values, now, z, r, memory):
    """Set r to the loads of `_add_loads` alone."""
    update_dependent(structure, values, now, z)
    clear(r, structure.state.velocity)
    _add_loads(structure, values, now, z, r, memory)
    pass_on_moments(structure, values, z, r)


@compiled
def to_right_side(structure, r, weight):
    """Turn a residual into the right-hand side of `tangent`'s system, −[r_q; Φ/weight]."""
    for i in range(1, structure.state.angle):
        part = load(r, i)
        store(r, i, -part if i <= structure.state.coordinates else -part / weight)


@compiled
def tangent(structure, values, now, z, weight, rate, matrix, blocks):
    """Set the matrix to [M + weight (K + rate C + Σ λ Φ_qq), Φ_qᵀ; Φ_q, 0].

    C is the damping of springs and beams. It follows a `residual` of the same state. Forces that
    are products of z are left out: their tangent is small, and not symmetric.
    """
    clear_matrix(structure.pattern, matrix)
    add_mass(structure.mass, values.regular_mass, matrix)
    add_elastic_tangent(structure, values, z, weight, rate, matrix, blocks)
    add_spring_tangent(structure, values, now, z, weight, rate, matrix)
    add_law_tangent(structure, values, now, z, weight, rate, matrix, blocks)
    add_jacobian(structure, values, now, z, weight, matrix)
    add_angle_tangent(structure, values, z, weight, matrix)


@compiled
def prepare(structure, values, now, z, memory):
    """Set the rows of z that sensors may depend on."""
    state = structure.state
    update_dependent(structure, values, now, z)
    update_sensor_angles(structure, values, z)
    if structure.reads_energy:
        store(z, state.energy, elastic_energy(structure, values, z))
        add_to(z, state.energy, spring_energy(structure, values, z))
    if structure.reads_laws:
        read_laws(structure, values, now, z, memory)
        add_to_contacts(structure, values, z)


@compiled
def sense(structure, values, now, z, outputs, memory):
    """Set the sensors' rows, after the rows of z that they may depend on."""
    prepare(structure, values, now, z, memory)
    clear(outputs, outputs.shape[0])
    add_products(structure.sensors, values.sensors, values.functions, now, z, outputs, 1.0)


@compiled
def watch(structure, values, now, work, before, time, mask):
    """Take a step from one time to another into account in extremes, where `mask` is true."""
    extremes = structure.extremes
    count = len(structure.extremes.kind)
    if count == 0:
        update_sensor_angles(structure, values, work.z)
    else:
        prepare(structure, values, now, work.z, work.blocks)
        clear(work.forms, count)
        add_products(extremes, values.extremes, values.functions, now, work.z, work.forms, 1.0)
        update_extremes(
            extremes, values.windows, structure.state, work.z, work.forms, before, time, mask
        )
