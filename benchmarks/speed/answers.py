"""Seconds of answers on the surrogate of the slider–crank: 601 times, 2 outputs, 4 inputs."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from functools import partial

import numpy as np

import flexband as fb
from benchmarks.harness import ROOT, alternate, medians, options, report

PROBABILITY = 1e-3
"""Of leaving the limit, with the interval inputs at their midpoints."""


def slider_crank() -> fb.Surrogate:
    """Return the surrogate of the main example at 601 times."""
    sys.path.insert(0, str(ROOT / "examples"))
    import slider_crank as example  # noqa: PLC0415  # pyright: ignore[reportMissingImports]

    response = fb.dynamic_response(example.slider_crank, duration=0.6, step=1e-4, output_step=1e-3)
    surrogate = fb.expand(response, example.inputs, fb.AdaptivePCCI(tolerance=0.01))
    assert isinstance(surrogate, fb.Surrogate)
    return surrogate


def limit(surrogate: fb.Surrogate) -> fb.Requirement:
    """Return the limit of a force that is left with a probability of 1e-3."""
    space = surrogate.space
    rng = np.random.default_rng(0)
    xi = rng.standard_normal((20_000, space.random_dimension))
    eta = np.zeros((len(xi), space.interval_dimension))
    blocks = [slice(k, k + 1000) for k in range(0, len(xi), 1000)]
    peaks = [surrogate.standard(xi[k], eta[k])[:, 0].max(axis=1) for k in blocks]
    return fb.Requirement("F_X", below=float(np.quantile(np.concatenate(peaks), 1 - PROBABILITY)))


def seconds(answer: Callable[[], object]) -> float:
    """Return the seconds of one answer."""
    begin = time.perf_counter()
    answer()
    return time.perf_counter() - begin


def main() -> None:
    arguments = options(__doc__, 1)
    surrogate = slider_crank()
    force_limit = limit(surrogate)
    tighter = {"crank_length": fb.Interval(0.198, 0.202)}
    answers = {
        "bands for a tighter tolerance": lambda: surrogate.narrowed(**tighter).bands(),
        "contributions": partial(fb.analysis.contributions, surrogate),
        "check_requirements": partial(fb.analysis.check_requirements, surrogate, force_limit),
        "quantiles": partial(fb.analysis.quantiles, surrogate),
        "sobol_indices": partial(fb.analysis.sobol_indices, surrogate),
        "failure_probability": partial(fb.analysis.failure_probability, surrogate, force_limit),
    }
    for answer in answers.values():  # also compiles
        answer()
    timers = {name: partial(seconds, answer) for name, answer in answers.items()}
    measurements = alternate(timers, arguments.repeats)
    result = fb.analysis.failure_probability(surrogate, force_limit)
    names = ("probability", "confidence_low", "confidence_high")
    low, high = ([float(result[k][b, 0]) for k in names] for b in range(2))
    note = "probability {:.3g} ({:.3g} to {:.3g}) to {:.3g} ({:.3g} to {:.3g})"
    rows = [[name, f"{value:.3g}"] for name, value in medians(measurements).items()]
    report(
        arguments.output, "answers", ["answer", "s"], rows, measurements, [note.format(*low, *high)]
    )


if __name__ == "__main__":
    main()
