"""Mechanisms with known bands: the slider–crank and a four-bar linkage with ten inputs."""

from __future__ import annotations

import itertools
import math
import runpy
from dataclasses import replace

import numpy as np
import xarray as xr

import flexband as fb
from benchmarks.accuracy.references import Case, bands, moments, normal_rule
from benchmarks.harness import ROOT
from flexband.uncertainty.expansions.bounds.scan import lobatto
from flexband.uncertainty.expansions.hybrid import tensor_points, tensor_values
from flexband.uncertainty.expansions.polynomials import chebyshev_values, scaled_chebyshev_zeros
from flexband.uncertainty.inputs.space import Space

START = 0.6  # rad: initial angle of the crank of the four-bar linkage


def slider_crank(
    spectral_radius: float = 0.7,
    E: float = 69e9,
    scatter: float = 0.01,
    tolerance: float = 0.03,
    integration=None,
    elements: int = 3,
    displacement: bool = False,
    step: float = 1e-3,
) -> Case:
    """Return the slider–crank of the paper.

    `E` [Pa] has the relative standard deviation `scatter`; `tolerance` is the relative tolerance of
    the crank's length. Outputs are the reactions at A, or the position of the link's middle if
    `displacement`, every millisecond.
    """
    sensors = {"middle": fb.Position("link.middle")} if displacement else {"F": fb.Reaction("A")}
    example = runpy.run_path(str(ROOT / "examples" / "paper" / "slider_crank.py"))

    def builder(crank_length, spring_stiffness, youngs_modulus, poissons_ratio):
        model = example["slider_crank"](
            crank_length, spring_stiffness, youngs_modulus, poissons_ratio
        )
        change = {} if integration is None else {"integration": integration}
        link = replace(model.bodies["link"], elements=elements, **change)
        return replace(model, bodies={**model.bodies, "link": link}, sensors=sensors)

    inputs = example["inputs"] | {
        "crank_length": _tolerance_interval(0.2, tolerance),
        "youngs_modulus": replace(example["inputs"]["youngs_modulus"], mean=E, std=scatter * E),
    }
    response = fb.dynamic_response(
        builder,
        duration=0.6,
        step=step,
        output_step=1e-3,
        integrator=fb.GeneralizedAlpha(spectral_radius=spectral_radius),
    )

    def orders(random: int, crank: int, spring: int):
        return (
            {"youngs_modulus": random, "poissons_ratio": 0},
            {"crank_length": crank, "spring_stiffness": spring},
        )

    def reference() -> xr.Dataset:
        """Return bands from moments at 141 points of E and extremes on a grid of 161 × 5 points."""
        x, weights = normal_rule(141)
        xi = np.stack([x, np.zeros_like(x)], axis=1)
        nodes = [scaled_chebyshev_zeros(24), scaled_chebyshev_zeros(3)]
        node_moments = _moments(response, inputs, (xi, weights), tensor_points(nodes))
        onto = tensor_values(
            [np.ones((161 * 5, 1))]
            + [
                _interpolation(axis_nodes, fine)
                for axis_nodes, fine in zip(nodes, _even_grid(161, 5).T, strict=True)
            ]
        )
        mean, variance = (np.tensordot(onto, v, 1) for v in node_moments)
        labels = {"output": [f"{name}_{axis}" for name in sensors for axis in "XY"]}
        return bands(mean, variance, (161, 5), ("bound", "output", "time"), labels)

    return Case(response, inputs, [orders(1, 1, 1), orders(2, 1, 1)], reference)


