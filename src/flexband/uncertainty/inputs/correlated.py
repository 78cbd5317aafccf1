"""Random inputs that depend on each other: a Gaussian copula.

Every input is an increasing function of a standard normal variable, its score. The scores are
jointly normal, z = L u with independent u and a correlation matrix R = L Lᵀ.

Where the correlations are those of the values, R is that of Nataf's model (Liu and Der Kiureghian,
1986). With the Hermite coefficients a_k of each value as a function of its score, the covariance of
two values is Σ_k a_k b_k k! r^k (Mehler), which is solved for r. Those of ranks have a closed form,
r = 2 sin(π ρ/6).
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from itertools import combinations

import numpy as np
import scipy
from numpy.polynomial import polynomial
from numpy.typing import ArrayLike

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_finite, check_option
from flexband.basics.words import value_text
from flexband.errors import InputError
from flexband.uncertainty.inputs.distribution import Distribution, FrozenDistribution
from flexband.uncertainty.inputs.distributions.scipy_distribution import as_input
from flexband.uncertainty.inputs.fields.field import Field
from flexband.uncertainty.inputs.inputs import Input
from flexband.uncertainty.inputs.pbox import Score


@frozen()
class Correlated:
    """Random inputs that are correlated, as a member of `inputs` under any name.

    Parameters
    ----------
    inputs : name -> distribution, also a frozen one of `scipy.stats`. The response takes each by
        its name.
    correlation : of all pairs, a number; of some pairs, ``{("a", "b"): 0.8}``, where others are
        independent; or a matrix in the order of the inputs.
    of : what the correlation is measured on: "values" (Pearson's; at the midpoints of parameters
        that are intervals), "ranks" (Spearman's) or "scores", the normal variables of the copula.

    Raises
    ------
    InputError
        If an input is an interval, a field or not a distribution, or if there are no variables with
        these correlations.

    Examples
    --------
    >>> pair = fb.Correlated({"a": fb.Normal(0.0, 1.0), "b": fb.Normal(0.0, 1.0)}, correlation=-0.5)
    >>> bands = fb.propagate(lambda a, b: a + b, {"pair": pair}, fb.PCCI(1, 0))
    >>> bands["error_bar"].values.round(4)
    array([-1.,  1.])
    """

    inputs: Mapping[str, Distribution | FrozenDistribution]
    correlation: ArrayLike | Mapping[tuple[str, str], float]
    of: str = "values"

    def __post_init__(self) -> None:
        inputs = self.inputs if isinstance(self.inputs, Mapping) else {}
        distributions = {name: _member(name, member) for name, member in inputs.items()}
        if len(distributions) < 2:
            raise InputError(
                f"Correlated inputs must be a dict of two or more; got {value_text(self.inputs)}"
            )
        check_option("Correlated of", self.of, ("values", "ranks", "scores"))
        object.__setattr__(self, "inputs", distributions)
        object.__setattr__(self, "correlation", _matrix(list(distributions), self.correlation))
        _ = self.factor  # refuses impossible correlations

    @property
    def members(self) -> dict[str, Input]:
        """The inputs as functions of scores, in the order of their names."""
        return {name: Score(distribution) for name, distribution in self._distributions.items()}

    @property
    def _distributions(self) -> dict[str, Distribution]:
        return {name: _member(name, self.inputs[name]) for name in sorted(self.inputs)}

    @cached_property
    def factor(self) -> np.ndarray:
        """L, which makes scores of independent variables, in the order of the names."""
        names = list(self.inputs)
        order = sorted(range(len(names)), key=names.__getitem__)
        correlations = np.array(self.correlation)[np.ix_(order, order)]
        members = list(self._distributions.items())
        scores = np.eye(len(names))
        for i, j in combinations(range(len(names)), 2):
            scores[i, j] = scores[j, i] = self._of_scores(
                members[i], members[j], correlations[i, j]
            )
        _check_definite(list(self._distributions), scores)
        return np.linalg.cholesky(scores)

    def _of_scores(
        self, first: tuple[str, Distribution], second: tuple[str, Distribution], correlation: float
    ) -> float:
        # correlations of scores are below it: equal ones leave no independent variable
        nearly_one = 1 - 1e-9
        terms = 40  # Hermite polynomials of a value as a function of its score
        if self.of == "scores" or correlation == 0:
            return correlation
        if self.of == "ranks":
            return 2 * np.sin(np.pi * correlation / 6)
        members = (distribution.midpoint() for _, distribution in (first, second))
        hermite_terms = (member.hermite_coefficients(terms, 2 * terms)[1:] for member in members)
        a, b = (coefficients / np.linalg.norm(coefficients) for coefficients in hermite_terms)
        series = np.concatenate([[-correlation], a * b])
        low, high = polynomial.polyval([-nearly_one, nearly_one], series)
        if low > 0 or high < 0:
            raise InputError(
                f"the correlation of {first[0]} and {second[0]} must be from "
                f"{low + correlation:.3g} to {high + correlation:.3g} for these "
                f"distributions; got {correlation:g}"
            )
        brentq = scipy.optimize.brentq
        return float(brentq(lambda r: polynomial.polyval(r, series), -nearly_one, nearly_one))


def _member(name: str, member: Distribution | FrozenDistribution) -> Distribution:
    """Return an input that can be correlated; raise `InputError` if it has no distribution."""
    label = f"Correlated input {name!r}"
    allowed = "a random number with a distribution; intervals cannot be correlated"
    try:
        distribution = as_input(member)
    except InputError as error:
        raise InputError(f"{label}: {error}") from None
    if isinstance(distribution, Field) and distribution.random:
        raise InputError(
            f"{label} must be a random number; got {distribution.kind}. Let the response combine "
            "independent fields f and g: r f + √(1 − r²) g has the correlation r with f"
        )
    if not isinstance(distribution, Distribution):
        raise InputError(f"{label} must be {allowed}; got {value_text(distribution)}")
    return distribution


def _matrix(
    names: list[str], correlation: ArrayLike | Mapping[tuple[str, str], float]
) -> tuple[tuple[float, ...], ...]:
    n = len(names)
    # Build the matrix from pairs, from one number for all pairs, or as it is.
    if isinstance(correlation, Mapping):
        matrix = np.eye(n)
        for pair, value in correlation.items():
            if not isinstance(pair, tuple) or len(pair) != 2 or pair[0] == pair[1]:
                raise InputError(f"a correlation must be that of a pair (name, name); got {pair!r}")
            for name in pair:
                check_option(f"a name of the correlation of {pair}", name, names)
            i, j = (names.index(name) for name in pair)
            matrix[i, j] = matrix[j, i] = check_finite(f"correlation of {pair}", value, rank=None)
    elif np.ndim(correlation) == 0:
        matrix = np.full((n, n), check_finite("correlation", correlation, rank=None))
        np.fill_diagonal(matrix, 1.0)
    else:
        matrix = check_finite("correlation", correlation, rank=None)
    if matrix.shape != (n, n):
        raise InputError(f"the correlation matrix must have shape ({n}, {n}); got {matrix.shape}")
    # Check that it is symmetric, with entries that can be correlations.
    for i, j in combinations(range(n), 2):
        pair = f"the correlation of {names[i]} and {names[j]}"
        if matrix[i, j] != matrix[j, i]:
            raise InputError(f"{pair} must be one number; got {matrix[i, j]:g}, {matrix[j, i]:g}")
        if abs(matrix[i, j]) >= 1:
            raise InputError(f"{pair} must be above -1 and below 1; got {matrix[i, j]:g}")
    if np.any(np.diag(matrix) != 1):
        raise InputError("the diagonal of a correlation matrix must be 1; got another number")
    return tuple(tuple(row) for row in matrix.tolist())


def _check_definite(names: list[str], scores: np.ndarray) -> None:
    """Raise `InputError` with entries that contradict each other if R is not positive definite."""
    # of a correlation matrix; below it scores leave no independent variables
    smallest_eigenvalue = 1e-10
    if np.linalg.eigvalsh(scores)[0] > smallest_eigenvalue:
        return
    direction = np.abs(np.linalg.eigh(scores)[1][:, 0])
    part = sorted(np.argsort(-direction)[: max(2, int(np.sum(direction > 0.1 * direction.max())))])
    for triple in combinations(range(len(names)), 3):
        if np.linalg.eigvalsh(scores[np.ix_(triple, triple)])[0] <= smallest_eigenvalue:
            part = triple
            break
    entries = (f"{names[i]}–{names[j]} {scores[i, j]:.4g}" for i, j in combinations(part, 2))
    raise InputError(
        "the correlation matrix of the scores must be positive definite; these entries "
        f"contradict each other: {', '.join(entries)}"
    )
