"""What a surrogate misses in check runs, which tell its error in any part of its inputs."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from flexband.uncertainty.surrogates.diagnostics import running_rms, share


@dataclass(frozen=True)
class HeldOut:
    """Runs that were not fitted, and what the expansion misses in them."""

    # shapes (runs, n) and (runs, m)
    xi: np.ndarray
    eta: np.ndarray
    missed: np.ndarray  # shape (runs, outputs, times)
    # error of the bands that other runs tell, and how far the expansion leaves the range of all
    # runs for rare values of random variables, root mean square, shape (outputs, times)
    overshoot: np.ndarray
    window: int  # half of the number of times over which errors are averaged
    # Verification runs: they count by a weight, (runs,), and the one that is missed most decides,
    # since they are where bounds are. No weights of runs at generic points: all count alike.
    weight: np.ndarray = field(default_factory=lambda: np.ones(0))

    @property
    def verifies(self) -> bool:
        """Whether these are verification runs."""
        return len(self.weight) > 0

    def expected_error(self, intervals: int) -> np.ndarray:
        """Return the error expected of the error bar over so many intervals, (outputs, times)."""
        if self.verifies:
            weighted_errors = np.sqrt(np.minimum(self.weight, 1.0))[:, None, None] * np.abs(
                self.missed
            )
            return running_rms(np.hypot(weighted_errors.max(axis=0), self.overshoot), self.window)
        missed = np.sqrt(np.mean(self.missed**2, axis=0))
        return running_rms(np.hypot(share(intervals) * missed, self.overshoot), self.window)

    def nearest(self, distance: np.ndarray) -> np.ndarray:
        """Return which runs judge a part: those at `distance` 0, (runs,), or the nearest eight."""
        # runs that judge a part of the inputs; where fewer are inside, the nearest to it count too
        fewest = 8
        order = np.argsort(distance, kind="stable")
        return np.sort(order[: max(fewest, np.count_nonzero(distance == 0))])
