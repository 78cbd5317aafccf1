"""Thin flexible bodies of gradient-deficient ANCF elements, after Gerstmayr and Irschik (2008).

A node has the coordinates r and r_x only. The section stays normal to the axis, without shear
deformation and without rotary inertia. With p = r′ and w = r″ the energy per length is
½ EA (|p| − 1)² + ½ EI (κ − κ₀)², where κ = p × w / p·p is the curvature. The axial strain is the
parabola through its values at both ends and in the middle of an element. The curvature is linear:
its mean is that of the angle between the ends, its slope that between two Gauss points. So the
element does not lock, however thin it is, and bends to a circle without error.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import ClassVar

import numpy as np

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_positive
from flexband.mechanics.bodies.assumed_strains import (
    AXIAL,
    axial_strain,
    bent,
    curvature_shapes,
    line_stiffness,
    load_curvature,
    slope,
)
from flexband.mechanics.bodies.body import MassEntries
from flexband.mechanics.bodies.centre_line import CentreLine, ElementState
from flexband.mechanics.bodies.properties import Along, Property
from flexband.mechanics.kernels.forms import Form, PlanarFrame, Vector, cross


@frozen(kw_only=True)
class Cable(CentreLine):
    """A thin flexible body without shear deformation, straight or curved.

    The element is the one of Gerstmayr and Irschik (2008), with strains at fewer points so that it
    does not lock. A run fails if an element folds: it must not bend by more than half a turn. Every
    number may be an array of shape (n,), one value per sample. Mass, stiffness and curvature may
    also be functions of the position along the axis, from 0 to `length`. `Cable.along` builds a
    cable along a given path. `start`, `angle`, `velocity` and `rate` describe the cable at the
    start, free of stress, and are guesses: assembly corrects them until the joints are satisfied.
    Points are named as those of a `Beam`.

    Parameters
    ----------
    length : along the axis [m].
    mass_per_length : kg/m.
    axial_stiffness : EA [N].
    bending_stiffness : EI [N m²].
    elements : number of elements. If it is left out, 4 are used, with a warning, or
        `AdaptivePCCI` chooses it (see `dynamic_response`). They are equally long, unless joints or
        loads act between the ends: then they are shared among the parts between these points.
    retardation_time : τ [s] of a Kelvin–Voigt solid, whose section forces are those of the
        strains ε + τ ε̇ and κ + τ κ̇. A vibration of angular frequency ω has the damping ratio τω/2.
    bending_retardation_time : τ [s] of bending alone, or None for the same one.
    start : position of the start [m].
    angle : from the X axis to the cable's axis at the start [rad].
    curvature : κ₀ of the undeformed axis [1/m], positive to the left.
    velocity, rate : velocity of the start [m/s] and rate of the angle [rad/s], as of a rigid bar.

    Raises
    ------
    InputError
        If a number is out of its range. Functions of the position are checked when the mechanism
        is assembled.

    Examples
    --------
    >>> strip = fb.Cable(
    ...     length=1.0, mass_per_length=0.1, axial_stiffness=1e5, bending_stiffness=2.0, elements=4
    ... )
    >>> bent = fb.Mechanism(
    ...     bodies={"strip": strip},
    ...     joints={"clamp": fb.Weld("strip.start", (0.0, 0.0))},
    ...     loads={"moment": fb.Moment("strip.end", 2.0)},
    ...     sensors={"end": fb.Angle("strip.end")},
    ... )
    >>> fb.equilibrium(bent, steps=4).values.round(3)  # Ml/(EI) [rad]
    array([1.])
    """

    mass_per_length: Property
    axial_stiffness: Property
    bending_stiffness: Property

    per_node: ClassVar[int] = 4
    """Those of r and r_x."""

    @property
    def element_table(self) -> str:
        return "cables"

    @property
    def counts(self) -> tuple[int, int]:
        return 5, 2

    def properties(self) -> Sequence[tuple[str, Property, Callable]]:
        return (
            ("Cable mass_per_length [kg/m]", self.mass_per_length, check_positive),
            ("Cable axial_stiffness [N]", self.axial_stiffness, check_positive),
            ("Cable bending_stiffness [N m²]", self.bending_stiffness, check_positive),
        )

    def section_jumps(self, before: PlanarFrame, after: PlanarFrame) -> Sequence[Form]:
        """Return the sine of the angle; the length of r_x jumps by that of the axial force."""
        return [cross(before.x, after.x)]

    def node_frame(self, first: int) -> PlanarFrame:
        return PlanarFrame.of_slope_node(first)

    def section_direction(self, xi: float, a: PlanarFrame, b: PlanarFrame, slope: Vector) -> Vector:
        return -slope[1], slope[0]

    def section_stiffness(self, along: Along) -> Sequence[np.ndarray]:  # EA [N] and EI [N m²]
        return [along(*stiffness) for stiffness in self.properties()[1:]]

    def line_mass(self, along: Along) -> np.ndarray:
        return along(*self.properties()[0])

    def mass_entries(self) -> MassEntries:  # of the axis
        return self.axis_mass(self.at_gauss_points(*self.properties()[0]))

    def element_stiffness(self) -> list[np.ndarray]:
        """Return the stiffness by the strains of an element [J], see `kernels.elements.cables`."""
        EA, EI = self.stiffness()
        return line_stiffness(EA, EI, self.element_lengths)

    def element_strains(self, q: np.ndarray, length: np.ndarray) -> np.ndarray:
        ends = q.reshape(4, 2, *q.shape[1:])
        axial = [np.hypot(*slope(ends, xi, length)) - 1 for xi in AXIAL]
        angle = np.arctan2(ends[3, 1], ends[3, 0]) - np.arctan2(ends[1, 1], ends[1, 0])
        return np.stack(axial + bent(angle, ends, length))

    def strains(self, state: ElementState) -> Sequence[np.ndarray]:
        """Return ε, κ − κ₀ [1/m] and its derivative by length [1/m²]."""
        q, xi, length, initial, (EA, EI), inertia = state
        now = self.element_strains(q, length)
        change = now - initial
        by_length = np.sqrt(3) * change[4] / length**2
        ends = q.reshape(4, 2, *q.shape[1:])
        load_term = load_curvature(inertia, ends[2] - ends[0], now[3]) * length / EA
        axial = axial_strain(xi, change[:3], now[3:], -EI / EA * by_length, 0.0, load_term)
        return axial, np.tensordot(curvature_shapes(xi), change[3:], 1) / length, by_length

    def section_forces(self, state: ElementState) -> Sequence[np.ndarray]:
        (axial, bending, by_length), (EA, EI) = self.strains(state), state.section
        return EA * axial, -EI * by_length, EI * bending

    def fibre_strains(self, state: ElementState, fibre: np.ndarray) -> Sequence[np.ndarray]:
        axial, bending, _ = self.strains(state)
        along = axial - fibre[0] * bending
        return along, 0.0 * along, 0.0 * along