def four_bar(
    coupler_length,
    crank_length,
    rocker_length,
    ground_length,
    spring_stiffness,
    youngs_modulus,
    density,
    load,
    friction,
    speed,
):
    """Return a crank–rocker with a slender coupler and with load, spring, friction at the rocker.

    Lengths are in m, stiffness in N m/rad, load in kg, friction in N m s/rad, speed in rad/s.
    """
    size = {"height": 0.012, "width": 0.012}
    bar = 7800.0 * 0.012**2 * rocker_length
    mass = bar + load
    centre = (bar / 2 + load) * rocker_length / mass
    about_pin = (bar / 3 + load) * rocker_length**2
    return fb.Mechanism(
        bodies={
            "crank": fb.RigidBody.bar(length=crank_length, density=7800.0, angle=START, **size),
            "coupler": fb.Beam(
                length=coupler_length, height=0.006, width=0.012, density=density,
                youngs_modulus=youngs_modulus, poissons_ratio=0.3, elements=3,
                start=(0.083, 0.056), angle=0.5, integration=fb.sections.SelectiveIntegration(),
            ),
            "rocker": fb.RigidBody(
                mass=mass, inertia=about_pin - mass * centre**2, center=(centre, 0.0),
                points={"start": (0.0, 0.0), "end": (rocker_length, 0.0)},
                position=(0.4, 0.0), angle=1.5,
            ),
        },
        joints={
            "A": fb.Revolute("crank.start", (0.0, 0.0)),
            "B": fb.Revolute("coupler.start", "crank.end"),
            "C": fb.Revolute("coupler.end", "rocker.end"),
            "D": fb.Revolute("rocker.start", (ground_length, 0.0)),
            "motor": fb.PrescribedRotation("crank", lambda t: START + speed * t),
        },
        loads={
            "spring": fb.TorsionSpring(
                "rocker", (0.0, 0.0), spring_stiffness, rest_angle=1.5, damping=friction
            )
        },
        sensors={"F": fb.Reaction("A"), "bend": fb.Deflection("coupler")},
    )  # fmt: skip


def ten_inputs() -> Case:
    """Return the four-bar linkage with tolerances of all lengths; its coupler oscillates at 88 Hz.

    Every input changes the forces by 0.5 to 4 %. The bending of the coupler is mostly oscillation;
    at the end its phase varies by ±3 rad with the coupler's length and as much with its material.
    """
    inputs = {
        "coupler_length": _tolerance_interval(0.4, 0.005),
        "crank_length": _tolerance_interval(0.1, 0.005),
        "rocker_length": _tolerance_interval(0.25, 0.005),
        "ground_length": _tolerance_interval(0.4, 0.005),
        "spring_stiffness": _tolerance_interval(5.0, 0.03),
        "youngs_modulus": _normal_input(206e9, 0.02),
        "density": _normal_input(7850.0, 0.01),
        "load": _normal_input(0.5, 0.02),
        "friction": _normal_input(0.1, 0.05),
        "speed": _normal_input(5 * np.pi, 0.005),
    }
    response = fb.dynamic_response(
        four_bar, duration=0.6, step=1e-3, integrator=fb.GeneralizedAlpha(spectral_radius=0.7)
    )

    main = {"coupler_length", "ground_length", "spring_stiffness"}
    main |= {"youngs_modulus", "density", "speed"}
    random, interval = (
        {
            name: int(name in main)
            for name, distribution in inputs.items()
            if distribution.random == kind
        }
        for kind in (True, False)
    )
    return Case(response, inputs, [(random, interval)], lambda: _ten_inputs(response, inputs))


