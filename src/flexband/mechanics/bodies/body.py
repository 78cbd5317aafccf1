"""The interface of a body, and the types that describe its points and its mass matrix."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Sequence
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.checks import check_finite
from flexband.basics.words import value_text
from flexband.errors import InputError
from flexband.mechanics.kernels.forms import Form, Frame

Point = tuple[ArrayLike, ...]
"""Coordinates (x, y) [m], each a number or an array of shape (n,)."""

MassEntries = dict[tuple[int, int], np.ndarray]
"""(i, j), i ≤ j, counted from the body's first coordinate -> entry of M, shape () or (n,)."""


class Body(ABC):
    """A body as assembly sees it: generalized coordinates q, constraints and a mass matrix.

    The coordinates are grouped by node. The first vector of each node is the position r [m]; the
    following ones are its gradients, without a unit: r_x, and r_y if a node of the plane has six
    coordinates. In the vector of unknowns z the coordinates occupy consecutive places that start
    at an index `first`.
    """

    per_node: ClassVar[int]
    """Number of coordinates of a node."""

    dimension: ClassVar[int] = 2
    """Number of components of its vectors: 2 in the plane."""

    elements: int = 0
    """Number of elements; 0 for a body without a mesh."""

    elements_left_out: bool = False
    """Whether that number was not given."""

    rigid: ClassVar[bool] = False
    """Whether its coordinates are r and r_x of a rigid body."""

    @property
    def size(self) -> int:
        """Number of coordinates; by default those of one node."""
        return self.per_node

    @property
    def nodes(self) -> range:
        """Index of the first coordinate of each node, counted from the body's first coordinate."""
        return range(0, self.size, self.per_node)

    @property
    def node_vectors(self) -> np.ndarray:
        """The vectors of each node as numbers of coordinates, (nodes, vectors, `dimension`).

        They are counted from the body's first coordinate. The first vector is r.
        """
        vectors_per_node = self.per_node // self.dimension
        return np.arange(self.size).reshape(-1, vectors_per_node, self.dimension)

    @property
    def axes(self) -> np.ndarray:
        """Those that tell how each node turns: r_x in the plane, all three axes in space."""
        return self.node_vectors[:, 1 : 2 if self.dimension == 2 else None]

    @abstractmethod
    def coordinates(self) -> list[np.ndarray]:
        """Return the initial guess of q, one array of shape () or (n,) per coordinate."""

    def angles(self) -> Sequence[ArrayLike]:
        """Return the angle of the section at each node as it is drawn [rad], turns included.

        By default bodies have no axes, whose angle is 0.
        """
        return [0.0] * len(self.nodes)

    @abstractmethod
    def velocities(self) -> list[np.ndarray]:
        """Return the initial guess of q̇, one array of shape () or (n,) per coordinate."""

    @abstractmethod
    def mass_entries(self) -> MassEntries:
        """Return the non-zero entries of the constant mass matrix M of ½ q̇ᵀ M q̇ [J]."""

    @abstractmethod
    def frame(self, name: str, first: int) -> Frame:
        """Return the frame of a named point, position [m] and axes as forms of z; refuse others."""

    def constraints(self, first: int) -> list[Form]:
        """Return the forms of z that the body itself requires to vanish; none by default."""
        return []

    def divide_at(self, points: Iterable[str]) -> Self:
        """Divide the mesh at these named points, where section forces may jump; return the body.

        By default a body has no mesh and is returned as it is.
        """
        return self

    def refine_mesh(self, parts: int) -> Self:
        """Return the body on a mesh with `parts` elements in place of each, with the same points.

        By default a body has no mesh and is returned as it is.
        """
        return self


def check_implements(name: str, value: object, kind: type, requirement: str) -> None:
    """Raise `InputError` if `value` is not of a class or protocol, or is itself a class."""
    if isinstance(value, type) or not isinstance(value, kind):
        raise InputError(f"{name} must be {requirement}; got {value_text(value)}")


def point(name: str, value: Point, dimension: int = 2) -> tuple[np.ndarray, ...]:
    """Return `value` as coordinates; raise `InputError` if it is not a pair of finite numbers.

    Of three dimensions it may be a triple; the third coordinate of a pair is 0.
    """
    is_sequence = isinstance(value, list | tuple | np.ndarray) and np.iterable(value)
    if not is_sequence or not 2 <= len(value) <= dimension:
        kind = "a pair" if dimension == 2 else "a pair or a triple"
        raise InputError(f"{name} must be {kind}; got {value_text(value)}")
    axes = zip((*value, 0.0)[:dimension], "XYZ", strict=False)
    return tuple(check_finite(f"{name} {axis} [m]", component) for component, axis in axes)


def add_pairs(entries: MassEntries, places: list[int], block: np.ndarray) -> None:
    """Add a symmetric block (n, i, j) to vectors of the plane with X components at `places`."""
    for a, i in enumerate(places):
        for b, j in enumerate(places[a:], start=a):
            for axis in range(2):
                key = (i + axis, j + axis)
                entries[key] = entries.get(key, 0.0) + block[:, a, b]
