"""Karhunen–Loève and orthogonal series expansion: fields in orthonormal Legendre polynomials.

The covariance matrix of the coefficients χ_j = ∫ u(x) h_j(x) dx is C_ij = ∬ ρ(x − y) h_i(x) h_j(y)
dx dy. With its eigenvalues λ and eigenvectors, f_i are combinations of the polynomials h_j with
∬ ρ f_i f_k = λ_i δ_ik, and û(x) = Σ ξ_i √λ_i f_i(x). For ever more polynomials these are the
eigenfunctions of the covariance, ∫ ρ(x − y) f(y) dy = λ f(x).

Positions are s, from 0 to D, in correlation lengths from the start of the domain.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.polynomial.legendre import leggauss, legvander

from flexband.errors import InputError
from flexband.uncertainty.inputs.fields.correlation import (
    Correlation,
    check_eigenvalues,
    correlation_matrix,
    correlations,
    equidistant,
)
from flexband.uncertainty.inputs.fields.series import Series, decompose

POINTS = 10
"""Gauss points for a correlation function, added to those for polynomials."""


def karhunen_loeve(
    correlation: Correlation, length: float, domain: tuple[float, float], nodes: int
) -> LegendreModes:
    """Return the Karhunen–Loève expansion, by Galerkin's method on elements.

    Its first terms hold more of the variance, averaged over the domain, than those of any other
    linear expansion.

    Parameters
    ----------
    correlation : function of distance over length.
    length, domain, nodes : those of a `RandomField`; the polynomials are up to 12 per element.

    Raises
    ------
    InputError
        If an argument or the correlations are impossible.
    """
    polynomials = 12  # most on an element of a Karhunen–Loève expansion
    return galerkin(correlation, length, domain, nodes, polynomials)


def orthogonal_series(
    correlation: Correlation, length: float, domain: tuple[float, float], nodes: int
) -> LegendreModes:
    """Return the orthogonal series expansion in Legendre polynomials on the domain.

    Zhang and Ellingwood (1994). The coefficients are correlated; their eigenvectors make them
    independent. Parameters and errors are those of `karhunen_loeve`; `nodes` is the number of
    polynomials.
    """
    return galerkin(correlation, length, domain, nodes, nodes)


def galerkin(
    correlation: Correlation,
    length: float,
    domain: tuple[float, float],
    nodes: int,
    polynomials: int,
) -> LegendreModes:
    """Return the expansion in so many polynomials on each element, at least `nodes` in all."""
    # correlation lengths that an element may hold: it takes four Gauss points for each
    widest = 250.0
    length, x = equidistant(correlation, length, domain, nodes)
    elements = -(-nodes // polynomials)
    width = float(x[-1] - x[0]) / length / elements
    count = -(-nodes // elements)
    if not width <= widest:
        raise InputError(
            f"RandomField correlation_length {length:g} is too short for the domain {domain} and "
            f"nodes={nodes}: {count} polynomials cannot follow {width:.3g} correlation lengths; "
            f"allowed are {widest:g} for each {polynomials} nodes"
        )
    at_nodes = correlation_matrix(correlation, length, x)
    check_eigenvalues(np.linalg.eigvalsh(at_nodes))
    basis = Polynomials(elements, count, width)
    first = basis.starts
    total = elements * width
    inner_breaks = [np.clip(kink, first, first + width) for kink in sorted((1.0, total - 1.0))]
    s, weights = _gauss(np.stack([first, *inner_breaks, first + width], axis=-1), POINTS + count)
    loads = basis.loads(correlation, s.ravel()).reshape(*s.shape, -1)
    at_places = basis.at((s - first[:, None]) / width)
    matrix = np.einsum("egj,egk->ejk", weights[..., None] * at_places, loads)
    matrix = matrix.reshape(elements * count, -1)
    values, vectors = decompose((matrix + matrix.T) / 2, of_correlations=False)
    return LegendreModes(correlation, length, domain, values * length, vectors, basis)


class Polynomials(NamedTuple):
    """Orthonormal Legendre polynomials h_j, `per_element` on equal elements from 0 to D."""

    elements: int
    per_element: int
    width: float

    @property
    def starts(self) -> np.ndarray:
        """The start of each element."""
        return self.width * np.arange(self.elements)

    def at(self, place: np.ndarray) -> np.ndarray:
        """Return those of an element at places from 0 to 1, shape (*place.shape, per_element)."""
        norms = np.sqrt((2 * np.arange(self.per_element) + 1) / self.width)
        return legvander(2 * place - 1, self.per_element - 1) * norms

    def loads(self, correlation: Correlation, s: np.ndarray) -> np.ndarray:
        """Return ∫ ρ(s − y) h_j(y) dy, (s, polynomials), split at kinks: distances 0 and 1."""
        chunk = 64  # positions at which covariances are integrated at once
        parts = [s[k : k + chunk] for k in range(0, len(s), chunk)]
        return np.concatenate([self._loads(correlation, part[:, None]) for part in parts])

    def _loads(self, correlation: Correlation, s: np.ndarray) -> np.ndarray:
        first = self.starts
        inner_breaks = [np.clip(s + d, first, first + self.width) for d in (-1.0, 0.0, 1.0)]
        first, last = (
            np.broadcast_to(end, inner_breaks[0].shape) for end in (first, first + self.width)
        )
        breaks = np.stack([first, *inner_breaks, last], axis=-1)
        y, weights = _gauss(breaks, POINTS + self.per_element // 2 + int(4 * self.width))
        rho = correlations(correlation, s[..., None] - y)
        values = self.at((y - first[..., None]) / self.width)
        return np.einsum("seg,segj->sej", weights * rho, values).reshape(len(s), -1)


@dataclass(frozen=True)
class LegendreModes(Series):
    """û(x) = Σ ξ_i √λ_i f_i(x), with f_i in Legendre polynomials on equal elements.

    The eigenvectors have the coefficients of f_i, one element after the other.
    """

    polynomials: Polynomials

    def basis(self, x: np.ndarray) -> np.ndarray:
        """Return √λ_i f_i at positions x, shape (terms, *x.shape)."""
        elements = self.polynomials.elements
        width = self.polynomials.width
        place = (np.asarray(x) - self.domain[0]) / self.length / width
        element = np.clip(np.floor(place).astype(int), 0, elements - 1)
        values = self.polynomials.at(place - element)
        if elements == 1:
            return np.moveaxis(values @ self._mode_coefficients[0], -1, 0)
        return np.moveaxis(
            np.einsum("...j,...jt->...t", values, self._mode_coefficients[element]), -1, 0
        )

    def places(self) -> np.ndarray:
        """Return equidistant positions, two per polynomial."""
        return np.linspace(*self.domain, 2 * len(self.eigenvectors) + 1)

    def second_moments(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        x = np.asarray(x)
        basis = self.basis(x)
        s = (np.ravel(x) - self.domain[0]) / self.length
        with_terms = self.eigenvectors / self._roots
        covariances = (self.polynomials.loads(self.correlation, s) @ with_terms).T.reshape(
            basis.shape
        )
        return np.cumsum(basis**2, axis=0), np.cumsum(basis * covariances, axis=0)

    @cached_property
    def _mode_coefficients(self) -> np.ndarray:
        """√λ_i f_i as coefficients, shape (elements, polynomials per element, terms)."""
        elements, per_element, _ = self.polynomials
        return (self.eigenvectors * self._roots).reshape(elements, per_element, -1)

    @property
    def _roots(self) -> np.ndarray:
        """√λ_i of positions in correlation lengths."""
        return np.sqrt(self.eigenvalues / self.length)


def _gauss(breaks: np.ndarray, points: int) -> tuple[np.ndarray, np.ndarray]:
    """Return Gauss points and weights on the parts between breaks, shape (…, parts × points)."""
    nodes, weights = leggauss(points)
    middle = (breaks[..., 1:] + breaks[..., :-1])[..., None] / 2
    half = np.diff(breaks)[..., None] / 2
    shape = (*breaks.shape[:-1], -1)
    return (middle + half * nodes).reshape(shape), (half * weights).reshape(shape)
