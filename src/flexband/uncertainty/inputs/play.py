"""Play: pairs of numbers that a clearance leaves free, as tolerances of a mechanism."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import replace
from typing import ClassVar, Self

import numpy as np
from scipy.special import ndtr

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_flag, check_numbers, check_option, check_positive
from flexband.errors import InputError
from flexband.uncertainty.expansions.bounds.discs import RADIUS, farthest
from flexband.uncertainty.inputs.inputs import Input, Interval


class FreePair(Input):
    """A pair of numbers anywhere in a set around 0, which grows in proportion to a size.

    The response gets the pair as an array of shape (2, n).
    """

    random = False
    size_name: ClassVar[str]  # name of the size among the fields
    parts: ClassVar[tuple[str, str]]  # names of both numbers in results
    in_disc: ClassVar[bool] = False  # whether the set is a disc of η, and not their square
    one_sided: bool  # whether loads keep the pair in one place during a run

    def __post_init__(self) -> None:
        super().__post_init__()
        label = f"{type(self).__name__} {self.size_name}"
        size = vars(self)[self.size_name]
        if not isinstance(size, Interval):
            size = float(check_numbers(label, size))
            object.__setattr__(self, self.size_name, size)
        check_positive(label, np.array(size.lower if isinstance(size, Interval) else size))
        check_flag(f"{type(self).__name__} one_sided", self.one_sided)

    @property
    def dimension(self) -> int:
        return 2

    @property
    @abstractmethod
    def matrix(self) -> np.ndarray:
        """The pair as a linear function of η, (2, 2)."""

    @property
    def size(self) -> float:
        """The size of the set, the largest of an interval."""
        size = vars(self)[self.size_name]
        return size.upper if isinstance(size, Interval) else size

    @property
    def tolerance_or_std(self) -> float:
        return self.size

    def with_tolerance(self, tolerance: float) -> Self:
        return replace(self, **{self.size_name: tolerance})

    @abstractmethod
    def of_normals(self, u: np.ndarray) -> np.ndarray:
        """Return η of the pairs of a production at standard normal variables, both (n, 2)."""

    def value(self, standard: np.ndarray) -> np.ndarray:
        """Return the pairs, shape (2, n)."""
        return np.einsum("ij,nj->in", self.matrix, standard)

    def as_numbers(self, name: str, standard: np.ndarray) -> dict[str, np.ndarray]:
        """Return both numbers, each of shape (n,), by names such as "pin.x"."""
        pairs = self.value(standard)
        return {f"{name}.{part}": row for part, row in zip(self.parts, pairs, strict=True)}

    def standard(self, value: np.ndarray) -> np.ndarray:
        """Return η of pairs, shape (2,) or (2, n), as (n, 2)."""
        if value.shape[:1] != (2,) or value.ndim > 2:
            raise InputError(f"values must be a pair, shape (2,) or (2, n); got {value.shape}")
        eta = np.linalg.solve(self.matrix, value.reshape(2, -1)).T
        reach = farthest(eta, [0] if self.in_disc else []).max(axis=1)
        if reach.max(initial=0.0) > 1 + 1e-9:
            x, y = value.reshape(2, -1)[:, reach.argmax()]
            raise InputError(f"values must be pairs of {self!r}; got ({x:g}, {y:g})")
        return eta / np.maximum(reach, 1.0)[:, None]


@frozen()
class Play(FreePair):
    """The place of a pin in its hole: a vector anywhere in a disc.

    The response gets a pair, the coordinates of the vector, for ``Revolute(…, offset=play)``. It is
    constant in each run. Bounds are over the whole disc. If the motion of the mechanism is
    prescribed, bounds of positions and angles hold for any motion of the pin in its hole; bounds of
    velocities, forces and free motions hold for constant offsets only.

    Parameters
    ----------
    radius : of the hole less that of the pin; of an `Interval`, as after wear, the upper end.
    within : for probabilities, where the pins of a production are: uniform in the "disc", or on its
        "rim", where forces hold them.
    one_sided : whether loads keep the pin on one side of its hole during a run, so that its place
        is the same at all times. Requirements on outputs that depend on how the pin moves are
        decided only then.

    Raises
    ------
    InputError
        If the radius is not positive, or `within` or `one_sided` is something else.

    Examples
    --------
    >>> inputs = {"pin": fb.Play(0.1), "length": fb.Interval(1.0, 1.2)}
    >>> bands = fb.propagate(lambda pin, length: length + pin[0], inputs, fb.PCCI(0, 1))
    >>> bands["mean"].values.round(9)
    array([0.9, 1.3])
    """

    radius: float | Interval
    within: str = "disc"
    one_sided: bool = False

    size_name = "radius"
    parts = ("x", "y")
    in_disc = True

    def __post_init__(self) -> None:
        super().__post_init__()
        check_option("Play within", self.within, ("disc", "rim"))

    @property
    def matrix(self) -> np.ndarray:
        return np.eye(2) * (self.size / RADIUS)

    def of_normals(self, u: np.ndarray) -> np.ndarray:
        """Return η in the direction of u, at the radius of the same probability as |u|."""
        length = np.hypot(*u.T)[:, None]
        radius = np.sqrt(-np.expm1(-(length**2) / 2)) if self.within == "disc" else 1.0
        return RADIUS * radius * u / np.maximum(length, 1e-300)


@frozen()
class GuidePlay(FreePair):
    """The place of a slider in a long guide: y and θ with |y| + (ℓ/2) |θ| ≤ c.

    The response gets a pair, the displacement y across the guide and the angle θ [rad], for
    ``Prismatic(…, offset=play)``. A production is uniform in this rhombus. For constant offsets,
    see `Play`.

    Parameters
    ----------
    clearance : c on each side; of an `Interval`, the upper end.
    length : ℓ of the slider.
    one_sided : as of `Play`.

    Raises
    ------
    InputError
        If a number is not positive, or `one_sided` is something else.

    Examples
    --------
    >>> inputs = {"slider": fb.GuidePlay(clearance=0.1, length=2.0)}
    >>> bands = fb.propagate(lambda slider: slider[0] + 3 * slider[1], inputs, fb.PCCI(0, 1))
    >>> bands["mean"].values.round(9)
    array([-0.3,  0.3])
    """

    clearance: float | Interval
    length: float
    one_sided: bool = False

    size_name = "clearance"
    parts = ("offset", "angle")

    def __post_init__(self) -> None:
        super().__post_init__()
        check_positive("GuidePlay length", np.array(self.length))

    @property
    def matrix(self) -> np.ndarray:
        half = self.size / 2
        return np.array([[half, half], [2 * half / self.length, -2 * half / self.length]])

    def of_normals(self, u: np.ndarray) -> np.ndarray:
        return 2 * ndtr(u) - 1
