"""Fields: uncertain functions of the position along a line, or of the time."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import ClassVar, Self

import numpy as np

from flexband.basics.checks import check_finite, check_integer, check_numbers
from flexband.basics.prescribed_motion import driven_part
from flexband.basics.user_functions import evaluate_function
from flexband.errors import InputError
from flexband.uncertainty.inputs.inputs import FunctionOfPosition, Input, Interval

Profile = float | Callable[[np.ndarray], np.ndarray]
"""A number, or a function of positions of shape (points,) that returns as many values."""


class Field(Input):
    """An uncertain function of the position along a line [m], or of the time [s].

    A subclass is a frozen dataclass with a field `domain`, positions (start, end) or None, and the
    functions of an `Input`, of which `value` is defined here.

    Attributes
    ----------
    functions : functions by name that fields may be made of, such as means as functions of
        position. A surrogate can be saved if those of its fields are among them; add yours under a
        new name before saving and before loading.
    """

    functions: ClassVar[dict[str, Callable]] = {}
    domain: tuple[float, float] | None

    def _check_domain(self) -> None:
        if self.domain is not None:
            start, end = check_numbers(f"{self.kind} domain [m or s]", self.domain, 2)
            if start >= end:
                raise InputError(f"{self.kind} domain must run upwards; got {self.domain}")
            object.__setattr__(self, "domain", (float(start), float(end)))

    def with_domain(self, domain: tuple[float, float] | None) -> Self:
        """Return the field on another domain."""
        return replace(self, domain=domain)

    @property
    def kind(self) -> str:
        """Name of the class, for messages."""
        return type(self).__name__

    @property
    def extent(self) -> tuple[float, float]:
        """The domain; `InputError` if there is none."""
        if self.domain is None:
            raise InputError(f"{self.kind} domain must be given here; got None")
        return self.domain

    @abstractmethod
    def nominal(self, x: np.ndarray) -> np.ndarray:
        """Return the mean or the middle of the limits at positions x, shape x.shape."""

    @abstractmethod
    def samples(self, standard: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Return samples, shape (n, points), at positions x of shape (1 or n, points)."""

    @property
    @abstractmethod
    def twice_differentiable(self) -> bool:
        """Whether all samples have a second derivative, so that they may prescribe a motion."""

    @property
    @abstractmethod
    def summary(self) -> str:
        """What the field is made of, for reports."""

    def value(self, standard: np.ndarray) -> FunctionOfPosition:
        """Return the samples as a function of the position [m] or the time [s].

        The function takes positions of shape (points,), (n, points) or (1, points) and returns
        shape (n, points); at one position, a number, it returns shape (n,). It raises `InputError`
        for other positions, those outside the domain, and where it is to prescribe a motion for
        which the samples are too rough.
        """
        start, end = self.extent
        slack = 1e-9 * (end - start)
        prescribed_parts: set[str] = set()

        def at(x: np.ndarray) -> np.ndarray:
            coordinates = check_finite(f"{self.kind}: positions", x, rank=None)
            positions = np.atleast_2d(coordinates)
            if positions.ndim > 2 or len(positions) not in (1, len(standard)):
                shapes = f"(points,) or ({len(standard)}, points)"
                raise InputError(
                    f"{self.kind}: positions must have shape {shapes}; got {positions.shape}"
                )
            outside = (positions < start - slack) | (positions > end + slack)
            if np.any(outside):
                raise InputError(
                    f"{self.kind} is evaluated at {positions[outside][0]:g}, outside its domain "
                    f"({start:g}, {end:g}); give a domain=(start, end) that contains the positions "
                    "of all runs"
                )
            part = driven_part()
            if part and part not in prescribed_parts:
                self.check_motion(part)
                prescribed_parts.add(part)
            samples = self.samples(standard, positions)
            return samples[:, 0] if coordinates.ndim == 0 else samples

        return at

    def check_motion(self, part: str) -> None:
        """Raise `InputError` if the samples are too rough to prescribe the motion of a part."""
        if not self.twice_differentiable:
            raise InputError(
                f"{part} cannot be prescribed by this {self.kind}, whose samples have no "
                f"accelerations: {self._smoother}, or let it enter as a parameter of a ForceLaw"
            )

    _smoother: ClassVar[str] = ""
    """What makes samples smooth enough, for the message."""

    def as_numbers(self, name: str, standard: np.ndarray) -> dict[str, np.ndarray]:
        """Return no numbers: the samples are functions."""
        return {}

    def realizations(self, x: np.ndarray, count: int, seed: int = 0) -> np.ndarray:
        """Return random samples at positions x of shape (points,), shape (count, points).

        Standard variables of interval fields are drawn uniformly from −1 to 1, to show what the
        samples look like; that is no statement about probabilities.

        Parameters
        ----------
        count, seed : number of samples, and seed of the random numbers.
        """
        max_realizations = 100_000
        count = check_integer(f"{self.kind} count", count, 1, max_realizations)
        generator = np.random.default_rng(check_integer(f"{self.kind} seed", seed, 0))
        shape = count, self.dimension
        normal = self.random
        standard = generator.standard_normal(shape) if normal else generator.uniform(-1, 1, shape)
        return self.value(standard)(x)


def fields_of(inputs: Mapping[str, object]) -> dict[str, Field]:
    return {name: input_ for name, input_ in inputs.items() if isinstance(input_, Field)}


def profile(name: str, value: Profile | Interval | np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return a parameter at positions x, (…, points): a `Profile`, number, or middle of bounds."""
    if isinstance(value, Interval):
        value = (value.lower + value.upper) / 2
    if not callable(value):
        parameter = np.asarray(value, dtype=float)
        parameter = parameter[:, None] if parameter.ndim else parameter
        return np.broadcast_to(parameter, np.broadcast_shapes(parameter.shape, np.shape(x)))
    flat = np.ravel(x)
    values = check_finite(name, evaluate_function(value, flat, name), rank=None)
    if values.shape not in ((), flat.shape):
        raise InputError(
            f"{name} must return one value per position, shape {flat.shape}; got {values.shape}"
        )
    return np.broadcast_to(values, flat.shape).reshape(np.shape(x))


def check_profile(name: str, value: Profile) -> Profile:
    """Return a finite number or a function; raise `InputError` for anything else."""
    if callable(value) and not isinstance(value, type):
        return value
    return float(check_numbers(name, value))  # pyright: ignore[reportArgumentType]
