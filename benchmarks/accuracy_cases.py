"""Studies whose bands are known: the slider–crank in several versions, and formulas that ring."""

from __future__ import annotations

import runpy
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import xarray as xr
from harness import ROOT

import flexband as fb
from flexband.uncertainty.expansion import tensor_points, tensor_values
from flexband.uncertainty.polynomials import chebyshev_values, scaled_chebyshev_zeros
from flexband.uncertainty.space import Space

TAU = 2 * np.pi
TIMES = np.arange(1001) * 0.02  # twenty periods of 1 Hz
FORMULA_INPUTS = {"x": fb.Normal(0.0, 1.0), "e": fb.Interval(-1.0, 1.0)}


@dataclass(frozen=True)
class Case:
    """A study, the orders to try, and the bands that count as true.

    Attributes
    ----------
    orders : of the phase-resolved method, by input.
    reference : returns the true bands.
    """

    response: Callable[..., xr.DataArray]
    inputs: dict
    orders: list[tuple[dict[str, int], dict[str, int]]]
    reference: Callable[[], xr.Dataset]


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
        "crank_length": fb.Interval(0.2 * (1 - tolerance), 0.2 * (1 + tolerance)),
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
        """Moments by the trapezoidal rule on 141 points of E, extremes on a grid of 161 × 5."""
        x, weights = _trapezoids(141)
        nodes = [scaled_chebyshev_zeros(24), scaled_chebyshev_zeros(3)]
        moments = []
        for eta in tensor_points(nodes):
            xi = np.stack([x, np.zeros_like(x)], axis=1)
            values = Space(inputs).values(xi, np.tile(eta, (len(x), 1)))
            F = response(**values).values
            mean = np.tensordot(weights, F, 1)
            moments.append((mean, np.tensordot(weights, (F - mean) ** 2, 1)))
        onto = tensor_values(
            [np.ones((161 * 5, 1))]
            + [
                chebyshev_values(len(own) - 1, fine)
                @ np.linalg.inv(chebyshev_values(len(own) - 1, own))
                for own, fine in zip(
                    nodes,
                    tensor_points([np.linspace(-1, 1, 161), np.linspace(-1, 1, 5)]).T,
                    strict=True,
                )
            ]
        )
        mean, variance = (np.tensordot(onto, np.stack(v), 1) for v in zip(*moments, strict=True))
        labels = {"output": ["F_X", "F_Y"]}
        return _bands(mean, variance, ("bound", "output", "time"), labels)

    return Case(response, inputs, [orders(1, 1, 1), orders(2, 1, 1)], reference)


def formula(f: Callable[..., np.ndarray], highest: int = 2) -> Case:
    """Return f(x, e, t) of a normal x and an e in [−1, 1] over twenty periods."""

    def response(x, e):
        values = f(x[:, None], e[:, None], TIMES)
        return xr.DataArray(values, dims=("sample", "time"), coords={"time": TIMES})

    def reference() -> xr.Dataset:
        x, weights = _trapezoids(281)
        mean, variance = [], []
        for e in np.linspace(-1, 1, 201):
            F = f(x[:, None], np.full((1, 1), e), TIMES)
            mean.append(weights @ F)
            variance.append(weights @ (F - mean[-1]) ** 2)
        return _bands(np.array(mean), np.array(variance), ("bound", "time"), {})

    orders = [({"x": k}, {"e": 1}) for k in range(1, highest + 1)]
    return Case(response, FORMULA_INPUTS, orders, reference)


def _trapezoids(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points and weights of the expectation over a normal variable."""
    x = np.linspace(-7, 7, count)
    weights = np.exp(-x * x / 2)
    return x, weights / weights.sum()


def _bands(mean: np.ndarray, variance: np.ndarray, dims: tuple, labels: dict) -> xr.Dataset:
    """Return the bands of moments at points of the intervals, (points, …)."""
    std = np.sqrt(np.maximum(variance, 0.0))
    bars = np.stack([(mean - std).min(0), (mean + std).max(0)])
    means = np.stack([mean.min(0), mean.max(0)])
    return xr.Dataset({"mean": (dims, means), "error_bar": (dims, bars)}, coords=labels)


def cases() -> dict[str, Callable[[], Case]]:
    """Return what makes each case, by name."""
    soft = {"E": 6.9e9, "elements": 5}
    wide = {"scatter": 0.05, "tolerance": 0.1}
    return {
        "cos ωt": lambda: formula(wave),
        "damped oscillator": lambda: formula(damped),
        "two carriers": lambda: formula(two_carriers),
        "fades and returns": lambda: formula(fades),
        "slider–crank, ρ∞ = 0.7": slider_crank,
        "slider–crank, ρ∞ = 0.5": lambda: slider_crank(0.5),
        "slider–crank, ρ∞ = 0.8": lambda: slider_crank(0.8),
        "slider–crank, ρ∞ = 1": lambda: slider_crank(1.0),
        "selective element": lambda: slider_crank(integration=fb.SelectiveIntegration()),
        "soft link": lambda: slider_crank(**soft),
        "wide scatter, ρ∞ = 0.7": lambda: slider_crank(**wide),
        "wide scatter, ρ∞ = 1": lambda: slider_crank(1.0, **wide),
        "chirp (trap)": lambda: formula(chirp),
        "bifurcation (trap)": lambda: formula(bifurcation),
        "independent beating (trap)": lambda: formula(beating),
        "interior extreme (trap)": lambda: formula(interior),
    }


def wave(x, e, t):
    return np.cos(TAU * (1 + 0.05 * e + 0.02 * x) * t)


def damped(x, e, t):
    w, zeta = TAU * (1 + 0.05 * x), 0.03 + 0.02 * e
    return np.exp(-zeta * w * t) * np.cos(w * np.sqrt(1 - zeta**2) * t)


def two_carriers(x, e, t):
    second = np.cos(TAU * (4 + 0.06 * e + 0.04 * x) * t)
    return 0.2 * t + np.cos(TAU * (1 + 0.02 * x) * t) + 0.5 * second


def fades(x, e, t):
    return np.cos(TAU * t / 10) * np.cos(TAU * (1 + 0.02 * x + 0.02 * e) * t)


def chirp(x, e, t):
    return np.cos(TAU * (1 + 0.02 * x + 0.02 * e) * (t + 0.05 * t * t))


def bifurcation(x, e, t):
    side = np.where(x > 0.5 * e + 0.3, 1.0, -1.0)
    return side * (1 - np.exp(-0.5 * t)) + 0.5 * np.cos(TAU * (1 + 0.02 * x) * t)


def beating(x, e, t):
    return np.cos(TAU * (1 + 0.02 * x) * t) + 0.8 * np.cos(TAU * (1.1 + 0.02 * e) * t)


def interior(x, e, t):
    return (1 - (e - 0.3) ** 2) * (0.5 + np.cos(TAU * (1 + 0.02 * x + 0.03 * e**2) * t))
