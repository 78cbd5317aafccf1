"""Correlation functions of homogeneous random fields, of the distance over the length."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.special import gammaln, kve

from flexband.basics.arguments import frozen
from flexband.basics.checks import (
    check_finite,
    check_function,
    check_integer,
    check_numbers,
    check_positive,
)
from flexband.basics.user_functions import evaluate_function
from flexband.basics.words import number_of
from flexband.errors import InputError

Correlation = Callable[[np.ndarray], np.ndarray]

MAX_NODES = 4000
"""Of a field: the correlations of more do not fit into the memory of a small computer."""

ROUNDING = 1e-8
"""Of eigenvalues of a matrix of correlations, relative to the largest."""


def squared_exponential(distance: np.ndarray) -> np.ndarray:
    """Return exp(−d²), Eq. (30): smooth fields."""
    return np.exp(-(check_finite("distance", distance, rank=None) ** 2))


def exponential(distance: np.ndarray) -> np.ndarray:
    """Return exp(−|d|): continuous, rough fields."""
    return np.exp(-np.abs(check_finite("distance", distance, rank=None)))


def triangular(distance: np.ndarray) -> np.ndarray:
    """Return 1 − |d| up to d = 1 and 0 beyond: moving averages over the length of white noise."""
    return np.maximum(1.0 - np.abs(check_finite("distance", distance, rank=None)), 0.0)


@frozen()
class Matern:
    """The Matérn function 2^(1−ν)/Γ(ν) s^ν K_ν(s), s = √(2ν) |d|, of smoothness ν.

    Fields have as many derivatives as there are whole numbers below ν, besides 0. It is
    `exponential` for ν = 1/2, and approaches exp(−d²/2) for large ν, which is
    `squared_exponential` of a correlation length that is √2 times as large.

    Raises
    ------
    InputError
        If ν is not above 0, or above 100.

    Examples
    --------
    >>> matern = fb.fields.Matern(1.5)
    >>> matern(np.array([0.0, 1.0])).round(4)
    array([1.    , 0.4834])
    >>> fb.RandomField(1.0, 0.1, 2.0, domain=(0.0, 1.0), correlation=matern).dimension
    2
    """

    nu: float

    def __post_init__(self) -> None:
        largest_nu = 100.0  # above it, the function is the limit up to 0.005
        nu = float(check_numbers("Matern nu", self.nu))
        if not 0 < nu <= largest_nu:
            raise InputError(
                f"Matern nu must be above 0 and at most {largest_nu:g}; got {nu:g} "
                "(squared_exponential is the limit)"
            )
        object.__setattr__(self, "nu", nu)

    def __call__(self, distance: np.ndarray) -> np.ndarray:
        nu = self.nu
        s = np.sqrt(2 * nu) * np.abs(check_finite("distance", distance, rank=None))
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            bessel = kve(nu, s)
            power = (1 - nu) * np.log(2) - gammaln(nu) + nu * np.log(s) + np.log(bessel) - s
        series_mask = ~np.isfinite(bessel)  # K_ν overflows, where two terms of its series suffice
        series = 1 - s**2 / (4 * (nu - 1)) * (1 - s**2 / (8 * (nu - 2))) if nu > 2 else 1.0
        return np.where(
            series_mask, series, np.exp(np.minimum(np.where(series_mask, 0.0, power), 0.0))
        )


def correlations(correlation: Correlation, distance: np.ndarray) -> np.ndarray:
    """Return a user's correlations; raise `InputError` if they are no numbers of this shape."""
    name = "RandomField correlation"
    values = check_finite(
        name, evaluate_function(correlation, distance, name), "numbers", rank=None
    )
    if values.shape != distance.shape:
        raise InputError(f"{name} must return shape {distance.shape}; got {values.shape}")
    return values


def equidistant(
    correlation: Correlation, length: float, domain: tuple[float, float], nodes: int
) -> tuple[float, np.ndarray]:
    """Return the correlation length and equidistant nodes on the domain; refuse misfits."""
    # fewest correlation lengths in a domain: squares of polynomials over fewer overflow
    min_lengths = 1e-305
    check_function("RandomField correlation", correlation)
    name = "RandomField correlation_length"
    length = float(check_positive(name, check_numbers(name, length)))
    start, end = check_numbers("RandomField domain", domain, 2)
    if start >= end:
        raise InputError(f"RandomField domain must run upwards; got {domain}")
    lengths = float(end - start) / length
    if not min_lengths <= lengths < np.inf:
        which = "short" if lengths > 1 else "long"
        raise InputError(f"{name} {length:g} is too {which} for {domain}")
    return length, np.linspace(start, end, check_integer("RandomField nodes", nodes, 2, MAX_NODES))


def correlation_matrix(correlation: Correlation, length: float, x: np.ndarray) -> np.ndarray:
    """Return the correlations at positions x with each other, symmetric and 1 at distance 0."""
    matrix = correlations(correlation, (x[:, None] - x) / length)
    if np.abs(np.diagonal(matrix) - 1).max() > ROUNDING:
        diagonal_entry = np.diagonal(matrix)[np.abs(np.diagonal(matrix) - 1).argmax()]
        raise InputError(f"RandomField correlation must be 1 at distance 0; got {diagonal_entry:g}")
    i, j = np.unravel_index(np.abs(matrix - matrix.T).argmax(), matrix.shape)
    if abs(matrix[i, j] - matrix[j, i]) > ROUNDING:
        raise InputError(
            "RandomField correlation must be the same at distances d and -d; got "
            f"{matrix[i, j]:g} and {matrix[j, i]:g} at {abs(x[i] - x[j]) / length:g}"
        )
    return matrix


def check_eigenvalues(values: np.ndarray) -> None:
    """Raise `InputError` if a matrix of correlations is not positive semidefinite."""
    if values.min() < -ROUNDING * values.max():
        raise InputError(
            "RandomField correlation must be positive semidefinite; the matrix of correlations of "
            f"{number_of(len(values), 'position')} has the eigenvalue {values.min():.3g}"
        )


def twice_differentiable(correlation: Correlation) -> bool:
    """Return whether fields have second derivatives: 3 − 4ρ(h) + ρ(2h) ~ h⁴ for small h."""
    if isinstance(correlation, Matern):
        return correlation.nu > 2
    rho = correlations(correlation, np.array([0.005, 0.01, 0.02]))
    fine, coarse = 3 - 4 * rho[:2] + rho[1:]
    return bool(coarse > 0 and abs(fine) < coarse / 2**3.8)
