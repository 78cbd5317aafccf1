"""Dry friction: Coulomb's law, and what it enters in the equations of motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.arguments import frozen
from flexband.basics.checks import (
    check_function,
    check_non_negative,
    check_positive,
    check_same_samples,
)
from flexband.basics.user_functions import evaluate_function
from flexband.basics.words import value_text
from flexband.errors import InputError
from flexband.mechanics.contact.geometry.geometry import Travel
from flexband.mechanics.kernels.forms import Form, TimeFunction, Vector


@frozen(kw_only=True)
class Coulomb:
    """Dry friction: the force µ(u) N + c u against the sliding speed u, up to µs N at rest.

    While it slides, µ(u) = µk + (µs − µk) exp(−(u/v)²) with the Stribeck speed v, or µk without
    one. Where friction is asked for, a number stands for ``Coulomb(kinetic=number)``.

    Parameters
    ----------
    kinetic : µk, 0 or more.
    static : µs, at least µk, or None for µk.
    stribeck_speed : v [m/s], or None for a force that falls at once when sliding begins.
    viscous : c [N s/m], which acts while the parts touch.

    Raises
    ------
    InputError
        If a number is out of its range.

    Examples
    --------
    >>> fb.contact.Coulomb(kinetic=0.2, static=0.3, stribeck_speed=0.01)
    Coulomb(kinetic=0.2, static=0.3, stribeck_speed=0.01, viscous=0.0)
    """

    kinetic: ArrayLike
    static: ArrayLike | None = None
    stribeck_speed: ArrayLike | None = None
    viscous: ArrayLike = 0.0

    def __post_init__(self) -> None:
        kinetic = check_non_negative("Coulomb kinetic", self.kinetic)
        static = kinetic
        coefficients = [kinetic, check_non_negative("Coulomb viscous [N s/m]", self.viscous)]
        if self.static is not None:
            static = check_non_negative("Coulomb static", self.static)
        if self.stribeck_speed is not None:
            coefficients.append(check_positive("Coulomb stribeck_speed [m/s]", self.stribeck_speed))
        check_same_samples("Coulomb", static, *coefficients)
        if np.any(static < kinetic):
            raise InputError(
                f"Coulomb static must be at least kinetic; got {self.static} and {self.kinetic}"
            )


Friction = Coulomb | ArrayLike
"""A law, or µ."""


def as_coulomb(name: str, friction: Friction) -> Coulomb:
    """Return the law; raise `InputError` if µ is not a number, 0 or more."""
    if isinstance(friction, Coulomb):
        return friction
    return Coulomb(kinetic=check_non_negative(name, friction))


Activity = TimeFunction | tuple[str, str]
"""A function of time that is more than 0.5, or an event of a load, while something is active."""


def as_activity(name: str, active: Activity) -> Activity:
    """Return what is active when, truths as numbers; raise `InputError` if it does not say so."""
    if isinstance(active, tuple):
        check_law_output(name, active, "event")
        return active
    check_function(name, active, " of time")
    numbers = partial(_as_numbers, active)
    evaluate_function(numbers, 0.0, name)
    return numbers if np.asarray(active(0.0)).dtype == bool else active


def _as_numbers(function: TimeFunction, time: float) -> np.ndarray:
    return np.asarray(function(time), dtype=float)


def check_law_output(name: str, value: tuple, kind: str) -> None:
    """Raise `InputError` if a value is not the names of a load and of its state or event."""
    if len(value) != 2 or {*map(type, value)} != {str}:
        raise InputError(
            f"{name} must be a function of time, or the names of a load and its {kind}; "
            f"got {value_text(value)}"
        )


class FrictionEntry(NamedTuple):
    """What sticks or slides along a travel s, see `kernels.friction.rows`.

    `normal` returns vectors whose lengths add up to the normal force N, from the multipliers of a
    joint or the forces of the contacts of its part. A joint that switches says when s sticks: N is
    then positive, and µs is the largest |s| at which it may begin.
    """

    sliding: Travel
    law: Friction  # for the travel of the surfaces
    normal: Callable[[Sequence[Form]], Sequence[Vector]]
    normals: int = 1
    """Number of these vectors."""
    lever: ArrayLike = 1.0
    """Travel of the surfaces over s, a radius [m] where s is an angle."""
    factor: Callable[[np.ndarray], np.ndarray] = np.asarray  # ratio of the forces from µ
    angular: bool = False  # whether s is an angle
    one_way: bool = False  # whether s is free to increase and does not decrease; N is then 1
    active: Activity | None = None  # of a joint that switches

    @property
    def whole_travel(self) -> Form:
        """The travel, with the orbit for a distance of 1."""
        travel = self.sliding.travel
        orbit = self.sliding.orbit
        return travel + orbit if orbit else travel

    @property
    def numbers(self) -> tuple[ArrayLike, ...]:
        """µs, µk, µs − µk while it slides, c and 1/v² for s."""
        law = as_coulomb("friction", self.law)
        lever = np.asarray(self.lever, dtype=float)
        kinetic, static = (
            lever * self.factor(np.asarray(law.kinetic if mu is None else mu, dtype=float))
            for mu in (law.kinetic, law.static)
        )
        viscous = np.asarray(law.viscous, dtype=float) * lever**2
        if law.stribeck_speed is None:
            return static, kinetic, 0.0, viscous, 0.0
        inverse = lever / np.asarray(law.stribeck_speed, dtype=float)
        return static, kinetic, static - kinetic, viscous, inverse**2


def friction_entry(
    friction: Friction | None, sliding: Callable[[], Travel]
) -> FrictionEntry | None:
    """Return the friction of a contact along a travel; `contact_entries` sets its normal force."""
    return None if friction is None else FrictionEntry(sliding(), friction, lambda forces: [])
