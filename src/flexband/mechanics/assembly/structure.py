"""A system of equations as arrays: what all samples share, and the numbers of each sample."""

from __future__ import annotations

from itertools import accumulate, pairwise
from typing import NamedTuple

import numpy as np

from flexband.mechanics.kernels.elements.centre_line import ROWS
from flexband.mechanics.kernels.elements.continuum import HESSIAN_ROWS
from flexband.mechanics.kernels.elements.hermite import GAUSS_POINTS
from flexband.mechanics.kernels.forms import COEFFICIENTS
from flexband.mechanics.kernels.lane_arrays import zeros
from flexband.mechanics.kernels.pattern import Pattern
from flexband.mechanics.kernels.state import State

KEPT = 32
"""Times of a run at which the coordinates of flexible members are kept."""


class Mass(NamedTuple):
    """Entries (i, j), i ≤ j, of the mass matrix."""

    i: np.ndarray
    j: np.ndarray
    slot: np.ndarray
    massless: np.ndarray  # those that are zero in some sample, though on the diagonal


class Elements(NamedTuple):
    """Elements of all cables, or of all beams without an integration rule."""

    first: np.ndarray  # of the element's coordinates
    damped: np.ndarray  # whether its material is
    free_strain_rows: np.ndarray  # rows of the stiffness where free strains are that change in time
    f: np.ndarray  # functions of time of these strains
    slot: np.ndarray  # (elements, coordinates, coordinates)


class Continua(NamedTuple):
    """Continuum elements: those of all beams with an integration rule."""

    first: np.ndarray  # of the element's twelve coordinates
    damped: np.ndarray  # whether its material is
    initial: np.ndarray  # row of its first strain at the start, −1 for a straight one
    slot: np.ndarray  # (elements, 12, 12)


class Vectors(NamedTuple):
    """Vectors at most quadratic in q, with angles or lengths first, see `kernels.angles`.

    Those with angles or lengths are of constraints, springs, laws and moments.
    """

    start: np.ndarray  # vector -> first of its entries
    coordinate: np.ndarray  # of an entry
    partner: np.ndarray  # the other coordinate of a product, 0 for a linear entry
    partner_slot: np.ndarray  # of both
    spatial: int  # whether there is a third component
    length: np.ndarray  # whether the variable of a vector is its length instead of its angle
    direction: int  # first of the vectors along which following forces act
    sensor_angle: int  # first of those whose angles sensors alone read
    turning: np.ndarray  # body or rod -> first of those that turn with it, which are the last
    slot: np.ndarray  # (angles, most entries, most entries)
    multiplier_slot: np.ndarray  # (angles of constraints, most entries)


class Springs(NamedTuple):
    """Springs, translational ones first."""

    translational: int  # number of translational springs
    f: np.ndarray  # function of time that multiplies the pull
    table: np.ndarray  # first row of its table: places, rates, then coefficients
    places: np.ndarray  # how many it has, 0 without a table
    rates: np.ndarray  # the same
    vector: np.ndarray  # spring -> the vector that its elongation is the length of, or has in it
    angle_start: np.ndarray  # spring -> first of the angles in its elongation
    angle: np.ndarray
    slot: np.ndarray  # (springs, most entries, most entries)


class Laws(NamedTuple):
    """Force laws."""

    address: np.ndarray
    time: int  # the function of time that is t itself
    parameter_start: np.ndarray  # law -> first of its parameters
    f: np.ndarray  # function of time that multiplies a parameter
    point_start: np.ndarray  # law -> first of its points
    state_start: np.ndarray  # law -> first of its states
    gap_start: np.ndarray  # law -> first of its gaps
    gap_kind: np.ndarray  # gap -> what it is of, see `kernels.laws.forces`
    gap_law: np.ndarray  # gap -> its law, except for the margins of friction
    angle: int  # angle of the first point; those of the others follow
    position: int  # vector of the first point's position; those of the others follow
    coordinates: np.ndarray  # law -> number of coordinates that it depends on
    place: np.ndarray  # entry of a vector -> place of its coordinate among those of its law
    slot: np.ndarray  # (laws, most coordinates, most coordinates)
    memory: int  # rows of memory that the largest law needs


class ConstraintProducts(NamedTuple):
    """Products of the constraints: of two variables first, then with functions, c z_j, angles."""

    k: np.ndarray  # multiplier
    i: np.ndarray
    j: np.ndarray
    f: np.ndarray  # function of time
    slot: np.ndarray  # (terms, 3): of (k, i), (k, j), (i, j)
    products: int  # number of terms with i > 0
    steady: int  # first of the terms c z_j, without an angle or a function of time
    polynomials: int  # number of terms without an angle
    curved: np.ndarray  # coordinates that the Jacobian of the constraints depends on


