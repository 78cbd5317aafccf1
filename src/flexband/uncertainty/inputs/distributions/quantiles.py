"""Quantiles of a distribution as polynomials on panels of a standard normal variable.

In this variable even densities with singular ends are smooth. Panels are halved where they are not.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

from flexband.errors import InputError

POINTS = 12
"""Points of a panel, and coefficients of its polynomial."""

NODES, WEIGHTS = legendre.leggauss(POINTS)
TRANSFORM = np.linalg.inv(legendre.legvander(NODES, POINTS - 1))


@dataclass(frozen=True)
class Quantiles:
    """An increasing function of z ~ N(0, 1) in Legendre polynomials on panels."""

    panels: np.ndarray
    coefficients: np.ndarray

    @staticmethod
    def from_function(
        function: Callable[[np.ndarray], np.ndarray], reach: float, kinks: Sequence[float] = ()
    ) -> Quantiles:
        """Return the polynomials of a function of z up to `reach`, between kinks; not of noise."""
        width = 0.5  # of a panel that is not halved
        # a panel is halved, so often at most, while its last two coefficients are larger
        # than this part of the spread, weighted by the density, and while there are not
        # too many, as where values are noise
        round_off = 1e-12
        max_splits = 24
        max_panels = 1000
        # of what panels leave out, averaged over them, as a part of the spread
        largest_noise = 1e-6
        edges = np.unique([*np.arange(-reach, reach + width / 2, width), 0.0, *kinks])
        edges = edges[np.isfinite(function(edges))]
        panels = np.stack([edges[:-1], edges[1:]], axis=1)
        spread = np.ptp(function(np.array([-1.0, 1.0])))
        pieces = []
        noise = 0.0
        for split in range(max_splits + 1):
            middle = panels.mean(axis=1, keepdims=True)
            half = np.diff(panels) / 2
            coefficients = function(middle + half * NODES) @ TRANSFORM.T
            nearest = np.abs(panels).min(axis=1)  # zero lies on an edge
            off = np.abs(coefficients[:, -2:]).max(axis=1) * np.exp(-(nearest**2) / 2)
            coarse_mask = (off > round_off * spread) & (split < max_splits)
            if sum(len(intervals) for intervals, _ in pieces) + 2 * len(panels) > max_panels:
                coarse_mask[:] = False
            pieces.append((panels[~coarse_mask], coefficients[~coarse_mask]))
            noise += off[~coarse_mask] @ half[~coarse_mask, 0]
            (low, high), middle = panels[coarse_mask].T, middle[coarse_mask, 0]
            panels = np.concatenate([np.stack([low, middle], 1), np.stack([middle, high], 1)])
        if not noise < largest_noise * spread:
            raise InputError(
                "a distribution must have quantiles that are more than rounding; these are off by "
                f"{noise / spread:.1g} of their spread, which may be too small for their size"
            )
        panels, coefficients = map(np.concatenate, zip(*pieces, strict=True))
        order = np.argsort(panels[:, 0])
        return Quantiles(panels[order], coefficients[order])

    @property
    def reach(self) -> np.ndarray:
        """The ends of the first and the last panel."""
        return self.panels[[0, -1], [0, 1]]

    def __call__(self, z: np.ndarray) -> np.ndarray:
        """Return the polynomials' values at z, of any shape, between the ends."""
        panel = np.searchsorted(self.panels[1:, 0], z, side="right")
        low, high = np.moveaxis(self.panels[panel], -1, 0)
        values = legendre.legvander((2 * z - low - high) / (high - low), POINTS - 1)
        return np.einsum("...k,...k->...", values, self.coefficients[panel])

    def rule(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return Gauss–Legendre z and weights of all panels, for polynomials of degree 2 count."""
        t, w = legendre.leggauss(POINTS + count // 4)
        middle = self.panels.mean(axis=1, keepdims=True)
        half = np.diff(self.panels) / 2
        z = (middle + half * t).ravel()
        weights = (half * w).ravel() * np.exp(-z * z / 2)
        return z, weights / weights.sum()
