"""The plain hybrid expansion: the values of a response at each time are expanded directly."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from flexband.uncertainty.expansions.bounds.extremes import extremes
from flexband.uncertainty.expansions.expansion import Extremes
from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.substitution import Substitution, substitute


@dataclass(frozen=True)
class DirectExpansion:
    """The `Expansion` of outputs by values at fixed times, one output after the other, Eq. (11)."""

    outputs: np.ndarray
    values: HybridExpansion

    @property
    def carriers(self) -> int:
        """None."""
        return 0

    @property
    def hybrid(self) -> HybridExpansion:
        """The expansion of the values."""
        return self.values

    def evaluate(self, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        return self._by_output(self.values.evaluate(xi, eta))

    def evaluate_quickly(self, xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
        return self._by_output(self.values.evaluate_in_thread(xi, eta))

    def moments(self, eta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        mean, std = self.values.moments(eta)
        return self._by_output(mean), self._by_output(std)

    def extremes(self, sigmas: Sequence[float]) -> list[Extremes]:
        bounds = extremes(self.values, sigmas)
        values = [self._by_output(e.values) for e in bounds]
        places = [e.places.reshape(*v.shape, -1) for e, v in zip(bounds, values, strict=True)]
        return list(map(Extremes, values, places))

    def integration_error(self, bounds: Sequence[Extremes], sigmas: Sequence[float]) -> np.ndarray:
        return np.zeros((len(sigmas), *bounds[0].values.shape))

    def select(
        self, outputs: np.ndarray, times: slice | np.ndarray = slice(None)
    ) -> DirectExpansion:
        which = np.searchsorted(self.outputs, outputs)
        return DirectExpansion(outputs, self.values.of_rows(len(self.outputs), which, times))

    def substitute(
        self, substitutions: Mapping[int, Substitution], families: Sequence[Family]
    ) -> DirectExpansion:
        return replace(self, values=substitute(self.values, substitutions, families))

    def of_hybrid(self, hybrid: HybridExpansion) -> DirectExpansion:
        return replace(self, values=hybrid)

    def arrays(self) -> dict[str, np.ndarray]:
        return {"outputs": self.outputs, **self.values.arrays()}

    @staticmethod
    def of_arrays(
        inputs: Sequence[Family], outputs: np.ndarray, **values: np.ndarray
    ) -> DirectExpansion:
        return DirectExpansion(outputs, HybridExpansion.of_arrays(inputs, **values))

    def _by_output(self, values: np.ndarray) -> np.ndarray:
        return values.reshape(len(values), len(self.outputs), -1)
