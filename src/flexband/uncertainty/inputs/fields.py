"""Random fields, discretized by expansion optimal linear estimation (EOLE).

Li and Der Kiureghian (1993); Eqs. (29)–(31), with the correlation matrix of unit variance.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import ClassVar

import numpy as np

from flexband.errors import (
    InputError,
    finite,
    function,
    numbers,
    plausible_spread,
    positive,
    returned,
    whole,
)
from flexband.uncertainty.expansions.threads import in_threads
from flexband.uncertainty.inputs.correlation import Correlation, exponential, squared_exponential
from flexband.uncertainty.inputs.inputs import FunctionOfPosition, Input

MAX_NODES = 4000
"""Of a field: the correlations of more do not fit into the memory of a small computer."""


def correlations(correlation: Correlation, distance: np.ndarray) -> np.ndarray:
    """Return a user's correlations; raise `InputError` if they are no numbers of this shape."""
    name = "RandomField correlation"
    values = finite(name, returned(correlation, distance, name), "numbers", rank=None)
    if values.shape != distance.shape:
        raise InputError(f"{name} must return shape {distance.shape}; got {values.shape}")
    return values


@dataclass(frozen=True)
class Eole:
    """A field of zero mean and unit variance as Σ ξ_i b_i(x), b_i(x) = ρ(x)ᵀ φ_i / √χ_i.

    Attributes
    ----------
    correlation, length : ρ as a function of distance over length [m].
    nodes : positions x_1 … x_p [m].
    eigenvalues, eigenvectors : χ_i, the largest of the correlation matrix, and φ_i in columns.
    """

    correlation: Correlation
    length: float
    nodes: np.ndarray
    eigenvalues: np.ndarray
    eigenvectors: np.ndarray

    @staticmethod
    def of(field: RandomField, nodes: np.ndarray) -> Eole:
        """Return the expansion with the terms of a field, or as many as its tolerance requires.

        The tolerance is on the largest variance error at the nodes and halfway between them.
        """
        rho, length, terms = field.correlation, field.correlation_length, field.terms
        found = []
        matrix = correlations(rho, (nodes[:, None] - nodes) / length)
        in_threads(lambda own: found.append(np.linalg.eigh(own)), [matrix])
        ((values, vectors),) = found
        values, vectors = values[::-1], vectors[:, ::-1]
        usable = int(np.sum(values > 1e-12 * values[0]))
        full = Eole(rho, length, nodes, values[:usable], vectors[:, :usable])
        if terms is None:
            places = np.sort(np.concatenate([nodes, (nodes[1:] + nodes[:-1]) / 2]))
            errors = 1 - np.cumsum(full.basis(places) ** 2, axis=0)
            enough = np.flatnonzero(errors.max(axis=1) <= field.tolerance)
            if not len(enough):
                raise InputError(
                    f"RandomField tolerance {field.tolerance:g} on the variance error is not met "
                    f"by {usable} terms on {len(nodes)} nodes; "
                    f"the best is {errors.max(axis=1).min():.3g}"
                )
            terms = int(enough[0]) + 1
        if terms > usable:
            raise InputError(f"RandomField terms must be {usable} or less here; got {terms}")
        return Eole(rho, length, nodes, values[:terms], vectors[:, :terms])

    def basis(self, x: np.ndarray) -> np.ndarray:
        """Return b_i at positions x [m], shape (terms, *x.shape), Eq. (29)."""
        rho = correlations(self.correlation, (np.asarray(x)[..., None] - self.nodes) / self.length)
        return np.moveaxis(rho @ self.eigenvectors / np.sqrt(self.eigenvalues), -1, 0)


