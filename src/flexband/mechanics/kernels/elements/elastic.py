"""Elastic forces, tangent and energy of all flexible bodies, on lanes."""

from __future__ import annotations

from flexband.mechanics.kernels.elements.beams import add_beam_forces, add_beam_tangent, beam_energy
from flexband.mechanics.kernels.elements.cables import (
    add_cable_forces,
    add_cable_tangent,
    cable_energy,
)
from flexband.mechanics.kernels.elements.continuum import (
    add_continuum_forces,
    add_continuum_tangent,
    continuum_energy,
)
from flexband.mechanics.kernels.lanes import add_to, compiled, load, store


@compiled
def update_free_strains(elements, values, functions, now):
    """Set the strains without stress to those at the start and Σ c f(t)."""
    for n in range(len(elements.free_strain_rows)):
        store(values.stiffness, elements.free_strain_rows[n], load(values.at_start, n))
    for n in range(len(elements.free_strain_rows)):
        strain = load(values.free_strain_factors, n) * load(functions, now + elements.f[n])
        add_to(values.stiffness, elements.free_strain_rows[n], strain)


@compiled
def add_elastic_forces(structure, values, z, r):
    """Add the elastic and damping forces F(q, q̇) to `r`."""
    velocity = structure.state.velocity
    add_beam_forces(structure.beams, values.beams, z, velocity, r)
    add_continuum_forces(structure.continua, values.continua, z, velocity, r)
    add_cable_forces(structure.cables, values.cables, z, velocity, r)


@compiled
def add_elastic_tangent(structure, values, z, weight, rate, matrix, blocks):
    """Add weight × (∂F/∂q + rate ∂F/∂q̇) to `matrix`, without ∂F/∂q of the damping forces."""
    velocity = structure.state.velocity
    add_beam_tangent(structure.beams, values.beams, z, velocity, weight, rate, matrix, blocks)
    add_continuum_tangent(
        structure.continua, values.continua, z, velocity, weight, rate, matrix, blocks
    )
    add_cable_tangent(structure.cables, values.cables, z, velocity, weight, rate, matrix, blocks)


@compiled
def elastic_energy(structure, values, z):
    """Return the elastic energy of all flexible bodies [J]."""
    energy = beam_energy(structure.beams, values.beams, z)
    energy += continuum_energy(structure.continua, values.continua, z)
    return energy + cable_energy(structure.cables, values.cables, z)
