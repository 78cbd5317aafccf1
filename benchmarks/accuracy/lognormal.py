"""What polynomials of a lognormal number, and of its logarithm, miss of 1/(1 + x).

The table is in docs/how-to/inputs.md.

The error of the best approximation is relative to the standard deviation of 1/(1 + x), where x has
the mean 1. Orthonormal polynomials come from the procedure of Stieltjes, on a trapezoidal rule in
the standard normal variable in extended precision: moments of x are far out.
"""

from __future__ import annotations

import argparse

import numpy as np

import flexband as fb

ORDERS = 4, 8, 12, 20
SCATTER = 0.3, 1.0
REACH = 45.0
COUNT = 20001
"""Largest standard normal value, and number of points: x^40 matters at 33 for a cv of 1."""


def approximation_errors(
    variable: np.ndarray, weights: np.ndarray, values: np.ndarray
) -> list[float]:
    """Return what polynomials of a variable of each of the orders miss, relative to σ."""
    rest = values - weights @ values
    size = weights @ rest**2
    previous = np.zeros_like(values)
    current = np.ones_like(values)
    errors = []
    for order in range(max(ORDERS) + 1):
        rest = rest - (weights @ (rest * current)) * current
        if order in ORDERS:
            errors.append(float(np.sqrt(weights @ rest**2 / size)))
        successor = variable * current
        for polynomial in (current, previous):
            successor = successor - (weights @ (successor * polynomial)) * polynomial
        previous = current
        current = successor / np.sqrt(weights @ successor**2)
    return errors


def main() -> None:
    """Print the table."""
    argparse.ArgumentParser(description=__doc__).parse_args()
    z = np.linspace(-REACH, REACH, COUNT, dtype=np.longdouble)
    weights = np.exp(-z * z / 2)
    weights /= weights.sum()
    print("| polynomials | cv |", " | ".join(f"order {k}" for k in ORDERS), "|")
    print("| --- " * (2 + len(ORDERS)) + "|")
    for cv in SCATTER:
        mean, std = map(float, fb.LogNormal(1.0, cv=cv).logarithm)
        x = np.exp(mean + std * z)
        for name, variable in (("of the number", x), ("of its logarithm", z)):
            row = approximation_errors(variable, weights, 1 / (1 + x))
            print(f"| {name} | {cv:g} |", " | ".join(f"{error:.1g}" for error in row), "|")


if __name__ == "__main__":
    main()
