"""Families of responses with a step and a mesh, of which the whole error of the bands counts.

In half of the cases step and mesh are given, and their error is only expected; in the others they
are left out, and the method chooses them.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr

from benchmarks.honesty.problems import Case, Problem, case

BOTH = ("step", "elements")


@dataclass(frozen=True)
class Law:
    """Relative errors of time and amplitude: of orders two and three in h, and four in 1/n."""

    time: Sequence[float]
    amplitude: Sequence[float]

    @staticmethod
    def draw(rng: np.random.Generator) -> Law:
        time = 10 ** rng.uniform(-4, -1.7)
        amplitude = 10 ** rng.uniform(-3, -0.7)
        parts = rng.uniform([0.3, -0.3, 0.0], [1.0, 0.3, 1.0], (2, 3)) * rng.choice([-1, 1], (2, 1))
        return Law(time * parts[0], amplitude * parts[1])

    def errors(self, h: float, n: int) -> tuple[float, float]:
        """Return the error of time and that of the amplitude."""
        powers = np.array([h**2, h**3, n**-4.0])
        return float(self.time @ powers), float(self.amplitude @ powers)


@dataclass(frozen=True)
class DiscretizedResponse:
    """A response on a step h and a mesh of n parts, 1 on the coarsest; see `Law`."""

    at: Callable[[float, float], Callable[..., xr.DataArray]]
    law: Law
    free_parts: Sequence[str]
    h: float = 1.0
    n: int = 1

    def left_out(self, **values: np.ndarray) -> list[str]:
        return list(self.free_parts)

    def refinements(self, **values: np.ndarray) -> Mapping[str, DiscretizedResponse]:
        return {"step": replace(self, h=self.h / 2), "elements": replace(self, n=2 * self.n)}

    def discretization(self, **values: np.ndarray) -> dict[str, float]:
        return {"step": self.h, "elements": self.n}

    def __call__(self, **values: np.ndarray) -> xr.DataArray:
        return self.at(*self.law.errors(self.h, self.n))(**values)


def stepped_problem(
    makers: Sequence[Callable[[np.random.Generator], Problem]],
    family: str,
    seed: int,
    rng: np.random.Generator,
) -> Case:
    """Return a problem of another family with an error of step and mesh."""
    problem = makers[rng.integers(len(makers))](rng)
    law = Law.draw(rng)
    units = int(rng.integers(2**31))

    def make_case(time: float, amplitude: float) -> Case:
        inexact = replace(problem, time_error=time, amplitude_error=amplitude)
        return case(family, seed, inexact, np.random.default_rng(units))

    exact = make_case(0.0, 0.0)
    free_parts = BOTH if rng.random() < 0.5 else ()
    h = 1.0 if free_parts else 10 ** rng.uniform(-1.5, 0)
    response = DiscretizedResponse(lambda *errors: make_case(*errors).response, law, free_parts, h)
    return replace(exact, response=response, exact_steps=True)
