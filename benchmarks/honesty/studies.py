"""Families of mechanisms: which parameters are uncertain, and the converged bands."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from inspect import signature

import numpy as np
import xarray as xr

import flexband as fb
from benchmarks.honesty import mechanisms
from benchmarks.honesty.problems import Bands, Case
from benchmarks.honesty.references import InterpolatedMoments, bands, chebyshev_nodes, grid
from flexband.uncertainty.inputs.space import Space

NODES = {1: 24, 2: 14, 3: 8}
"""Points along every one of so many variables: the runs of the reference are a grid."""

DIMENSIONS = [(1, 1), (1, 1), (2, 0), (0, 2), (1, 0), (0, 1), (2, 1), (1, 2), (1, 2)]
"""Numbers of random and interval parameters that are drawn."""

NOMINAL = 0.1
"""Largest relative change of the nominal values."""

UNIFORM = 0.3
"""Share of uniform parameters among the random ones."""


@dataclass(frozen=True)
class Kind:
    """A kind of mechanism.

    Attributes
    ----------
    builder : function of all parameters by name that returns the mechanism.
    parameters : nominal value, and largest relative spread where it is uncertain, by name.
    duration : shortest and longest simulated time [s].
    step : [s].
    max_inputs : most uncertain parameters.
    point_factor : factor of the numbers of points of the reference.
    integrator : with a tolerance that does not change the narrowest bands from run to run.
    fine : steps and elements of the reference in place of each; the method chooses its own then.
    """

    builder: Callable[..., fb.Mechanism]
    parameters: Mapping[str, tuple[float, float]]
    duration: tuple[float, float]
    step: float
    max_inputs: int = 3
    point_factor: float = 1.0
    integrator: fb.GeneralizedAlpha = field(default_factory=fb.GeneralizedAlpha)
    fine: tuple[int, int] = (1, 1)


KINDS = {
    "rigid slider–crank": Kind(
        mechanisms.slider_crank,
        {
            "crank": (0.2, 0.05), "rod": (0.45, 0.04), "stiffness": (1000.0, 0.1),
            "friction": (50.0, 0.15), "load": (5.0, 0.1), "speed": (12.0, 0.02),
        },
        (0.2, 0.6), 4e-3,
    ),
    "quick return": Kind(
        mechanisms.quick_return,
        {
            "crank": (0.1, 0.04), "pivot": (0.25, 0.02), "friction": (200.0, 0.15),
            "load": (15.0, 0.1), "speed": (6.0, 0.02),
        },
        (0.4, 1.0), 5e-3,
    ),
    "four-bar": Kind(
        mechanisms.four_bar,
        {
            "crank": (0.08, 0.02), "coupler": (0.30, 0.015), "rocker": (0.20, 0.02),
            "ground": (0.32, 0.015), "stiffness": (5.0, 0.1), "friction": (0.1, 0.15),
            "speed": (19.0, 0.02),
        },
        (0.15, 0.35), 3e-3,
    ),
    "pendulum": Kind(
        mechanisms.pendulum,
        {
            "upper": (0.5, 0.03), "lower": (0.4, 0.03), "weight": (2.0, 0.15),
            "friction": (0.5, 0.15), "angle": (0.8, 0.1),
        },
        (0.8, 2.0), 1e-2,
    ),
    "elastic crank": Kind(
        mechanisms.elastic_crank,
        {
            "crank": (0.2, 0.02), "link": (0.45, 0.01), "modulus": (69e9, 0.08),
            "stiffness": (1000.0, 0.1), "load": (5.0, 0.1), "speed": (14.0, 0.03),
        },
        (0.06, 0.15), 1e-3, max_inputs=2, point_factor=1.7,
        integrator=fb.GeneralizedAlpha(tolerance=1e-12),
    ),
    "elastic four-bar": Kind(
        mechanisms.elastic_four_bar,
        {
            "crank": (0.08, 0.02), "coupler": (0.30, 0.005), "modulus": (2.8e9, 0.14),
            "damping": (1e-4, 0.15), "speed": (19.0, 0.03),
        },
        (0.1, 0.25), 1e-3, max_inputs=2, point_factor=1.7,
        integrator=fb.GeneralizedAlpha(tolerance=1e-12),
    ),
}  # fmt: skip
KINDS |= {
    "chosen pendulum": replace(KINDS["pendulum"], fine=(64, 1)),
    "chosen crank": replace(
        KINDS["elastic crank"], fine=(256, 4), max_inputs=1,
        builder=partial(mechanisms.elastic_crank, retardation_time=2e-5),
    ),
    "chosen four-bar": replace(KINDS["elastic four-bar"], fine=(128, 4), max_inputs=1),
}  # fmt: skip
"""All kinds, by the name of their family; the last ones leave out step and elements."""


def study(family: str, seed: int, rng: np.random.Generator, kind: Kind) -> Case:
    """Return the case of a kind of mechanism."""
    # Draw the uncertain parameters and their distributions.
    candidates = [counts for counts in DIMENSIONS if sum(counts) <= kind.max_inputs]
    n, m = candidates[rng.integers(len(candidates))]
    nominal = {
        name: value * (1 + NOMINAL * rng.uniform(-1, 1) * (spread >= 0.02))
        for name, (value, spread) in kind.parameters.items()
    }
    names = [str(name) for name in rng.permutation(list(nominal))[: n + m]]
    spread = {name: kind.parameters[name][1] * 10 ** rng.uniform(-0.5, 0) for name in names}
    inputs: dict[str, fb.Input] = {}
    for k, name in enumerate(names):
        value = nominal.pop(name)
        radius = spread[name]
        ends = value * (1 - radius), value * (1 + radius)
        if k >= n:
            inputs[name] = fb.Interval(*ends)
        elif rng.random() < UNIFORM:
            inputs[name] = fb.Uniform(*ends)
        else:
            inputs[name] = fb.Normal(value, value * radius / 2)
    # Make the response and its reference.
    sensors = _draw_sensors(kind, rng)

    def builder(elements: int | None, **values) -> fb.Mechanism:
        mesh = {"elements": elements} if "elements" in signature(kind.builder).parameters else {}
        mechanism = kind.builder(**nominal, **mesh, **values)
        return replace(mechanism, sensors={name: mechanism.sensors[name] for name in sensors})

    times = {"duration": round(rng.uniform(*kind.duration) / kind.step) * kind.step}
    times |= {"output_step": kind.step, "integrator": kind.integrator, "threads": 1}
    steps, parts = kind.fine
    fine = fb.dynamic_response(partial(builder, 2 * parts), step=kind.step / steps, **times)
    automatic = steps > 1
    response = fb.dynamic_response(partial(builder, None), **times) if automatic else fine
    truth = partial(reference, fine, inputs, kind.point_factor)
    return Case(family, seed, response, inputs, truth, exact_steps=automatic)


def _draw_sensors(kind: Kind, rng: np.random.Generator) -> list[str]:
    mechanism = kind.builder(**{name: value for name, (value, _) in kind.parameters.items()})
    names = list(mechanism.sensors)
    return [str(name) for name in rng.permutation(names)[: rng.integers(1, 3)]]


def reference(
    response: Callable[..., xr.DataArray],
    inputs: Mapping[str, fb.Input],
    point_factor: float = 1.0,
    refine: int = 1,
) -> Bands:
    """Return the bands from runs on a grid: Gauss points of ξ, Chebyshev points of η.

    There are `point_factor` times as many points as `NODES` says.
    """
    space = Space(inputs)
    n = space.random_dimension
    m = space.interval_dimension
    count = refine * round(point_factor * NODES[n + m])
    random = [_rule(distribution, count) for distribution in space.of_kind(random=True).values()]
    xi = grid(*(x for x, _ in random)) if n else np.zeros((1, 0))
    weights = grid(*(w for _, w in random)).prod(axis=1) if n else np.ones(1)
    eta = grid(*[chebyshev_nodes(count)] * m) if m else np.zeros((1, 0))
    values = _values(space, np.tile(xi, (len(eta), 1)), np.repeat(eta, len(xi), axis=0))
    F = response(**values).values
    F = F.reshape(len(eta), len(xi), *F.shape[1:])
    mean = np.einsum("q,eqot->eot", weights, F)
    variance = np.einsum("q,eqot->eot", weights, (F - mean[:, None]) ** 2)
    band_pairs = []
    for o in range(F.shape[2]):
        shape = (*[count] * m, F.shape[3])
        interpolation = InterpolatedMoments(
            mean[:, o].reshape(shape), variance[:, o].reshape(shape)
        )
        band_pairs.append(bands([interpolation], F.shape[3], refine))
    means, bars = (np.stack(v, axis=1) for v in zip(*band_pairs, strict=True))
    return means, bars


def _rule(distribution: fb.Input, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return points of a random input's own standard variable, and weights of the mean."""
    if isinstance(distribution, fb.Uniform):
        x, weights = np.polynomial.legendre.leggauss(count)
    else:
        x, weights = np.polynomial.hermite_e.hermegauss(count)
    return x, weights / weights.sum()


def _values(space: Space, xi: np.ndarray, eta: np.ndarray) -> dict[str, np.ndarray]:
    """Return the inputs' values; the variable of a uniform input goes from −1 to 1."""
    columns = {True: iter(xi.T), False: iter(eta.T)}
    values = {}
    for name, distribution in space.inputs.items():
        x = next(columns[distribution.random])
        if isinstance(distribution, fb.Normal):
            values[name] = distribution.mean + distribution.std * x
        else:
            values[name] = 0.5 * ((1 - x) * distribution.lower + (1 + x) * distribution.upper)
    return values
