"""The parts that are made, as independent samples of tolerances and random inputs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flexband.basics.checks import check_instance
from flexband.requirements.scatter import Scatter, ScatteringTolerances
from flexband.uncertainty.inputs.correlated import Correlated
from flexband.uncertainty.inputs.distributions.bounded import Uniform
from flexband.uncertainty.inputs.inputs import Interval
from flexband.uncertainty.inputs.sampling import of_normals
from flexband.uncertainty.inputs.space import Space


@dataclass(frozen=True)
class Parts:
    """How the inputs of parts are distributed."""

    space: Space
    tolerances: ScatteringTolerances
    scatter: str  # in words: "length: Uniform(lower=0.9, upper=1.1), assumed"

    @staticmethod
    def from_scatter(space: Space, scatter: Scatter) -> Parts:
        """Return the parts of a space; a tolerance without a distribution is uniform."""
        check_instance("scatter", scatter, Mapping, '{"length": fb.analysis.Capability(cp=1.33)}')
        groups = [group.members for group in scatter.values() if isinstance(group, Correlated)]
        scatter_names = set(scatter).union(*groups)
        assumed = {
            name: Uniform(interval.lower, interval.upper)
            for name, interval in space.of_kind(random=False).items()
            if isinstance(interval, Interval) and name not in scatter_names
        }
        words = [f"{name}: {distribution!r}" for name, distribution in scatter.items()]
        words += [f"{name}: {distribution!r}, assumed" for name, distribution in assumed.items()]
        tolerances = ScatteringTolerances.from_scatter({**assumed, **scatter}, space)
        words += [f"{name}: {pair!r}" for name, pair in space.plays.items()]
        return Parts(space, tolerances, "; ".join(words))

    def samples(self, count: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
        """Return ξ and η of independent parts; the first ones are the same for any count."""
        n = self.space.random_dimension
        tolerances = self.tolerances
        u = np.random.default_rng(seed).standard_normal((count, n + tolerances.dimension))
        return of_normals(u[:, :n], self.space.families), tolerances.eta(u[:, n:])