@dataclass(frozen=True)
class RandomField(Input):
    """A homogeneous Gaussian random field along a line, discretized by EOLE.

    Parameters
    ----------
    mean, std : mean and standard deviation at every position.
    correlation_length : a of Eq. (30) [m].
    domain : positions (start, end) [m] on which the field is used. If None, `propagate` finds it by
        runs at the means and at the ends of the intervals, in which it records the positions where
        the response evaluates the field.
    terms : number of terms, each with one standard variable; if None, as few as `tolerance` allows.
    tolerance : largest variance error, as a fraction of the variance.
    correlation : function of distance over correlation length.
    nodes : number of equidistant EOLE nodes on the domain; if None, eight per correlation length
        and at least 21.

    Attributes
    ----------
    correlations : correlation functions by name. A surrogate can be saved if those of its fields
        are among them; add yours under a new name before saving and before loading.

    Raises
    ------
    InputError
        If a number is out of its range or the expansion is not possible.
    """

    mean: float
    std: float
    correlation_length: float
    domain: tuple[float, float] | None = None
    terms: int | None = None
    tolerance: float = 0.05
    correlation: Correlation = field(default=squared_exponential)
    nodes: int | None = None

    correlations: ClassVar[dict[str, Correlation]] = {
        "squared_exponential": squared_exponential,
        "exponential": exponential,
    }

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in ("std", "correlation_length", "tolerance"):
            positive(f"RandomField {name}", getattr(self, name))
        plausible_spread("RandomField std", self.std, self.mean)
        if self.tolerance >= 1:
            raise InputError(f"RandomField tolerance must be below 1; got {self.tolerance:g}")
        function("RandomField correlation", self.correlation)
        for name, least, most in (("terms", 1, None), ("nodes", 2, MAX_NODES)):
            if (count := getattr(self, name)) is not None:
                count = whole(f"RandomField {name}", count, least, most)
                object.__setattr__(self, name, count)
        if self.domain is not None:
            start, end = numbers("RandomField domain [m]", self.domain, 2)
            if start >= end:
                raise InputError(f"RandomField domain must run upwards; got {self.domain}")

    @cached_property
    def expansion(self) -> Eole:
        """The EOLE expansion of the standardized field, which must have a domain."""
        if self.domain is None:
            raise InputError("RandomField domain must be given here; got None")
        start, end = self.domain
        count = self.nodes or max(21, np.ceil(8 * (end - start) / self.correlation_length) + 1)
        if count > MAX_NODES:
            raise InputError(
                f"RandomField nodes must be {MAX_NODES} or less; got {count:.0f}, eight per "
                f"correlation length of {self.correlation_length:g} m on ({start:g}, {end:g}) m"
            )
        return Eole.of(self, np.linspace(start, end, int(count)))

    @property
    def dimension(self) -> int:
        """Number of standard variables, one per term."""
        return len(self.expansion.eigenvalues)

    def variance_error(self, x: np.ndarray) -> np.ndarray:
        """Return the variance that the expansion lacks at positions x [m], Eq. (31), over σ²."""
        return 1 - np.sum(self.expansion.basis(x) ** 2, axis=0)

    def largest_variance_error(self) -> float:
        """Return the largest variance error on the domain, on 1001 positions."""
        start, end = self.expansion.nodes[[0, -1]]
        return float(self.variance_error(np.linspace(start, end, 1001)).max())

    def standard(self, value: np.ndarray) -> np.ndarray:
        """Return `value`: a field is given by its standard variables, shape (n, terms)."""
        if value.ndim != 2 or value.shape[1] != self.dimension:
            raise InputError(
                f"a RandomField is given by standard variables of shape (n, {self.dimension}); "
                f"got shape {value.shape}"
            )
        return value

    def value(self, standard: np.ndarray) -> FunctionOfPosition:
        """Return the samples as a function of position, Eq. (29).

        The function takes positions of shape (points,) or (n, points) and returns shape
        (n, points); it raises `InputError` for other positions and those outside the domain.
        """
        start, end = self.expansion.nodes[[0, -1]]
        slack = 1e-9 * (end - start)

        def samples(x: np.ndarray) -> np.ndarray:
            x = np.atleast_2d(finite("RandomField: positions [m]", x, rank=None))
            if x.ndim > 2 or len(x) not in (1, len(standard)):
                shapes = f"(points,) or ({len(standard)}, points)"
                raise InputError(f"RandomField: positions must have shape {shapes}; got {x.shape}")
            outside = (x < start - slack) | (x > end + slack)
            if np.any(outside):
                raise InputError(
                    f"RandomField is evaluated at {x[outside][0]:g} m, outside its "
                    f"domain ({start:g}, {end:g}) m; give a larger domain"
                )
            basis = self.expansion.basis(x)
            return self.mean + self.std * np.einsum("nt,tnp->np", standard, basis)

        return samples
