"""Flexible beams of planar shear-deformable ANCF elements with the coordinates of Eq. (22).

A node has the coordinates r, r_x and r_y, and r₀ is the Hermite cubic through the nodes' r and r_x.

- The default element is Reissner's beam. The angle γ between r_y and the normal of the axis is
  linear between the nodes, and the section has the angle of the axis less γ. Its strains are taken
  at a few points, see `kernels.elements.beams`, so that it does not lock, however thin it is.
- The continuum element of Omar and Shabana (2001) is linear across the axis:
  r(x, y) = r₀(x) + y d(x), where d is linear between the nodes' r_y. The section enters through its
  moments ∫dA, ∫y²dA and ∫y⁴dA, which makes integrals across it exact. Integrals along the axis use
  `GAUSS_POINTS` points, which is exact for uniform properties.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_finite, check_poissons_ratio, check_positive
from flexband.errors import InputError
from flexband.mechanics.bodies.assumed_strains import (
    ENDS,
    axial_strain,
    bent,
    curvature_shapes,
    interpolate,
    interpolation,
    line_stiffness,
    load_curvature,
    slope,
    stiffness,
)
from flexband.mechanics.bodies.body import MassEntries, add_pairs, check_implements
from flexband.mechanics.bodies.centre_line import CentreLine, ElementState
from flexband.mechanics.bodies.plausible import (
    plausible_length,
    plausible_material,
    plausible_thickness,
)
from flexband.mechanics.bodies.properties import Along, Property
from flexband.mechanics.bodies.section_stiffness import (
    Elasticity,
    SectionIntegration,
    SectionStiffness,
)
from flexband.mechanics.bodies.sections import Rectangle, Section, curved_second_moment
from flexband.mechanics.kernels.elements.continuum_strains import gradient, resultants, strains
from flexband.mechanics.kernels.elements.hermite import POSITIONS, hermite_slope
from flexband.mechanics.kernels.forms import Form, PlanarFrame, Vector, add, scale, subtract

DIRECTION = ((1, 3, 7, 9, 4, 10), -1), ((0, 2, 6, 8, 5, 11), 1)
"""Coordinates of an element that the components of d follow from, and the sign of the first four.

