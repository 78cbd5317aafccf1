"""The slider–crank, whose bands are known."""

from __future__ import annotations

import runpy
from dataclasses import replace

import numpy as np
import xarray as xr
from accuracy_references import Case, bands, moments, normal_rule
from harness import ROOT

import flexband as fb
from flexband.uncertainty.expansion import tensor_points, tensor_values
from flexband.uncertainty.polynomials import chebyshev_values, scaled_chebyshev_zeros
from flexband.uncertainty.space import Space


def slider_crank(
    spectral_radius: float = 0.7,
    E: float = 69e9,
    scatter: float = 0.01,
    tolerance: float = 0.03,
    integration=None,
    elements: int = 3,
) -> Case:
    """Return the paper's mechanism; E [Pa] with its relative scatter, the crank's tolerance."""
    example = runpy.run_path(str(ROOT / "examples" / "slider_crank.py"))

    def builder(crank_length, spring_stiffness, youngs_modulus, poissons_ratio):
        model = example["slider_crank"](
            crank_length, spring_stiffness, youngs_modulus, poissons_ratio
        )
        change = {} if integration is None else {"integration": integration}
        link = replace(model.bodies["link"], elements=elements, **change)
        return replace(model, bodies={**model.bodies, "link": link})

    inputs = example["inputs"] | {
        "crank_length": _within(0.2, tolerance),
        "youngs_modulus": replace(example["inputs"]["youngs_modulus"], mean=E, std=scatter * E),
    }
    response = fb.dynamic_response(
        builder,
        duration=0.6,
        step=1e-3,
        integrator=fb.GeneralizedAlpha(spectral_radius=spectral_radius),
    )

    def orders(random: int, crank: int, spring: int):
        return (
            {"youngs_modulus": random, "poissons_ratio": 0},
            {"crank_length": crank, "spring_stiffness": spring},
        )

    def reference() -> xr.Dataset:
        """Moments by 141 points of E, extremes on a grid of 161 × 5."""
        x, weights = normal_rule(141)
        xi = np.stack([x, np.zeros_like(x)], axis=1)
        nodes = [scaled_chebyshev_zeros(24), scaled_chebyshev_zeros(3)]
        found = _moments(response, inputs, (xi, weights), tensor_points(nodes))
        onto = tensor_values(
            [np.ones((161 * 5, 1))]
            + [
                _interpolation(own, fine)
                for own, fine in zip(nodes, _even_grid(161, 5).T, strict=True)
            ]
        )
        mean, variance = (np.tensordot(onto, v, 1) for v in found)
        labels = {"output": ["F_X", "F_Y"]}
        return bands(mean, variance, (161, 5), ("bound", "output", "time"), labels)

    return Case(response, inputs, [orders(1, 1, 1), orders(2, 1, 1)], reference)


def _within(value: float, tolerance: float) -> fb.Interval:
    return fb.Interval(value * (1 - tolerance), value * (1 + tolerance))


def _moments(response, inputs: dict, rule, eta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return mean and variance at every η, (points, output, time), by a rule (ξ, weights)."""
    xi, weights = rule
    space, found = Space(inputs), []
    for first in range(0, len(eta), 8):
        here = eta[first : first + 8]
        values = space.values(np.tile(xi, (len(here), 1)), np.repeat(here, len(xi), axis=0))
        F = response(**values).values
        found += [moments(weights, part) for part in F.reshape(len(here), len(xi), *F.shape[1:])]
    return np.stack([m for m, _ in found]), np.stack([v for _, v in found])


def _interpolation(nodes: np.ndarray, fine: np.ndarray) -> np.ndarray:
    """Return what takes values at Chebyshev nodes to values at other points."""
    own, at = (chebyshev_values(len(nodes) - 1, points) for points in (nodes, fine))
    return at @ np.linalg.inv(own)


def _even_grid(*counts: int) -> np.ndarray:
    """Return the points of an even grid of [−1, 1]^m, (Π counts, m)."""
    return tensor_points([np.linspace(-1, 1, count) for count in counts])
