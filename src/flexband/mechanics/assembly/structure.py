"""A system of equations as arrays: what is the same for all samples, and what a block has."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from flexband.mechanics.kernels.beams import HESSIAN_ROWS
from flexband.mechanics.kernels.factorization import Pattern
from flexband.mechanics.kernels.hermite import GAUSS_POINTS
from flexband.mechanics.kernels.lanes import zeros


class Mass(NamedTuple):
    """Entries (i, j), i ≤ j, of the mass matrix."""

    i: np.ndarray
    j: np.ndarray
    slot: np.ndarray


class Beams(NamedTuple):
    """Elements of all beams."""

    first: np.ndarray  # of the element's twelve coordinates
    damped: np.ndarray  # whether its material is
    initial: np.ndarray  # row of its first strain at the start, −1 for a straight one
    slot: np.ndarray  # (elements, 12, 12)


class Cables(NamedTuple):
    """Elements of all cables."""

    first: np.ndarray  # of the element's eight coordinates
    damped: np.ndarray  # whether its material is
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
    polynomials: int  # how many are no angle


class Angles(NamedTuple):
    """Angles of directions, the constraints' first, and the coordinates that each depends on."""

    first: int  # row of z where they start, and of the residual
    moment: int  # row of z where what acts on them starts
    start: np.ndarray  # angle -> first of its coordinates
    coordinate: np.ndarray
    slot: np.ndarray  # (angles, most coordinates, most coordinates)
    multiplier_slot: np.ndarray  # (angles of constraints, most coordinates)


class Laws(NamedTuple):
    """Force laws: where they are, and what each reads."""

    address: np.ndarray
    time: int  # the function of time that is t itself
    parameter_start: np.ndarray  # law -> first of its parameters
    f: np.ndarray  # function of time that multiplies a parameter
    rest: np.ndarray  # parameter that is an angle at rest, −1 where there is none
    point_start: np.ndarray  # law -> first of its points
    angle: np.ndarray  # of a point
    entry_start: np.ndarray  # law -> first of its points' coefficients
    coordinate_start: np.ndarray  # law -> first of its coordinates
    coordinate: np.ndarray
    place: np.ndarray  # of the angles' coordinates among the law's
    slot: np.ndarray  # (laws, most coordinates, most coordinates)
    memory: int  # rows that the largest needs


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
    energy: int  # row of z for the elastic energy, 0 where no sensor asks for it
    functions: int  # of time, the constant one included
    mass: Mass
    beams: Beams
    cables: Cables
    springs: Springs
    terms: Terms
    angles: Angles
    laws: Laws
    forces: Products  # rows as [1, q]
    sensors: Products
    pattern: Pattern


class BeamValues(NamedTuple):
    """Numbers of the elements."""

    inverse_length: np.ndarray
    stiffness: np.ndarray  # nine rows a Gauss point
    initial: np.ndarray  # strains at the start of what is curved, six rows a Gauss point
    retardation: np.ndarray  # of Kelvin and Voigt's solid [s]


class CableValues(NamedTuple):
    """Numbers of the cables' elements."""

    inverse_length: np.ndarray
    stiffness: np.ndarray  # four rows a Gauss point
    retardation: np.ndarray  # of Kelvin and Voigt's solid [s]


class SpringValues(NamedTuple):
    """Numbers of the springs; x and y are coefficients of their coordinates."""

    x: np.ndarray
    y: np.ndarray
    stiffness: np.ndarray
    rest_length: np.ndarray  # negative: relaxed at the start
    cubic: np.ndarray
    damping: np.ndarray
    pull: np.ndarray


class AngleValues(NamedTuple):
    """Coefficients of the directions' coordinates."""

    x: np.ndarray
    y: np.ndarray


class LawValues(NamedTuple):
    """Numbers of the force laws; x and y are coefficients of their points' coordinates."""

    x: np.ndarray
    y: np.ndarray
    parameter: np.ndarray


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
    angles: AngleValues
    laws: LawValues


class Work(NamedTuple):
    """Work space of one block, each array of shape (rows, WIDTH)."""

    z: np.ndarray
    a: np.ndarray  # the integrator's acceleration-like variable, rows as [1, q]
    r: np.ndarray  # residual, then solution, rows as [1, q, λ]
    matrix: np.ndarray
    inverse_pivots: np.ndarray
    row: np.ndarray  # of the factor, while it is made
    blocks: np.ndarray  # second derivatives at an element's Gauss points, or a law's memory
    rate: np.ndarray  # of Newton's convergence, one row

    @staticmethod
    def of(structure: Structure) -> Work:
        """Return work space for a mechanism, zeros."""
        pattern, q = structure.pattern, structure.coordinates + 1
        angles = len(structure.angles.start) - 1
        residual = pattern.unknowns + 1 + angles
        rows = (residual + 2 * q + 1 + angles, q, residual, pattern.rows)
        rows += (4 * pattern.tiles, 4 * pattern.longest_row)
        rows += (max(GAUSS_POINTS * HESSIAN_ROWS, structure.laws.memory), 1)
        return Work(*(zeros(count) for count in rows))