class Products(NamedTuple):
    """Products c f(t) z_i z_j, each for a row of forces or of sensors."""

    row: np.ndarray
    i: np.ndarray
    j: np.ndarray
    f: np.ndarray


class Friction(NamedTuple):
    """What sticks or slides, see `kernels.friction.rows`."""

    terms: ConstraintProducts  # of the travels
    slot: np.ndarray  # places of their derivatives in the matrix
    of_slot: np.ndarray  # place -> friction
    diagonal: np.ndarray  # friction -> place of its pivot
    angular: np.ndarray  # friction -> whether its travel is an angle
    one_way: np.ndarray  # friction -> whether it is free one way, and holds any force the other
    switched: np.ndarray  # friction -> whether it is a row of a joint that switches
    follows: bool  # whether normal forces are reactions
    reacts: np.ndarray  # friction -> whether its own is
    normals: Products  # components of vectors whose lengths add up to normal forces, rows of z
    of_components: np.ndarray  # vector -> friction
    orbit_term: np.ndarray  # terms whose coefficient has the distance of two centres as a factor
    of_orbit: np.ndarray  # such a term -> friction
    is_orbit: np.ndarray  # term -> whether it is such a one
    circular: np.ndarray  # friction -> whether it has such terms
    centres: np.ndarray  # such a term -> vector between the centres
    rubbed: np.ndarray  # frictions of contacts
    contact_force: np.ndarray  # such a one -> row of z with the force of its contact
    gap: np.ndarray  # friction -> gap of its contact, or −1
    earlier: np.ndarray  # friction -> the last one before it of a body on the same line, or −1
    later: np.ndarray  # friction -> the first such one after it, or −1
    action: int  # first of three vectors of each of these, see `contact.geometry.geometry.Action`


class WatchedForms(NamedTuple):
    """Products of the forms whose extremes and integrals are wanted, and what of each."""

    row: np.ndarray
    i: np.ndarray
    j: np.ndarray
    f: np.ndarray
    kind: np.ndarray  # of each row, see `kernels.extremes`


class Structure(NamedTuple):
    """What all samples share: sizes, and which number goes where."""

    state: State
    functions: int  # of time, including the constant one
    reads_energy: bool  # whether a sensor reads the elastic energy
    reads_laws: bool  # whether a sensor reads the forces of laws
    mass: Mass
    beams: Elements
    continua: Continua
    cables: Elements
    vectors: Vectors
    springs: Springs
    laws: Laws
    terms: ConstraintProducts
    friction: Friction
    forces: Products  # rows as [1, q]
    sensors: Products
    extremes: WatchedForms
    pattern: Pattern


class ElementValues(NamedTuple):
    """Numbers of the elements of cables or beams."""

    inverse_length: np.ndarray
    stiffness: np.ndarray  # rows of an element: upper triangles, then its strains at the start
    retardation: np.ndarray  # of a Kelvin–Voigt solid, and of its bending [s]
    free_strain_factors: np.ndarray  # coefficients of free strains
    at_start: np.ndarray  # strains at the start in the same rows


class ContinuumValues(NamedTuple):
    """Numbers of the continuum elements."""

    inverse_length: np.ndarray
    stiffness: np.ndarray  # nine rows per Gauss point
    initial: np.ndarray  # strains at the start of curved elements, six rows per Gauss point
    retardation: np.ndarray  # of a Kelvin–Voigt solid [s]


class VectorValues(NamedTuple):
    """Coefficients of the vectors' coordinates."""

    x: np.ndarray
    y: np.ndarray
    z: np.ndarray  # without rows in the plane


class SpringValues(NamedTuple):
    """Numbers of the springs."""

    stiffness: np.ndarray
    rest: np.ndarray  # elongation, or `RELAXED` until the start is known
    cubic: np.ndarray
    damping: np.ndarray
    pull: np.ndarray
    table: np.ndarray
    weight: np.ndarray  # of the angles


class FrictionValues(NamedTuple):
    """Numbers of the frictions."""

    terms: np.ndarray  # coefficients of the travels; the engine writes those of orbits
    orbits: np.ndarray  # their coefficients without the distance of the centres
    normals: np.ndarray  # coefficients
    static: np.ndarray  # µs
    kinetic: np.ndarray  # µk
    rise: np.ndarray  # µs − µk while it slides
    viscous: np.ndarray  # c
    inverse_square: np.ndarray  # 1/v²
    radius: np.ndarray  # of the first circle in contacts, see `contact.geometry.geometry.Action`