def _ten_inputs(response, inputs: dict, coupler: int = 8, points: int = 16) -> xr.Dataset:
    """Return bands of the four-bar linkage: moments by a product rule in ξ, interpolated over η.

    The coupler's frequency √(E/ρ)/L² depends on one direction of ξ and one of η, along which the
    rules are dense. The response is smooth in the four other variables of each kind: the rule over
    ξ has degree 3, and the interpolation over η is quadratic with all products of two variables.
    Bands from 11 × 3⁴ × 160 runs instead of these 8 × 15 × 128 differ by 0.002 %. Moments from 8192
    Sobol points ξ differ by 0.02 %, half of the difference of 4096 points.
    """
    normal_points, weights = normal_rule(points, 4.8)
    smooth = np.concatenate([2 * np.eye(4), -2 * np.eye(4)])
    xi = np.concatenate(
        [np.repeat(normal_points, 8)[:, None], np.tile(smooth, (points, 1))], axis=1
    )
    turn = np.array([[2.0, -1.0], [1.0, 2.0]]) / math.sqrt(5)  # scatter of ln E and ln ρ
    xi[:, :2] = xi[:, :2] @ turn
    nodes = lobatto(coupler)
    corners = _quadratic_points()
    eta = np.concatenate(
        [np.repeat(nodes, len(corners))[:, None], np.tile(corners, (coupler, 1))], axis=1
    )
    moment_arrays = _moments(response, inputs, (xi, np.repeat(weights, 8) / 8), eta)
    counts = (81, 5, 5, 5, 5)
    dense_matrix = _interpolation(nodes, np.linspace(-1, 1, counts[0]))
    quadratic_matrix = _quadratic(_even_grid(*counts[1:])) @ np.linalg.inv(_quadratic(corners))
    shape = (coupler, len(corners), *moment_arrays[0].shape[1:])
    moment_arrays = [np.tensordot(dense_matrix, v.reshape(shape), 1) for v in moment_arrays]
    labels = {"output": ["F_X", "F_Y", "bend"]}
    parts = []
    for first in range(0, shape[-1], 40):
        grids = [
            np.einsum("gc,acot->agot", quadratic_matrix, v[..., first : first + 40], optimize=True)
            for v in moment_arrays
        ]
        flat = (g.reshape(-1, *g.shape[2:]) for g in grids)
        parts.append(bands(*flat, counts, ("bound", "output", "time"), labels))
    return xr.concat(parts, "time")


def _tolerance_interval(value: float, tolerance: float) -> fb.Interval:
    return fb.Interval(value * (1 - tolerance), value * (1 + tolerance))


def _normal_input(value: float, scatter: float) -> fb.Normal:
    return fb.Normal(value, scatter * value)


def _moments(response, inputs: dict, rule, eta: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return mean and variance at every η by a rule (ξ, weights), (points, output, time).

    The columns of ξ and η are those of the inputs in the order in which they are given.
    """
    space = Space(inputs)
    moment_pairs = []
    xi = _sort_columns(rule[0], inputs, random=True)
    weights = rule[1]
    eta = _sort_columns(eta, inputs, random=False)
    for first in range(0, len(eta), 8):
        block = eta[first : first + 8]
        values = space.values(np.tile(xi, (len(block), 1)), np.repeat(block, len(xi), axis=0))
        F = response(**values).values
        moment_pairs += [
            moments(weights, part) for part in F.reshape(len(block), len(xi), *F.shape[1:])
        ]
    return np.stack([m for m, _ in moment_pairs]), np.stack([v for _, v in moment_pairs])


def _sort_columns(points: np.ndarray, inputs: dict, *, random: bool) -> np.ndarray:
    """Return points with their columns in the order of the inputs' names, as `Space` has them."""
    names = [name for name, distribution in inputs.items() if distribution.random == random]
    return points[:, np.argsort(names)]


def _interpolation(nodes: np.ndarray, fine: np.ndarray) -> np.ndarray:
    """Return the matrix that interpolates values at Chebyshev nodes to other points."""
    node_values, point_values = (
        chebyshev_values(len(nodes) - 1, points) for points in (nodes, fine)
    )
    return point_values @ np.linalg.inv(node_values)


def _even_grid(*counts: int) -> np.ndarray:
    """Return the points of a uniform grid of [−1, 1]^m, shape (Π counts, m)."""
    return tensor_points([np.linspace(-1, 1, count) for count in counts])


def _quadratic_points() -> np.ndarray:
    """Return fifteen points that determine a quadratic of four variables, shape (15, 4)."""
    unit = np.eye(4)
    pairs = [unit[i] + unit[j] for i, j in itertools.combinations(range(4), 2)]
    return np.concatenate([np.zeros((1, 4)), unit, -unit, pairs])


def _quadratic(points: np.ndarray) -> np.ndarray:
    """Return the terms of a quadratic at points (n, 4), shape (n, 15)."""
    products = itertools.combinations_with_replacement(points.T, 2)
    return np.stack([np.ones(len(points)), *points.T, *(a * b for a, b in products)], axis=1)
