"""The turns of angles in a study: counted at the nominal inputs, and followed from there.

The direction of a body tells its angle but for whole turns. Where runs are simulated one by one,
each counts them from its own given angle, and bodies that are assembled across ±π from it end on
either side. So a study looks at the nominal inputs once: every run is on the turn that the nominal
one leads to by continuity.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from flexband.basics.warning import without_warnings
from flexband.errors import InputError, RunError
from flexband.mechanics.bodies.properties import Property
from flexband.mechanics.configuration import assembled_configuration
from flexband.mechanics.model.mechanism import Mechanism
from flexband.mechanics.model.turns import nearest

Builder = Callable[..., Mechanism]
Values = Mapping[str, Property]


@dataclass(frozen=True, eq=False)
class Branch:
    """The angles of the bodies at the nominal inputs."""

    values: Values  # the nominal inputs
    angles: dict[str, float]  # body -> its angle before assembly [rad]
    turns: dict[str, float]  # body -> turn by assembly [rad], if that is about 45° or more
    uncertain: frozenset[str]  # the bodies whose given angles depend on inputs

    @staticmethod
    def from_builder(builder: Builder, values: Values) -> Branch:
        """Return that of nominal inputs; bodies that cannot be assembled there have not turned.

        Turns are rounded to an eighth of a revolution, so that runs are on the same branch if the
        nominal inputs change a little.
        """
        mechanism = builder(**values)
        angles = {}
        turns = {}
        eighth = np.pi / 4
        # Assemble the mechanism, if that is possible.
        try:
            with without_warnings():
                start = assembled_configuration(mechanism)
        except (InputError, RunError):
            start = None
        # Read by what bodies turn from their own angles to the assembled ones.
        bodies = [(name, body) for name, body in mechanism.bodies.items() if body.axes.size]
        for (name, body), (_, (vector, *_)) in zip(bodies, mechanism.model.turn_axes, strict=False):
            angles[name] = float(np.ravel(body.angles()[0])[0])
            if start is None:
                continue
            x, y = start.vector(vector)
            change = float(nearest(np.arctan2(y, x) - angles[name], 0.0))
            if eighths := round(change / eighth):
                turns[name] = eighth * (4 if eighths == -4 else eighths)
        uncertain = frozenset(name for name, body in bodies if np.ndim(body.angles()[0]))
        return Branch(values, angles, turns, uncertain)

    def __str__(self) -> str:
        """Say where angles are nominally, to a quarter of a revolution, if that is not 0."""
        places = {
            name: 90 * round((self.angles[name] + self.turns.get(name, 0.0)) / (np.pi / 2))
            for name in self.angles
            if name in self.turns or name in self.uncertain
        }
        return ", ".join(f"{name} at about {place}°" for name, place in places.items() if place)

    def lead(self, builder: Builder, mechanism: Mechanism, values: Values) -> Mechanism:
        """Return the mechanism of other inputs with its angles on this branch."""
        branches = {}
        for name, angle in self.angles.items():
            if name not in mechanism.bodies or mechanism.branches:
                continue
            change = np.asarray(mechanism.bodies[name].angles()[0], dtype=float) - angle
            jumps = np.abs(change) > np.pi * (1 + 1e-9)
            if jumps.any():
                change = np.where(jumps, self._change(builder, values, name, change), change)
            if name in self.turns or jumps.any():
                branches[name] = angle + change + self.turns.get(name, 0.0)
        return replace(mechanism, branches=branches) if branches else mechanism

    def _change(
        self, builder: Builder, values: Values, name: str, change: np.ndarray, *, parts: int = 16
    ) -> np.ndarray:
        """Return how a given angle changes on the way from the nominal to other inputs [rad].

        A builder may have wrapped it, as by ``arctan2``. Where inputs on the way are refused, the
        change is taken as it is.
        """
        # Follow the angle in small steps, so that wraps are told from turns.
        angles = []
        for part in np.linspace(0.0, 1.0, parts + 1):
            inputs = {key: _input_between(self.values[key], v, part) for key, v in values.items()}
            try:
                angle = np.asarray(builder(**inputs).bodies[name].angles()[0], dtype=float)
                angles.append(angle + 0.0 * change)
            except (RunError, TypeError, ValueError):
                return change
        angle_path = np.unwrap(angles, axis=0)
        return angle_path[-1] - angle_path[0]


def _input_between(nominal: Property, other: Property, part: float) -> Property:
    """Return an input on the way from the nominal to another value."""
    if callable(nominal) and callable(other):
        return partial(_interpolate, nominal, other, part)
    return (1 - part) * np.asarray(nominal) + part * np.asarray(other)


def _interpolate(
    nominal: Callable, other: Callable, part: float, *places: np.ndarray
) -> np.ndarray:
    return (1 - part) * nominal(*places) + part * other(*places)
