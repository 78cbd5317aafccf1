"""Errors of a motion by element, number of elements, step, spectral radius and damping.

Errors are root mean squares over the motion, in parts of the output's own standard deviation, and
how far the largest value is off. They are compared with motions that are extrapolated from two fine
steps. The notes say how far these move if the steps are halved again, without numerical damping,
and with another element. The second table judges the formulas for the lag and the damping of a
vibration by a mass on a spring.
"""

from __future__ import annotations

import time
import warnings
from pathlib import Path

import numpy as np

import flexband as fb
from benchmarks.harness import options, report
from benchmarks.numerics.problems import (
    PROBLEMS,
    Choice,
    Problem,
    motion,
    peak_error,
    reference,
    relative_difference,
)

STEPS = (10, 20, 40, 100)
RADII = (0.0, 0.5, 0.7, 0.9, 1.0)
PERIODS = 20
"""Steps per period, spectral radii and periods of the mass on a spring."""


def estimate(problem: Problem, choice: Choice) -> np.ndarray:
    """Return what `discretization_error` says of the outputs that are compared."""
    error_estimate = fb.discretization_error(
        problem.build(choice.element, choice.elements, choice.damping),
        duration=problem.duration,
        step=choice.step,
        integrator=fb.GeneralizedAlpha(spectral_radius=choice.radius),
    )
    return error_estimate["relative_error"].sel(output=list(problem.outputs)).values


def lag_and_damping(steps: int, radius: float) -> tuple[float, float]:
    """Return the lag per angle, and the damping ratio, of a mass on a spring, by integration."""
    mass = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0, position=(1.5, 0.0))},
        joints={"guide": fb.Slot("m", (0.0, 0.0))},
        loads={"k": fb.Spring("m", (0.0, 0.0), (2 * np.pi) ** 2, 1.0)},  # 1 Hz
        sensors={"r": fb.Position("m"), "v": fb.Velocity("m")},
    )
    integrator = fb.GeneralizedAlpha(spectral_radius=radius)
    vibration = fb.simulate(mass, duration=PERIODS, step=1 / steps, integrator=integrator)
    r, v = (vibration.sel(output=name).values for name in ("r_X", "v_X"))
    phase = np.unwrap(np.angle((r - 1) - 1j * v / (2 * np.pi)))
    size = np.hypot(r - 1, v / (2 * np.pi))
    full_periods = slice(steps, None, steps)
    t = 2 * np.pi * vibration.time.values  # after whole periods
    phase_rate = np.polyfit(t[full_periods], phase[full_periods], 1)[0]
    decay = np.polyfit(t, np.log(size), 1)[0]
    return 1 - phase_rate, -decay


def laws() -> tuple[list[list[str]], list[tuple[float, ...]]]:
    """Return the table of lag and damping: found, and by the formulas."""
    rows = []
    numbers = []
    for radius in RADII:
        delta = (1 - radius) / (1 + radius)
        for steps in STEPS:
            x = 2 * np.pi / steps
            lag, damping = lag_and_damping(steps, radius)
            formula = x**2 / 12 * (1 + 4.5 * delta**2), delta**3 * x**3 / 2
            numbers.append((radius, steps, lag, damping, *formula))
            rows.append([
                f"{radius:g}", str(steps), f"{lag:.2e}", f"{formula[0]:.2e}",
                f"{damping:.1e}" if delta else f"{abs(damping):.0e}", f"{formula[1]:.1e}",
            ])  # fmt: skip
    return rows, numbers


def percent(values: np.ndarray) -> str:
    """Return parts in per cent, those of several outputs with slashes between them."""
    numbers = [f"{100 * v:.0f}" if abs(v) > 0.1 else f"{100 * v:.2g}" for v in values]
    return " / ".join(n if abs(v) >= 5e-5 else "0" for n, v in zip(numbers, values, strict=True))


def errors(problem: Problem, notes: list[str]) -> tuple[list[list[str]], list[dict]]:
    """Return the lines of one mechanism, and append how far its references are converged."""
    references = {c.damping: reference(problem, c.damping) for c in problem.choices}
    for damping, checks in references.items():
        notes.append(
            f"{problem.name}, τ = {damping:g} s: the reference moves by "
            f"{percent(checks.half_step_error)} % with half the steps, "
            f"{percent(checks.undamped_error)} % with ρ∞ = 1, {percent(checks.other)} % with "
            f"{problem.other.element}, {problem.other.elements} elements"
        )
    rows = []
    measurements = []
    for choice in problem.choices:
        trial_motion = motion(problem, choice)
        truth = references[choice.damping].motion
        true = relative_difference(trial_motion, truth)
        peak = peak_error(trial_motion, truth)
        estimated_error = estimate(problem, choice)  # fmt: skip
        per_period = f"{1 / problem.frequency / choice.step:.0f}" if problem.frequency else ""
        measurements.append(
            {"choice": vars(choice), "error": true.tolist(), "estimate": estimated_error.tolist()}
        )
        rows.append([
            "" if rows else f"{problem.name}: {' / '.join(problem.outputs)}", choice.element,
            str(choice.elements or ""), f"{1e3 * choice.step:g}", per_period,
            f"{choice.radius:g}", f"{choice.damping:g}", percent(true), percent(peak),
            percent(estimated_error),
        ])  # fmt: skip
    return rows, measurements


HEADER = [
    "mechanism and outputs", "element", "number", "step [ms]", "steps per period", "ρ∞",
    "retardation [s]", "error [%]", "of the peak [%]", "estimated error [%]",
]  # fmt: skip
LAWS = ["ρ∞", "steps per period", "lag", "formula", "damping ratio", "formula"]


def main() -> None:
    folder: Path = options(__doc__, 1).output
    rows = []
    notes = []
    measurements = {}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fb.errors.FlexbandWarning)
        for problem in PROBLEMS:
            lines, measurements[problem.name] = errors(problem, notes)
            rows += lines
            print(f"{problem.name}: {time.process_time():.0f} s", flush=True)
        table, numbers = laws()
    report(folder, "numerics", HEADER, rows, measurements, notes)
    report(folder, "numerics_laws", LAWS, table, {"laws": numbers})


if __name__ == "__main__":
    main()
