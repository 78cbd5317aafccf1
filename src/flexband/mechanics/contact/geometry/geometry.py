"""The interface of the geometry of a contact: gap, normal and material points."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import ClassVar

from numpy.typing import ArrayLike

from flexband.errors import InputError
from flexband.mechanics.contact.geometry.travel import Travel
from flexband.mechanics.kernels.forms import Frame


class Geometry(ABC):
    """How two bodies meet, each at one of its points.

    A new geometry is a subclass with `kernel` and `parameters`.
    """

    kernel: ClassVar[Callable[..., tuple]]
    """A function, compiled by `kernels.lanes.compiled`, of the positions x of both points, each
    (X, Y, θ), and of the parameters, all of them lanes. It returns (gap, n_X, n_Y, X₁, Y₁, X₂, Y₂):
    the gap [m], the unit normal along which the contact pushes the first body, and the material
    points of both bodies that meet."""

    def travel(self, first: Frame, second: Frame) -> Travel:
        """Return how the surfaces slide, which friction needs.

        Raises
        ------
        InputError
            If friction is not possible.
        """
        raise InputError(f"{type(self).__name__} has no `travel`, so there cannot be friction")

    @property
    @abstractmethod
    def parameters(self) -> Sequence[ArrayLike]:
        """The parameters of `kernel`, numbers or arrays of shape (n,)."""
