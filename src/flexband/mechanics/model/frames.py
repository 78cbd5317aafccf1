"""The coordinates of the bodies: their rows of the state z, points and axes, and masses."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.words import value_text
from flexband.errors import InputError
from flexband.mechanics.bodies.body import Body
from flexband.mechanics.bodies.body import point as ground_point
from flexband.mechanics.bodies.centre_line import CentreLine
from flexband.mechanics.bodies.properties import Property
from flexband.mechanics.joints.joint import PointName, body_and_point
from flexband.mechanics.kernels.forms import Form, Frame, GeneralizedForce, Vector
from flexband.mechanics.model.parts import name_errors
from flexband.mechanics.model.turns import drawn_angle


class Frames:
    """The bodies of a mechanism as consecutive rows of z, and the frames of their points."""

    def __init__(self, bodies: Mapping[str, Body], branches: Mapping[str, ArrayLike]):
        self.bodies = bodies
        self.branches = branches

    @cached_property
    def first_coordinates(self) -> dict[str, int]:
        """The row of z where the coordinates of each body start."""
        first = 1
        rows = {}
        for name, body in self.bodies.items():
            rows[name] = first
            first += body.size
        return rows

    @property
    def dimension(self) -> int:
        """Number of components of all vectors."""
        return next(iter(self.bodies.values())).dimension

    @cached_property
    def node_vectors(self) -> dict[str, np.ndarray]:
        """The rows of z of the vectors of each body, see `Body.node_vectors`."""
        first = self.first_coordinates
        return {name: first[name] + body.node_vectors for name, body in self.bodies.items()}

    @cached_property
    def places(self) -> np.ndarray:
        """The rows of z of the positions of all nodes, shape (nodes, components)."""
        return np.concatenate([vectors[:, 0] for vectors in self.node_vectors.values()])

    @cached_property
    def axes(self) -> dict[str, np.ndarray]:
        """The rows of z of the axes that tell how bodies turn, see `Body.axes`."""
        first = self.first_coordinates
        return {name: first[name] + body.axes for name, body in self.bodies.items()}

    @cached_property
    def members(self) -> dict[str, CentreLine]:
        """The beams and cables."""
        bodies = self.bodies.items()
        return {name: body for name, body in bodies if isinstance(body, CentreLine)}

    def frame(self, point: PointName) -> Frame:
        """Return the frame of a point."""
        if not isinstance(point, str):
            if callable(point) or (isinstance(point, list | tuple) and any(map(callable, point))):
                raise InputError(
                    "a point must be 'body.point' or a pair of ground coordinates; got a function. "
                    "A point that moves is one of a body with a PrescribedPath; a load that moves "
                    "along a member is shared by Forces at its nodes, which are functions of time"
                )
            return Frame.ground(ground_point("ground point", point, self.dimension))
        if point not in self._frames:
            body, name = body_and_point(point)
            within("body", body, self.bodies)
            self._frames[point] = self.bodies[body].frame(name, self.first_coordinates[body])
        return self._frames[point]

    @cached_property
    def _frames(self) -> dict[str, Frame]:
        """The frames that were asked for, by point."""
        return {}

    def member(self, name: str) -> tuple[CentreLine, int]:
        """Return a beam or cable, and the row of z where its coordinates start."""
        within("beam", name, self.members)
        return self.members[name], self.first_coordinates[name]

    @cached_property
    def initial_guess(self) -> list[np.ndarray]:
        """The initial guess of [1, q], from the bodies."""
        coordinates = [
            name_errors(f"body {name!r}", body.coordinates) for name, body in self.bodies.items()
        ]
        return [np.ones(()), *itertools.chain.from_iterable(coordinates)]

    def drawn(self, vector: Vector) -> ArrayLike:
        """Return the angle [rad] near which that of a linear vector is at the start."""
        return drawn_angle(vector, self.bodies, self.first_coordinates, self.branches)

    @cached_property
    def mass(self) -> dict[tuple[int, int], np.ndarray]:
        """The entries (i, j), i ≤ j, of the mass matrix, counted as in z."""
        return {
            (self.first_coordinates[name] + i, self.first_coordinates[name] + j): value
            for name, body in self.bodies.items()
            for (i, j), value in name_errors(f"body {name!r}", body.mass_entries).items()
        }

    def weight(self, *components: ArrayLike) -> GeneralizedForce:
        """Return M g, with the components of g [m/s²] in the rows of the nodes' positions.

        Components that are left out are 0.
        """
        forms = [Form.constant(a) for a in components]
        rows = self.places[:, : len(components)]
        g = {row: form for place in rows.tolist() for row, form in zip(place, forms, strict=True)}
        force: GeneralizedForce = {}
        for (i, j), value in self.mass.items():
            for to, of in {(i, j), (j, i)}:
                if of in g:
                    force[to] = force.get(to, Form({})) + g[of] * value
        return force

    def line_load(self, body: str, x: Property, y: Property) -> GeneralizedForce:
        """Return the generalized force of a load [N/m] along a beam or cable."""
        member, first = self.member(body)
        return {first + j: Form.constant(force) for j, force in member.line_load(x, y).items()}


def within(kind: str, name: str, parts: Mapping[str, object]) -> None:
    """Raise `InputError` if a name is not among the parts of a mechanism."""
    if not isinstance(name, str) or name not in parts:
        there = ", ".join(parts) or "none"
        raise InputError(f"{kind} {value_text(name)} is not in the mechanism; there is {there}")