They are those of r and r_x turned by 90°, and of r_y.
"""


@frozen(kw_only=True)
class Beam(CentreLine):
    """A flexible beam with shear deformation, straight or curved, Eq. (22).

    Every number may be an array of shape (n,), one value per sample. Material, section and
    curvature may also be functions of the position along the axis, from 0 to `length`. `Beam.along`
    builds a beam along a given path. `start`, `angle`, `velocity` and `rate` describe the beam at
    the start, free of stress, and are guesses: assembly corrects them until the joints are
    satisfied.

    Points are named "start", "end", "middle" (or "center"), "node 0", "node 1", …, or by the
    fraction of the length from the start, "0.25".

    Parameters
    ----------
    length : along the axis [m].
    height, width : of a rectangular section, across the axis in the plane and out of the plane [m].
    section : another section instead of `height` and `width`: `Circle` or `GeneralSection`.
    density : ρ [kg/m³].
    youngs_modulus : E [Pa].
    poissons_ratio : ν, in (−1, 0.5). The material of a continuum element is in plane stress.
    elements : number of elements. If it is left out, 4 are used, with a warning, or
        `AdaptivePCCI` chooses it (see `dynamic_response`). They are equally long, unless joints or
        loads act between the ends: then they are shared among the parts between these points.
    retardation_time : τ [s] of a Kelvin–Voigt solid, whose stresses are those of the strains
        E + τ Ė. A vibration of angular frequency ω has the damping ratio τω/2.
    bending_retardation_time : τ [s] of bending alone, or None for the same one. A beam with an
        `integration` has none.
    start : position of the start [m].
    angle : from the X axis to the beam's axis at the start [rad].
    curvature : κ₀ of the undeformed axis [1/m], positive to the left, less than 2/height. Terms of
        the order of height times κ₀ are neglected in the stiffness, but not in `Stress`.
    velocity, rate : velocity of the start [m/s] and rate of the angle [rad/s], as of a rigid bar.
    shear_factor : shear correction factor k, or None for that of the section.
    rotary_inertia : of the section [kg m], or None for density times second moment of area. Of a
        beam with an `integration` it is at most 10 times that: its sections are as soft as their
        material, and grow as it turns.
    integration : None for the default element, which is Reissner's beam of any slenderness; or
        `SelectiveIntegration` or `FullIntegration` for the continuum element of Omar and Shabana,
        which needs many elements if it is thin.

    Raises
    ------
    InputError
        If a number is out of its range. Functions of the position, and the rotary inertia of a beam
        with an `integration`, are checked when the mechanism is assembled.

    Examples
    --------
    >>> steel = {"density": 7800.0, "youngs_modulus": 2e11, "poissons_ratio": 0.3}
    >>> cantilever = fb.Mechanism(
    ...     bodies={"beam": fb.Beam(length=1.0, height=0.01, width=0.01, elements=2, **steel)},
    ...     joints={"clamp": fb.Weld("beam.start", (0.0, 0.0))},
    ...     loads={"force": fb.Force("beam.end", y=-1.0)},
    ...     sensors={"end": fb.Position("beam.end")},
    ... )
    >>> float(fb.equilibrium(cantilever).sel(output="end_Y").round(6))  # −Fl³/(3EI) [m]
    -0.002
    """

    height: Property | None = None
    width: Property | None = None
    section: Section | None = None
    density: Property
    youngs_modulus: Property
    poissons_ratio: Property
    shear_factor: Property | None = None
    rotary_inertia: Property | None = None
    integration: SectionIntegration | None = None

    per_node: ClassVar[int] = 6
    """Those of r, r_x and r_y."""

    def __post_init__(self) -> None:
        super().__post_init__()
        profile = self.profile  # refuses a beam without a section
        shape_values = self.curvature, *vars(profile).values()
        if not any(callable(value) or np.ndim(value) for value in shape_values):
            _check_arc(
                np.asarray(self.curvature), profile.across(lambda _, value, __: np.asarray(value))
            )
        if self.integration is None:
            return
        requirement = "None, sections.SelectiveIntegration() or sections.FullIntegration()"
        check_implements("Beam integration", self.integration, SectionIntegration, requirement)
        if self.bending_retardation_time is not None:
            raise InputError(
                "Beam bending_retardation_time must be None if there is an integration"
            )
        if self.shear_factor is not None:
            raise InputError(
                "Beam shear_factor must be None if there is an integration; "
                "use sections.SelectiveIntegration(shear_factor=...)"
            )

    @property
    def profile(self) -> Section:
        """The section, a `Rectangle` if the beam has a height and a width."""
        if self.section is None and self.height is not None and self.width is not None:
            return Rectangle(self.height, self.width)
        if self.section is None or self.height is not None or self.width is not None:
            raise InputError("a Beam must have either height and width or a section")
        requirement = "a Circle, a Rectangle or a GeneralSection"
        check_implements("Beam section", self.section, Section, requirement)
        return self.section

    def properties(self) -> Sequence[tuple[str, Property, Callable]]:
        properties = [
            ("Beam density [kg/m³]", self.density, check_positive),
            ("Beam youngs_modulus [Pa]", self.youngs_modulus, check_positive),
            ("Beam poissons_ratio", self.poissons_ratio, check_poissons_ratio),
        ]
        if self.shear_factor is not None:
            properties.append(("Beam shear_factor", self.shear_factor, check_positive))
        if self.rotary_inertia is not None:
            properties.append(("Beam rotary_inertia [kg m]", self.rotary_inertia, check_positive))
        return properties

    @property
    def counts(self) -> tuple[int, int]:
        return (9, 3) if self.integration is None else (12, 9)

    @property
    def element_table(self) -> str:
        return "beams" if self.integration is None else "continua"

    def section_jumps(self, before: PlanarFrame, after: PlanarFrame) -> Sequence[Form]:
        """Return the difference of r_y; r_x jumps with the axial and the shear force."""
        return subtract(before.y, after.y)

    def node_frame(self, first: int) -> PlanarFrame:
        return PlanarFrame.of_node(first)

    def section_direction(self, xi: float, a: PlanarFrame, b: PlanarFrame, slope: Vector) -> Vector:
        linear = add(scale(1 - xi, a.y), scale(xi, b.y))
        if self.integration is not None:
            return linear
        normal = add(scale(1 - xi, _rotate(a.x)), scale(xi, _rotate(b.x)))
        return add(_rotate(slope), subtract(linear, normal))

    def section_stiffness(self, along: Along) -> Sequence[np.ndarray]:
        """Return `SectionStiffness` or, of the default element, EA [N], EI [N m²] and kGA [N]."""
        (E, nu, k), moments = self.elasticity(along), self.profile.moments(along)
        plausible_material(along(*self.properties()[0]), E)
        across = self.profile.across(along)
        plausible_thickness("the section of a beam is about {} high", across)
        plausible_length("a beam", np.asarray(self.length), across)
        _check_arc(along("Beam curvature [1/m]", self.curvature, check_finite), across)
        if self.integration is not None:
            self._check_rotary_inertia(along)
            return self.integration.stiffness(Elasticity(E, nu, k), moments)
        return E * moments[0], E * moments[1], k * E / (2 * (1 + nu)) * moments[0]

    def across(self, along: Along) -> np.ndarray:
        return self.profile.across(along)

    def fibre(self, y: ArrayLike, along: Along) -> Sequence[ArrayLike]:
        """Return y, E, ν, k, and a and b in ε(y) = N/EA + (a − y b)(κ − κ₀).

        Winkler's theory: fibres inside an arc are shorter than its axis by the factor 1 − κ₀y, so
        σ = (N + κ₀M)/A − M y/(Z (1 − κ₀y)), where Z = ∫y²/(1 − κ₀y) dA.
        """
        curvature = along("Beam curvature [1/m]", self.curvature, check_finite)
        area, second, _ = self.profile.moments(along)
        ratio = curved_second_moment(self.profile, curvature, along)
        a = curvature * second / area
        b = 1 / (ratio * (1 - curvature * np.asarray(y)))
        return [y, *self.elasticity(along), a, b]

    def elasticity(self, along: Along) -> Elasticity:
        """Return E [Pa], ν and k at the positions of `along`."""
        E, nu = (along(*arguments) for arguments in self.properties()[1:3])
        if self.shear_factor is None:
            return Elasticity(E, nu, self.profile.shear_factor(nu, along))
        return Elasticity(E, nu, along("Beam shear_factor", self.shear_factor, check_positive))

    def element_stiffness(self) -> list[np.ndarray]:
        """Return the stiffness by the strains of an element [J], see `kernels.elements.beams`."""
        EA, EI, kGA = self.stiffness()
        ends = interpolation(ENDS, POSITIONS)
        stiff = self._thickness_factor * EA
        thickness = [np.sum(stiff * share, axis=-1) for share in ends]
        line = line_stiffness(EA, EI, self.element_lengths, stiff - EA)
        return line + stiffness(ends, kGA) + thickness

    def _rotary(self, along: Along) -> np.ndarray:
        """Return the rotary inertia [kg m] at the positions of `along`."""
        if self.rotary_inertia is None:
            return self._section_inertia(along)
        return along("Beam rotary_inertia [kg m]", self.rotary_inertia, check_positive)

    def _section_inertia(self, along: Along) -> np.ndarray:
        """Return the rotary inertia ρI [kg m] of the section at the positions of `along`."""
        return along(*self.properties()[0]) * self.profile.moments(along)[1]

    def _check_rotary_inertia(self, along: Along) -> None:
        """Raise `InputError` if the inertia would make sections of a continuum grow.

        Up to this factor the direction of the section grows less than the axis stretches in a free
        beam that spins, if it is nine times as long as its radius of gyration.
        """
        factor = 10.0
        inertia, limit = np.broadcast_arrays(
            self._rotary(along), factor * self._section_inertia(along)
        )
        if np.any(inertia > limit):
            worst = np.unravel_index(np.argmax(inertia / limit), limit.shape)
            raise InputError(
                f"Beam rotary_inertia [kg m] must be at most {limit[worst]:.3g}, "
                f"{factor:g} times that of the section, if there is an integration; "
                f"got {inertia[worst]:.3g}. Leave integration out to give more"
            )

    @property
    def _thickness_factor(self) -> np.ndarray | float:
        """Factor of EA in the stiffness that holds |d| = 1, at the Gauss points.

        As the beam turns, the rotary inertia pulls at the direction d of the section: at r_y, and
        at r_x, whose stretch at the nodes against that of the chord makes d longer between them.
        More than the inertia of the section is held by as much more.
        """
        if self.rotary_inertia is None:
            return 1.0
        along = self.at_gauss_points
        return np.maximum(1.0, self._rotary(along) / self._section_inertia(along))

    def element_strains(self, q: np.ndarray, length: np.ndarray) -> np.ndarray:
        """Return the nine strains of the default element, or the coordinates of a continuum's."""
        if self.integration is not None:
            return q
        nodes = q.reshape(6, 2, *q.shape[1:])
        axis = nodes[[0, 1, 3, 4]]
        sections = nodes[[2, 5]]
        axial = []
        shear = []
        angles = []
        for g, d in zip(axis[[1, 3]], sections, strict=True):
            e = d / np.hypot(*d)
            axial.append(g[0] * e[1] - g[1] * e[0] - 1)
            shear.append(g[0] * e[0] + g[1] * e[1])
            angles.append(np.arctan2(e[1], e[0]))
        gamma = np.arctan2(shear, np.add(axial, 1))
        middle = np.hypot(*slope(axis, 0.5, length)) * np.cos(0.5 * (gamma[0] + gamma[1])) - 1
        bend_strains = bent(angles[1] - angles[0], axis, length)
        thickness = [0.5 * (d[0] ** 2 + d[1] ** 2 - 1) for d in sections]
        return np.stack([axial[0], middle, axial[1], *bend_strains, *shear, *thickness])

    def initial_strains(self, points: np.ndarray) -> list[np.ndarray]:
        """Return the strains of a continuum at these ξ at the start, (elements, points, n or 1)."""
        q = self.at_start
        length = self.element_lengths.T
        at_points = [strains.py_func(self.vectors(q, xi, length)) for xi in points]
        return [np.stack(column, axis=1) for column in zip(*at_points, strict=True)]

    def strains(self, state: ElementState) -> Sequence[np.ndarray]:
        """Return the strains: six of a continuum, or N/EA, κ − κ₀ [1/m], Q and b."""
        if self.integration is not None:
            return self._continuum_strains(state)
        q, xi, length, initial, (EA, _, kGA), inertia = state
        now = self.element_strains(q, length)
        change = now - initial
        axial = change[:3]
        bend_strains = change[3:5]
        shear = kGA / EA * change[5:7]
        thickness = change[7:]
        pulls = shear * np.arctan2(now[5:7], 1 + now[[0, 2]])  # Qγ/EA
        pull = 5 * (pulls[1] - pulls[0])
        nodes = q.reshape(6, 2, *q.shape[1:])
        load_term = load_curvature(inertia, nodes[3] - nodes[0], now[3]) * length / EA
        return (
            axial_strain(xi, axial, now[3:5], 0.5 * (shear[0] + shear[1]), pull, load_term),
            np.tensordot(curvature_shapes(xi), bend_strains, 1) / length,
            interpolate(ENDS, change[5:7], xi),
            interpolate(ENDS, thickness, xi),
        )

    def _continuum_strains(self, state: ElementState) -> list[np.ndarray]:
        """Return the strains of a continuum at ξ.

        The bending strain a₁ is constant in an element, and accurate in the middle. From there it
        is extrapolated with the shear force, dM/ds = −Q: a₁′ = Q/c₁₁.
        """
        q, xi, length, initial, section, _ = state
        c = SectionStiffness(*section)

        def changes(place: float) -> list[np.ndarray]:
            now, start = (strains.py_func(self.vectors(z, place, length)) for z in (q, initial))
            return [a - b for a, b in zip(now, start, strict=True)]

        strain = changes(xi)
        middle = changes(0.5)
        strain[1] = middle[1] + c.s0 * middle[4] / c.c11 * (xi - 0.5) * length
        return strain

    def section_forces(self, state: ElementState) -> Sequence[np.ndarray]:
        strain = self.strains(state)
        section = state.section
        if self.integration is None:
            EA, EI, kGA = section
            return EA * strain[0], kGA * strain[2], EI * strain[1]
        p, w, d = self.vectors(state.q, state.xi, state.length)
        force, couple, _ = gradient.py_func(resultants.py_func(section, strain), (p, w, d))
        size = np.hypot(*d)
        normal = (force[0] * d[1] - force[1] * d[0]) / size
        across = (force[0] * d[0] + force[1] * d[1]) / size
        return normal, across, d[0] * couple[1] - d[1] * couple[0]

    def fibre_strains(self, state: ElementState, fibre: np.ndarray) -> Sequence[np.ndarray]:
        strain, (y, _, nu, _, a, b) = self.strains(state), fibre
        if self.integration is None:
            axial, bending, shear, thickness = strain
            along = axial + (a - y * b) * bending
            return along, thickness - nu * along, shear
        a0, a1, a2, across, g0, g1 = strain
        return a0 + y * a1 + y**2 * a2, across, g0 + y * g1

    def fibre_stresses(self, state: ElementState, fibre: np.ndarray) -> Sequence[np.ndarray]:
        strain, (y, E, nu, k, a, b) = self.strains(state), fibre
        if self.integration is not None:
            return self.integration.stress(Elasticity(E, nu, k), strain, y)
        axial, bending, shear, thickness = strain
        along = E * (axial + (a - y * b) * bending)
        return along, E * thickness, k * E / (2 * (1 + nu)) * shear

    def line_mass(self, along: Along) -> np.ndarray:
        return self.profile.moments(along)[0] * along(*self.properties()[0])

    def vectors(
        self, q: np.ndarray, xi: float, length: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return p = r₀′, w = d′ [1/m] and d at ξ, each of shape (2, …)."""
        nodes = q.reshape(6, 2, *q.shape[1:])
        p = slope(nodes[[0, 1, 3, 4]], xi, length)
        di = nodes[2]
        dj = nodes[5]
        return p, (dj - di) / length, (1 - xi) * di + xi * dj

    def mass_entries(self) -> MassEntries:  # ∫ρ ṙ·ṙ dA ds with r = r₀ + y d
        area = self.profile.moments(self.at_gauss_points)[0]
        density = self.properties()[0]
        entries = self.axis_mass(self.at_gauss_points(*density) * area)
        rotary = self._rotary(self.at_gauss_points)
        across = np.stack([1 - POSITIONS, POSITIONS])
        if self.integration is not None:
            blocks = np.einsum("neg,ig,jg->nije", rotary * self.weights, across, across)
            for e, first in enumerate(self.element_rows):
                add_pairs(entries, [first + 4, first + 10], blocks[..., e])
            return entries
        shapes = self.direction_shapes
        blocks = np.einsum("neg,nieg,njeg->nije", rotary * self.weights, shapes, shapes)
        for places, sign in DIRECTION:
            for a, i in enumerate(places):
                for b, j in enumerate(places):
                    if i <= j:
                        factor = sign if (a < 4) != (b < 4) else 1
                        for e, first in enumerate(self.element_rows):
                            key = first + i, first + j
                            entries[key] = entries.get(key, 0.0) + factor * blocks[:, a, b, e]
        return entries

    @property
    def rotary_weights(self) -> np.ndarray:
        """Rotary inertia times the weights of the Gauss points [kg m²], (n or 1, elements, …)."""
        return self._rotary(self.at_gauss_points) * self.weights

    @property
    def direction_shapes(self) -> np.ndarray:
        """Factors of `DIRECTION` at the Gauss points, up to sign, (n or 1, 6, elements, points)."""
        il = 1 / self.element_lengths[..., None]
        _, hi, h, hj = hermite_slope(POSITIONS)
        ends = 1 - POSITIONS, POSITIONS
        axis = [-h * il, hi - ends[0] + 0 * il, h * il, hj - ends[1] + 0 * il]
        return np.stack([*axis, ends[0] + 0 * il, ends[1] + 0 * il], axis=1)


def _check_arc(curvature: np.ndarray, height: np.ndarray) -> None:
    """Raise `InputError` if the inside of an arc lies beyond its centre."""
    ratio = np.abs(curvature) * height / 2
    if np.any(ratio >= 1):
        worst = np.argmax(ratio)
        limit = float(np.ravel(2 / np.broadcast_to(height, ratio.shape))[worst])
        value = float(np.ravel(np.broadcast_to(curvature, ratio.shape))[worst])
        raise InputError(
            f"Beam curvature [1/m] must be between -2/height and 2/height, {-limit:g} and "
            f"{limit:g}, so that the inside of the arc does not reach its centre; got {value:g}"
        )


def _rotate(a: Vector) -> Vector:
    """Return a vector rotated by 90°."""
    return -a[1], a[0]