class Values(NamedTuple):
    """The numbers of all samples, (rows, samples or 1), or of one block of lanes, (rows, WIDTH)."""

    start: np.ndarray  # guess of [1, q]
    drawn: np.ndarray  # angles θ near which those at the start are, see `Mechanism.drawn_angles`
    velocity: np.ndarray  # guess of [0, v]
    inverse_scale: np.ndarray  # of [1, q]: 1 over the size of the mechanism for positions, else 1
    rigidity: np.ndarray  # weight of K against M in the projections at the start [s²]
    weight: np.ndarray  # constant forces on [1, q]
    parts: np.ndarray  # what each round of the run does, see `schedule`
    numbers: np.ndarray  # which time each round belongs to
    moments: np.ndarray  # time of each round [s]
    functions: np.ndarray  # `Structure.functions` rows per round
    rates: np.ndarray  # f′ and f″ of the functions, 2 × `Structure.functions` rows per round
    polynomials: np.ndarray  # of the functions in each round, see `time_functions.polynomials`
    mass: np.ndarray
    regular_mass: np.ndarray  # as mass, without zeros: what matrices have where residuals have mass
    sharing_mass: np.ndarray  # as this, without light bodies: what redundant constraints share by
    metric: np.ndarray  # as regular_mass, with much larger inertia: bodies prefer not to turn
    beams: ElementValues
    continua: ContinuumValues
    cables: ElementValues
    vectors: VectorValues
    springs: SpringValues
    laws: np.ndarray  # parameters
    law_states: np.ndarray  # at the start, or `laws.states.MARK.steady`
    terms: np.ndarray  # coefficients
    friction: FrictionValues
    forces: np.ndarray  # coefficients
    sensors: np.ndarray  # coefficients
    extremes: np.ndarray  # coefficients
    windows: np.ndarray  # first and last time of each extreme [s]


class WorkSpace(NamedTuple):
    """Work space of one block, each array of shape (rows, WIDTH)."""

    z: np.ndarray  # the state, see `State`
    a: np.ndarray  # the integrator's acceleration-like variable, rows as [1, q]
    r: np.ndarray  # residual, then solution, rows as [1, q, λ, θ]
    s: np.ndarray  # as r, if two systems are solved at once
    matrix: np.ndarray
    blocks: np.ndarray  # second derivatives of an element's energy, or a law's memory
    t: np.ndarray  # as r, for `refine`
    rate: np.ndarray  # of convergence of Newton's method, one row
    smallest: np.ndarray  # pivot of a multiplier that is not left out, see `projection`, one row
    turn_statistics: np.ndarray  # of the angle φ of what turns in a step Σ φ⁴, Σ φ, its max, −min
    before: np.ndarray  # z and a before a step
    reached: np.ndarray  # number of the last step, one row
    unresolved: np.ndarray  # number of the first time without reliable reactions or 0, one row
    trial: np.ndarray  # failure of a free step that may be repeated, four rows
    steps: np.ndarray  # lengths of steps [s] and more, see `march.take_step`, four rows
    round: np.ndarray  # in which free steps are, see `march.enter`, five rows
    polynomials: np.ndarray  # of the functions of time in it
    counts: np.ndarray  # of free steps, and of a block's Newton iterations and matrices; and the
    # coordinate that the last step followed, 0 for the depth of a contact: four rows
    forms: np.ndarray  # those of extremes
    snapshots: np.ndarray  # [1, q] at `KEPT` times of a run, one after the other, see `straining`

    @staticmethod
    def from_structure(structure: Structure) -> WorkSpace:
        """Return work space for a mechanism, zeros."""
        state = structure.state
        pattern = structure.pattern
        turning = len(structure.vectors.turning) - 1
        blocks = max(ROWS, GAUSS_POINTS * HESSIAN_ROWS, structure.laws.memory)
        unknowns = state.velocity + 1  # the kernels read one row more, see `pattern.NONE`
        rows = (state.rows, 1 + state.coordinates, unknowns, unknowns, pattern.rows)
        rows += (blocks, unknowns, 1, 1, 4 * turning, sum(rows[:2]), 1, 1, 4, 4, 5)
        rows += (structure.functions * COEFFICIENTS, 4)
        rows += (len(structure.extremes.kind),)
        rows += (KEPT * rows[1],)
        starts = [0, *accumulate(rows)]
        memory = zeros(starts[-1])
        return WorkSpace(*(memory[start:end] for start, end in pairwise(starts)))
