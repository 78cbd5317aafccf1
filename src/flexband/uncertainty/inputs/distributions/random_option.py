"""A random input that is one of several options, each with a probability."""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np

from flexband.basics.arguments import frozen
from flexband.errors import InputError
from flexband.uncertainty.expansions.discrete import DiscretePolynomials
from flexband.uncertainty.inputs.choices import Choice
from flexband.uncertainty.inputs.inputs import Input


@frozen()
class RandomOption(Input):
    """What a `Choice` with probabilities is for a response: one of its options.

    ξ of the options is in proportion to numbers, equidistant for texts, and 0 for the likeliest.
    """

    options: tuple[Any, ...]
    probabilities: tuple[float, ...]

    numeric = False

    def __repr__(self) -> str:
        return repr(self.choice)

    @property
    def choice(self) -> Choice:
        """The input as it is given."""
        return Choice(*self.options, probabilities=self.probabilities)

    @cached_property
    def order(self) -> np.ndarray:
        """Which option each value of ξ is, in increasing order of ξ."""
        texts = isinstance(self.options[0], str)
        return np.arange(len(self.options)) if texts else np.argsort(np.array(self.options))

    @cached_property
    def family(self) -> DiscretePolynomials:  # pyright: ignore[reportIncompatibleMethodOverride]
        number = np.arange(len(self.options), dtype=float)
        if not isinstance(self.options[0], str):
            number = np.array(self.options, dtype=float)[self.order]
        likely = np.array(self.probabilities)[self.order]
        points = (number - number[likely.argmax()]) / (number[-1] - number[0])
        return DiscretePolynomials(tuple(points.tolist()), tuple(likely.tolist()))

    def which(self, standard: np.ndarray) -> np.ndarray:
        """Return the number of the option at ξ of shape (n, 1), shape (n,)."""
        return self.order[self.family.nearest(standard[:, 0])]

    def value(self, standard: np.ndarray) -> np.ndarray:
        return np.array(self.options)[self.which(standard)]

    def as_numbers(self, name: str, standard: np.ndarray) -> dict[str, np.ndarray]:
        """Return numbers, or of texts whether it is each of them but the first."""
        if not isinstance(self.options[0], str):
            return {name: self.value(standard).astype(float)}
        which = self.which(standard)
        return {
            f"{name} is {option}": (which == k).astype(float)
            for k, option in enumerate(self.options)
            if k
        }

    def mean_or_midpoint(self) -> Any:
        """Return the likeliest option, of which ξ is 0."""
        return self.value(self.family.sequence(1)[:, None])[0]

    def standard(self, value: Any) -> np.ndarray:
        ranks = dict(zip(self.options, np.argsort(self.order).tolist(), strict=True))
        for option in np.unique(value).tolist():
            if option not in ranks:
                raise InputError(
                    f"must be one of {', '.join(map(repr, self.options))}; got {option!r}"
                )
        points = np.array(self.family.points)
        numbers = [ranks[option] for option in np.atleast_1d(value).tolist()]
        return points[numbers][:, None]
