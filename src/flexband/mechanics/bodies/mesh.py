"""Meshes of lines that are divided where something acts on them.

Places along a line are measured in two ways: in elements from the start, k + ξ being in the element
k, and in units of the length that all elements would have if they were equal.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np


class Mesh(NamedTuple):
    """Nodes of a line."""

    nodes: np.ndarray  # their places in units, shape (elements + 1,)
    doubled: np.ndarray  # which nodes are doubled, shape (divisions,)
    even: bool  # whether all elements are equal
    parts: int = 1
    """The number of parts that the line should have."""
    rounding: float = 1e-9
    """Difference of places that are the same, in units."""

    def at(self, places: np.ndarray) -> np.ndarray:
        """Return places in elements from the start in units."""
        return places if self.even else np.interp(places, np.arange(len(self.nodes)), self.nodes)

    def element_position(self, place: float) -> float:
        """Return the position in elements from the start of a place in units."""
        if not len(self.doubled):
            return place
        position = float(np.interp(place, self.nodes, np.arange(len(self.nodes))))
        nearest = round(position)
        return nearest if abs(self.nodes[nearest] - place) < self.rounding else position


def divided_mesh(elements: int, elements_per_node: int, divisions: Sequence[float]) -> Mesh:
    """Return the mesh with nodes at these ascending fractions, if it has enough elements."""
    even = np.arange(elements + 1.0)
    for coarse in (elements // elements_per_node, elements):
        places = _drop_close_places(coarse * np.asarray(divisions, dtype=float), coarse)
        if len(places) < coarse:
            break
    parts = len(places) + 1
    if not 1 < parts <= coarse:
        return Mesh(even, np.array([], dtype=int), True, parts)
    ratio = elements // coarse
    ends = np.array([0.0, *places, coarse])
    counts = ratio * _share_elements(np.diff(ends), coarse)
    spans = zip(ends, ends[1:], counts, strict=False)
    segments = [np.linspace(a, b, n, endpoint=False) for a, b, n in spans]
    nodes = ratio * np.append(np.concatenate(segments), coarse)
    mesh = Mesh(nodes, np.cumsum(counts)[:-1], False, parts)
    is_even = bool(np.all(np.abs(nodes - even) < mesh.rounding))
    return mesh._replace(nodes=even, even=True) if is_even else mesh


def _drop_close_places(places: np.ndarray, end: float, min_distance: float = 0.01) -> list[float]:
    """Drop places that are too close to the ends or to the place before; all in units."""
    divisions = [0.0]
    for place in places:
        if min(place - divisions[-1], end - place) > min_distance:
            divisions.append(float(place))
    return divisions[1:]


def _share_elements(lengths: np.ndarray, elements: int) -> np.ndarray:
    """Return elements per part of these lengths, such that the longest is as short as can be."""
    spare = elements - len(lengths)
    counts = np.maximum(1, np.floor(lengths / elements * spare)).astype(int)
    while counts.sum() < elements:
        counts[np.argmax(lengths / counts)] += 1
    return counts
