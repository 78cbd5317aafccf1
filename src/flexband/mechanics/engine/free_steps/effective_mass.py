"""Effective masses of contacts, on lanes: 1/(n W nᵀ), where n is the gradient of the gap.

W is the inverse of the mass matrix with joints, so that n W nᵀ is the acceleration of the gap by a
unit force along it. Friction holds nothing there: the force of a contact must not jump where its
surfaces begin to stick.
"""

from __future__ import annotations

from flexband.mechanics.engine.free_steps.control import CONTROL
from flexband.mechanics.engine.projection import mass_matrix, refine
from flexband.mechanics.kernels.angles import pass_on_moments
from flexband.mechanics.kernels.factorization import factorize, solve
from flexband.mechanics.kernels.friction.modes import MODE
from flexband.mechanics.kernels.lanes import clear, compiled, less, load, splat, store, where
from flexband.mechanics.kernels.laws.forces import add_unit_force, is_contact
from flexband.mechanics.kernels.laws.states import MARK
from flexband.mechanics.kernels.state import friction_rows, rows_of_gaps


@compiled
def factorize_frictionless(structure, values, now, work):
    """Factor [M, Φ_qᵀ; Φ_q, 0] with joints, and those that switch, but without friction."""
    z = work.z
    modes = work.t
    rows = friction_rows(structure.state)
    for k in range(rows.frictions):
        mode = load(z, rows.mode + k)
        store(modes, k, mode)
        store(z, rows.mode + k, mode if structure.friction.switched[k] else splat(MODE.inactive))
    mass_matrix(structure, values, values.regular_mass, now, z, work.matrix)
    factorize(structure.pattern, work.matrix, load(work.smallest, 0), work.r)
    for k in range(rows.frictions):
        store(z, rows.mode + k, load(modes, k))


@compiled
def update_masses(structure, values, now, work, mask):
    """Set the effective masses of contacts where `mask` is true; angles are up to date.

    Where joints hold both sides of a contact, so that it cannot move, its mass is
    `MARK.immovable`. Where an impact is over it is negative.
    """
    laws = structure.laws
    state = structure.state
    z = work.z
    r = work.r
    force = work.s
    mass = structure.mass
    first = rows_of_gaps(structure.state).mass
    factorized = False
    for s in range(len(laws.address)):
        if not is_contact(laws, s):
            continue
        if not factorized:
            factorize_frictionless(structure, values, now, work)
            factorized = True
        # Set the right-hand side to a unit force along the gap.
        clear(r, state.velocity)
        add_unit_force(structure, values, now, z, s, r, work.blocks)
        pass_on_moments(structure, values, z, r)
        for i in range(1, state.angle):
            if i > state.coordinates:
                store(r, i, splat(0.0))
            store(force, i, load(r, i))
        # Compare the mobility with that without joints.
        alone = splat(0.0)
        mobility = splat(0.0)
        for p in range(len(mass.i)):
            if mass.i[p] == mass.j[p]:
                part = load(force, mass.i[p])
                alone = alone + part * part / load(values.regular_mass, p)
        solve(structure.pattern, structure.pattern.below, work.matrix, (r,))
        refine(structure, values, work, r)
        for i in range(1, state.coordinates + 1):
            mobility = mobility + load(force, i) * load(r, i)
        moves = less(CONTROL.immovable * alone, mobility)
        effective = where(moves, 1.0 / where(moves, mobility, splat(1.0)), splat(MARK.immovable))
        # Keep the sign, which tells whether an impact is over.
        row = first + laws.gap_start[s]
        old_mass = load(z, row)
        effective = where(less(old_mass, splat(0.0)), -effective, effective)
        store(z, row, where(mask, effective, old_mass))
