"""Interval fields: functions of position or time of which only limits are known."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_flag, check_positive
from flexband.basics.words import number_of
from flexband.errors import InputError
from flexband.uncertainty.inputs.fields.field import Field, Profile, check_profile, profile


@frozen()
class IntervalField(Field):
    """A function of the position [m] or the time [s] between two limits.

    It is an explicit interval field (Verhaeghe, Desmet, Vandepitte and Moens 2013): the middle of
    the limits plus half their distance times Σ w_i(x) η_i. The η_i are independent intervals from
    −1 to 1 at control points one `length` apart, the middle of them at that of the domain; w_i
    falls from 1 at its own control point to 0 at its neighbours, and all w_i add up to 1. So every
    sample is between the limits, and can go from one limit to the other over one length, but not
    faster. Functions that turn between the control points as sharply as at them are left out.

    Parameters
    ----------
    lower, upper : limits: numbers, or functions of positions of shape (points,) that return as many
        values.
    length : distance over which a sample can go from one limit to the other.
    domain : positions (start, end) on which the field is used; if None, found as that of a
        `RandomField`.
    smooth : whether samples have second derivatives, as a prescribed motion requires. They are
        then level at the control points, and up to 1.875 times as steep between them.

    Raises
    ------
    InputError
        If a number is out of its range, or the lower limit is above the upper one anywhere.

    Examples
    --------
    >>> height = fb.IntervalField(0.009, 0.011, length=0.5, domain=(0.0, 1.0))
    >>> height.dimension
    3
    >>> height.realizations(np.linspace(0.0, 1.0, 9), count=3).shape
    (3, 9)
    """

    lower: Profile
    upper: Profile
    length: float
    domain: tuple[float, float] | None = None
    smooth: bool = False

    random = False

    _smoother = "take smooth=True"

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("lower", "upper"):
            value = check_profile(f"IntervalField {name}", getattr(self, name))
            object.__setattr__(self, name, value)
        check_positive("IntervalField length", self.length)
        object.__setattr__(self, "smooth", check_flag("IntervalField smooth", self.smooth))
        if not (callable(self.lower) or callable(self.upper)):
            self.limits(np.zeros(1))
        self._check_domain()

    def limits(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the lower and the upper limit at positions x, each of shape x.shape."""
        low, high = (
            profile(f"IntervalField {name}", getattr(self, name), x) for name in ("lower", "upper")
        )
        if np.any(low > high):
            worst = np.argmax(low - high)
            raise InputError(
                f"IntervalField lower must not be above upper; got {low.flat[worst]:g} and "
                f"{high.flat[worst]:g} at {np.ravel(x)[worst]:g}"
            )
        return low, high

    @cached_property
    def points(self) -> np.ndarray:
        """The control points: one length apart, the first and the last outside the domain."""
        check_count = 1001  # positions of the domain at which limits are checked
        max_points = 1000  # control points of a field
        start, end = self.extent
        count = max(2, int(np.ceil((end - start) / self.length - 1e-9)) + 1)
        if count > max_points:
            raise InputError(
                f"IntervalField control points must be {max_points} or less; got {count}, one per "
                f"length of {self.length:g} on ({start:g}, {end:g})"
            )
        self.limits(np.linspace(start, end, check_count))
        return (start + end) / 2 + self.length * (np.arange(count) - (count - 1) / 2)

    @property
    def places(self) -> np.ndarray:
        """The positions of the domain nearest to the control points."""
        return np.clip(self.points, *self.extent)

    @property
    def dimension(self) -> int:
        """Number of control points, each with one interval variable."""
        return len(self.points)

    def weights(self, x: np.ndarray) -> np.ndarray:
        """Return w_i at positions x, shape (*x.shape, control points)."""
        distance = np.abs(np.asarray(x, dtype=float)[..., None] - self.points) / self.length
        hat = np.clip(1 - distance, 0.0, 1.0)
        return hat**3 * (10 - 15 * hat + 6 * hat**2) if self.smooth else hat

    def nominal(self, x: np.ndarray) -> np.ndarray:
        low, high = self.limits(x)
        return (low + high) / 2

    def samples(self, standard: np.ndarray, x: np.ndarray) -> np.ndarray:
        low, high = self.limits(x)
        s = np.einsum("ni,npi->np", standard, self.weights(x))
        return np.clip(0.5 * ((1 - s) * low + (1 + s) * high), low, high)

    @property
    def twice_differentiable(self) -> bool:
        """Whether the weights are smooth."""
        return self.smooth

    @property
    def summary(self) -> str:
        """Number and distance of the control points."""
        return f"interval field, {self.dimension} control points, {self.length:g} apart"

    def standard(self, value: np.ndarray) -> np.ndarray:
        """Return η of values at `places`, (n, control points); refuse what no sample has."""
        places = self.places
        if value.ndim != 2 or value.shape[1] != self.dimension:
            raise InputError(
                "an IntervalField is given by its values at "
                f"{number_of(self.dimension, 'position')}, shape "
                f"(n, {self.dimension}); got shape {value.shape}"
            )
        low, high = self.limits(places)
        if np.any(low == high):
            where = places[np.argmax(low == high)]
            raise InputError(
                f"the values of this IntervalField do not tell its samples: its limits are equal "
                f"at {where:g}"
            )
        s = (2 * value - low - high) / (high - low)
        standard = np.linalg.solve(self.weights(places), s.T).T
        if np.any(np.abs(standard) > 1 + 1e-6):
            worst = np.ravel(value)[np.abs(standard).argmax()]
            raise InputError(
                "values of an IntervalField must be those of a sample between its limits, which "
                f"changes over its length; got {worst:g}"
            )
        return np.clip(standard, -1.0, 1.0)

    def mean_or_midpoint(self) -> np.ndarray:
        """Return the values at `places` in the middle of the limits."""
        return self.value(np.zeros((1, self.dimension)))(self.places)

    def as_numbers(self, name: str, standard: np.ndarray) -> dict[str, np.ndarray]:
        """Return the values at `places`, each of shape (n,), by names such as "name(0.5)"."""
        values = self.value(standard)(self.places)
        return {f"{name}({x:g})": column for x, column in zip(self.places, values.T, strict=True)}
