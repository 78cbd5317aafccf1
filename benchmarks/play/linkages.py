"""Exact kinematics of planar linkages with plays in their pins.

A linkage is a crank and then dyads: two links, jointed at one end, whose other ends are jointed to
bodies that are there already. Each pin is moved by a pair, in the axes of the body that is named
first, as by ``Revolute(first, second, offset=pair)``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize

Pose = tuple[np.ndarray, np.ndarray]
"""Position of the origin of a body, (2, n), and angle of its x axis, (n,)."""

Outputs = Callable[[np.ndarray], np.ndarray]
"""Outputs (n, outputs) of pairs (pins, 2, n)."""

Place = tuple[str, float, float]
"""A point of a body, "ground" or a link by name."""


@dataclass(frozen=True)
class Dyad:
    """Two links from places of other bodies to their common pin.

    Attributes
    ----------
    names, lengths : of both links, which start at the places.
    places : the pins at their starts.
    on_left : whether the common pin is to the left of the way from the first place to the second.
    """

    names: tuple[str, str]
    lengths: tuple[float, float]
    places: tuple[Place, Place]
    on_left: bool = True


@dataclass(frozen=True)
class Linkage:
    """A crank that turns about the origin, and dyads.

    Attributes
    ----------
    crank : its length.
    dyads : one after the other.
    outputs : places whose X and Y are outputs, and links whose angle is one.
    angles : of the crank, at which outputs are computed, (times,) [rad].
    """

    crank: float
    dyads: Sequence[Dyad]
    outputs: Sequence[Place | str]
    angles: np.ndarray

    @property
    def pins(self) -> list[str]:
        """The names of all pins: that of the crank, and three of each dyad."""
        return ["pin0", *(f"pin{k}" for k in range(1, 1 + 3 * len(self.dyads)))]

    def outputs_at(self, pins: Mapping[str, np.ndarray], **lengths: np.ndarray) -> np.ndarray:
        """Return the outputs for pairs (2, n) of pins, others at 0: (n, outputs, times).

        `lengths` are those of links in place of the given ones, (n,).
        """
        count = max((np.shape(v)[-1] for v in (*pins.values(), *lengths.values())), default=1)
        zero_pairs = np.zeros((2, count))
        results = []
        for angle in self.angles:
            bodies: dict[str, Pose] = {"ground": (zero_pairs, np.zeros(count))}
            bodies["crank"] = (pins.get("pin0", zero_pairs), np.full(count, angle))
            for k, dyad in enumerate(self.dyads):
                dyad_pairs = [pins.get(f"pin{3 * k + j}", zero_pairs) for j in (1, 2, 3)]
                self._add(dyad, dyad_pairs, lengths, bodies)
            rows = []
            for output in self.outputs:
                if isinstance(output, str):
                    rows.append(bodies[output][1])
                else:
                    rows += list(_point(bodies, output, zero_pairs))
            results.append(np.stack(np.broadcast_arrays(*rows), axis=-1))
        values = np.stack(results, axis=-1)
        return (
            np.unwrap(values, axis=-1) if all(isinstance(o, str) for o in self.outputs) else values
        )

    @staticmethod
    def _add(
        dyad: Dyad,
        pairs: Sequence[np.ndarray],
        lengths: Mapping[str, np.ndarray],
        bodies: dict[str, Pose],
    ) -> None:
        """Add the poses of both links: `pairs` are those of both places and of the last pin."""
        first, second = (_point(bodies, *pair) for pair in zip(dyad.places, pairs, strict=False))
        link_lengths = [
            lengths.get(name, length) for name, length in zip(dyad.names, dyad.lengths, strict=True)
        ]
        end_x = link_lengths[0] + pairs[2][0]
        end_y = pairs[2][1]
        a = np.hypot(end_x, end_y)
        b = link_lengths[1]
        separation = second - first
        distance = np.hypot(*separation)
        inner = np.arccos((distance**2 + a**2 - b**2) / (2 * distance * a))
        angle = np.arctan2(separation[1], separation[0]) + (inner if dyad.on_left else -inner)
        end = first + a * np.stack([np.cos(angle), np.sin(angle)])
        bodies[dyad.names[0]] = first, angle - np.arctan2(end_y, end_x)
        bodies[dyad.names[1]] = second, np.arctan2(*(end - second)[::-1])


def _point(bodies: Mapping[str, Pose], place: Place, offset: np.ndarray) -> np.ndarray:
    name, x, y = place
    origin, angle = bodies[name]
    c = np.cos(angle)
    s = np.sin(angle)
    x = x + offset[0]
    y = y + offset[1]
    return origin + np.stack([c * x - s * y, s * x + c * y])


def ends(
    values: Outputs, radii: ArrayLike, *, tries: int = 3, count: int = 20_000, seed: int = 0
) -> np.ndarray:
    """Return the least and the largest of each output over a product of discs, (2, outputs).

    A dense scan of rims and of the
    discs finds starts, from which optima are polished along the rims; an optimum inside would be
    found by the scan.
    """
    rng = np.random.default_rng(seed)
    radii = np.array(radii)
    angle = rng.uniform(0, 2 * np.pi, (len(radii), count))
    part = np.where(rng.random(count) < 0.5, 1.0, np.sqrt(rng.random((len(radii), count))))

    def at(angle: np.ndarray, part: np.ndarray | float = 1.0) -> np.ndarray:
        size = radii[:, None] * part
        return values(np.stack([size * np.cos(angle), size * np.sin(angle)], axis=1))

    scan = at(angle, part)
    result = np.empty((2, scan.shape[1]))
    for k, sign in enumerate((1.0, -1.0)):
        for output in range(scan.shape[1]):
            lowest = np.inf
            for start in np.argsort(sign * scan[:, output])[:tries]:
                lowest = min(lowest, _along_rims(at, angle[:, start], output, sign))
            result[k, output] = sign * min(lowest, (sign * scan[:, output]).min())
    return result


def _along_rims(at: Outputs, angle: np.ndarray, output: int, sign: float) -> float:
    def value(x: np.ndarray) -> float:
        return sign * float(at(x[:, None])[0, output])

    def slope(x: np.ndarray) -> np.ndarray:
        steps = 1e-5 * np.eye(len(x))
        shifted_values = at(np.concatenate([x + steps, x - steps]).T)[:, output]
        return sign * (shifted_values[: len(x)] - shifted_values[len(x) :]) / 2e-5

    solution = minimize(value, angle, jac=slope, method="BFGS", options={"gtol": 1e-8})
    return float(solution.fun)


def four_bar(rng: np.random.Generator) -> Linkage:
    """Return a random four-bar with a coupler point, which closes well at five angles."""
    while True:
        crank, coupler, rocker, ground = rng.uniform(0.3, 1.0, 4)
        angles = rng.uniform(0, 2 * np.pi) + np.linspace(0, rng.uniform(0.5, 1.5), 5)
        places = ("crank", crank, 0.0), ("ground", ground, 0.0)
        dyad = Dyad(("coupler", "rocker"), (coupler, rocker), places, bool(rng.integers(2)))
        point = ("coupler", *rng.uniform(-0.5, 0.5, 2))
        linkage = Linkage(crank, [dyad], [point], angles)
        if _closes(linkage):
            return linkage


def stephenson(rng: np.random.Generator, dyads: int = 2) -> Linkage:
    """Return a random linkage of several dyads, the first two of which make a Stephenson III."""
    while True:
        base = four_bar(rng)
        chain = list(base.dyads)
        point: Any = base.outputs[0]
        for k in range(1, dyads):
            names = f"rod{k}", f"lever{k}"
            x, y = rng.uniform(-1.0, 1.5, 2)
            place: Place = "ground", x, y
            long, short = rng.uniform(0.4, 1.2, 2)
            chain.append(Dyad(names, (long, short), (point, place), bool(rng.integers(2))))
            point = (names[0], *rng.uniform(-0.3, 0.3, 2))
        linkage = Linkage(base.crank, chain, [point], base.angles)
        if _closes(linkage):
            return linkage


def _closes(linkage: Linkage, min_sine: float = 0.35) -> bool:
    """Return whether all dyads close, with the sine of their inner angles above a number."""
    count = len(linkage.angles)
    bodies = {}
    zero_pairs = np.zeros((2, count))
    bodies["ground"] = (zero_pairs, np.zeros(count))
    bodies["crank"] = (zero_pairs, linkage.angles)
    for dyad in linkage.dyads:
        first, second = (_point(bodies, place, zero_pairs) for place in dyad.places)
        a, b = dyad.lengths
        distance = np.hypot(*(second - first))
        cosine = (a**2 + b**2 - distance**2) / (2 * a * b)
        if np.any(np.abs(cosine) > np.sqrt(1 - min_sine**2)) or distance.min() < 0.2:
            return False
        Linkage._add(dyad, [zero_pairs] * 3, {}, bodies)
    return True
