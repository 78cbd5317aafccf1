"""What it takes to meet a requirement: the worst case, a probability, or a share of the parts."""

from __future__ import annotations

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_fraction
from flexband.uncertainty.surrogates.sigmas import checked_sigmas


@frozen()
class WorstCase:
    """The error bar μ ± kσ stays inside for all values of the interval inputs.

    Parameters
    ----------
    sigmas : k; without random inputs it has no effect.

    Raises
    ------
    InputError
        If `sigmas` is not a positive number.
    """

    sigmas: float = 3.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "sigmas", checked_sigmas(self.sigmas))


@frozen()
class Probability:
    """The probability of violating the bounds at any time is small for all values of the intervals.

    Parameters
    ----------
    at_most : the largest probability that is allowed, between 0 and 1.

    Raises
    ------
    InputError
        If `at_most` is not between 0 and 1.
    """

    at_most: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "at_most", check_fraction("Probability at_most", self.at_most))


@frozen()
class ShareOfParts:
    """Few of the parts violate the bounds, if tolerances scatter (`production_yield`).

    Parameters
    ----------
    at_most : the largest share of the parts that may fail, between 0 and 1.

    Raises
    ------
    InputError
        If `at_most` is not between 0 and 1.
    """

    at_most: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "at_most", check_fraction("ShareOfParts at_most", self.at_most))


Criterion = WorstCase | Probability | ShareOfParts
