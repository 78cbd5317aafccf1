"""Forces and moments from tables: over an elongation, a speed, or both."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_finite, check_function
from flexband.compilation.functions import compiled
from flexband.errors import InputError
from flexband.mechanics.kernels.forms import TimeFunction


@frozen()
class Characteristic:
    """A table of a force over elongation and speed, as the `pull` of a `Spring` or a `torque`.

    It is linear between its values and continues beyond its ends with the last slopes. Its work is
    part of `Work`, not of `ElasticEnergy`.

    Parameters
    ----------
    force : [N] or [N m], shape (places,), (speeds,) or (places, speeds). A last axis of shape (n,)
        may be added, with one value per sample.
    place : increasing elongations x = ℓ − ℓ₀ [m] of a `Spring`, or angles φ − φ₀ [rad] of a
        `TorsionSpring`; None for a force that does not depend on them.
    speed : increasing rates of these [m/s] or [rad/s], or None.
    factor : that multiplies the table: a number, an array of shape (n,), or a function of the time
        [s], such as the opening of a throttle.

    Raises
    ------
    InputError
        If places or speeds are fewer than two, do not increase or do not fit the force, or if
        neither is given.

    Examples
    --------
    >>> motor = fb.loads.Characteristic([3.0, 3.0, 0.0], speed=[0.0, 10.0, 15.0])  # N m
    >>> rotor = fb.Mechanism(
    ...     bodies={"rotor": fb.RigidBody(mass=1.0, inertia=1.0)},
    ...     joints={"axle": fb.Revolute("rotor", (0.0, 0.0))},
    ...     loads={"motor": fb.TorsionSpring("rotor", torque=motor)},
    ...     sensors={"w": fb.AngularVelocity("rotor")},
    ... )
    >>> fb.simulate(rotor, duration=5.0, step=0.005).values[0, [400, 1000]].round(2)  # [rad/s]
    array([ 6.  , 13.16])
    """

    force: ArrayLike
    place: ArrayLike | None = None
    speed: ArrayLike | None = None
    factor: ArrayLike | TimeFunction = 1.0

    def __post_init__(self) -> None:
        force = check_finite("Characteristic force", self.force, rank=None)
        axis_values = {"place": self.place, "speed": self.speed}
        axes = {
            name: _check_increasing(name, axis)
            for name, axis in axis_values.items()
            if axis is not None
        }
        if not axes:
            raise InputError("a Characteristic needs place, speed or both; got none of them")
        expected = tuple(map(len, axes.values()))
        if force.shape[: len(axes)] != expected or force.ndim > len(axes) + 1:
            raise InputError(
                f"Characteristic force must have shape {expected}, as {' and '.join(axes)}, "
                f"or one more axis of samples; got shape {force.shape}"
            )
        if callable(self.factor):
            check_function("Characteristic factor", self.factor, " of time")
        else:
            check_finite("Characteristic factor", self.factor)

    @property
    def rows(self) -> tuple[list[np.ndarray], int, int]:
        """Places, speeds and coefficients, see `kernels.springs`; how many places and speeds."""
        axes = ([0.0] if axis is None else axis for axis in (self.place, self.speed))
        places, speeds = (np.asarray(axis, dtype=float) for axis in axes)
        force = np.asarray(self.force, dtype=float)
        force = force.reshape(len(places), len(speeds), -1)
        coefficients = _of_ramps(_of_ramps(force, places).swapaxes(0, 1), speeds).swapaxes(0, 1)
        rows = [*places, *speeds, *coefficients.reshape(-1, force.shape[-1])]
        return rows, len(places), len(speeds)

    @property
    def parameters(self) -> list:
        """The parameters from which a force law reads the table, see `read_table`."""
        rows, places, speeds = self.rows
        return [places, speeds, self.factor, *(np.squeeze(row) for row in rows)]


@compiled
def read_table(p, at, x, v):
    """Return the force at x and v of a table whose `parameters` start at p[at], and their end."""
    places = int(p[at])
    speeds = int(p[at + 1])
    factor = p[at + 2]
    first = at + 3
    second = at + 3 + places
    force = 0.0
    coefficient = second + speeds
    for k in range(places):
        a = 1.0 if k == 0 else x - p[first + k - 1]
        a = max(a, 0.0) if k > 1 else a
        for m in range(speeds):
            b = 1.0 if m == 0 else v - p[second + m - 1]
            b = max(b, 0.0) if m > 1 else b
            force += factor * p[coefficient + k * speeds + m] * a * b
    return force, coefficient + places * speeds


def _check_increasing(name: str, values: ArrayLike) -> np.ndarray:
    """Return places or speeds; raise `InputError` if they do not increase."""
    axis = check_finite(f"Characteristic {name}", values, rank=None)
    if axis.ndim != 1 or len(axis) < 2 or np.any(np.diff(axis) <= 0):
        raise InputError(
            f"Characteristic {name} must be two or more increasing numbers; got {values}"
        )
    return axis


def _of_ramps(values: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return the coefficients of 1, x − x₀, max(x − x₁, 0), … from values along the first axis."""
    if len(places) == 1:
        return values
    slopes = np.diff(values, axis=0) / np.diff(places)[:, None, None]
    return np.concatenate([values[:1], slopes[:1], np.diff(slopes, axis=0)])
