"""Estimated errors of step and elements, against runs with eight times finer steps and elements.

The first table judges the expected errors of the slider–crank with the paper's elements, the second
`discretization_error` for one motion, and the third the expected errors of `AdaptivePCCI`. Their
mechanisms, numbers, steps and elements are drawn from seeds. Seeds of 1 000 000 and more are those
of the documentation.
"""

from __future__ import annotations

import runpy
import warnings
import zlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from scipy.stats import binomtest

import flexband as fb
from benchmarks.harness import ROOT, options, report
from benchmarks.honesty.rates import errors
from benchmarks.honesty.studies import KINDS, study
from benchmarks.numerics.discretization_draws import DRAWN, Run

FINER = 8
"""How much finer the steps and elements of the references are."""

VISIBLE = 1e-3
"""Of an output's range: errors in time above this are judged."""

LEAST = 1e-5
"""Of an output's variation: smaller errors are not judged."""

TOLERANCE = 0.01
"""Of the width of the bands, in the studies."""

NO_WIDTH = 1e-6
"""Of an output's size: bands that are narrower are not judged."""

BANDS = ("mean", "error_bar")

PAPER_STEPS = (600, 1200, 2400, 4800)
"""Numbers of steps of the slider–crank."""


# --- one motion ---------------------------------------------------------------------------------


def ratios(run: Run) -> tuple[list[float], np.ndarray, tuple[float, float | None]]:
    """Return estimate over true error of the whole motion, per output, and at single times.

    The last entry is the largest error of the step, in parts of the output's variation, and that
    of the output of which `simulate` says that it has few steps per period.
    """
    settings = {"duration": run.duration, "step": run.step}
    estimate = fb.discretization_error(run.mechanism, **settings)
    coarse = fb.simulate(run.mechanism, **settings)
    fine = fb.simulate(run.mechanism.refined(FINER), substeps=FINER, **settings)
    difference = coarse - fine
    true = np.sqrt((difference**2).mean("time"))
    estimated_error = np.sqrt((estimate["error"] ** 2).mean("time"))
    size = np.sqrt((fine**2).mean("time"))
    output_mask = (true > LEAST * fine.std("time").clip(1e-3 * size)).values
    half = round(estimate.attrs["window"] / run.step / 2)
    square = np.apply_along_axis(
        np.convolve, -1, difference.values**2, np.ones(2 * half + 1), mode="same"
    )
    count = np.convolve(np.ones(fine.sizes["time"]), np.ones(2 * half + 1), mode="same")
    local_error = np.sqrt(square / count)
    visible_mask = local_error > VISIBLE * np.ptp(fine.values, axis=-1, keepdims=True)
    visible_mask[~output_mask] = False
    steps = np.sqrt((estimate["step_error"] ** 2).mean("time")) / fine.std("time").clip(1e-3 * size)
    warning_error = None
    if "few_steps" in coarse.attrs:
        warning_error = float(steps.sel(output=coarse.attrs["few_steps"].split("'")[1]))
    step_errors = float(steps.max()), warning_error
    return (
        list((estimated_error / true).values[output_mask]),
        estimate["error"].values[visible_mask] / local_error[visible_mask],
        step_errors,
    )


def share(name: str, values: Sequence[float], factor: float) -> str:
    """Return the part of the ratios within a factor, with its 95 % interval."""
    inside = int(sum(1 / factor <= v <= factor for v in values))
    test = binomtest(inside, len(values)).proportion_ci(method="exact")
    ends = f"{100 * test.low:.0f} to {100 * test.high:.0f} %"
    return f"{name}: {100 * inside / len(values):.1f} % of {len(values)} ({ends})"


def motions(folder: Path, seed: int, runs_per_mechanism: int) -> None:
    """Judge `discretization_error`."""
    rows = []
    notes = []
    outputs = []
    times = []
    all_step_errors = []
    # Compare estimates with true errors, mechanism by mechanism.
    for name, draw in DRAWN.items():
        mechanism_ratios: list[float] = []
        for k in range(runs_per_mechanism):
            try:
                per_output, single, step_errors = ratios(
                    draw(np.random.default_rng([seed + k, zlib.crc32(name.encode())]))
                )
            except fb.errors.SimulationError as error:
                notes.append(f"{name}, seed {seed + k} failed: {str(error)[:80]}")
                continue
            mechanism_ratios += per_output
            times += list(single)
            all_step_errors.append(step_errors)
        outputs += mechanism_ratios
        within = [sum(1 / f <= v <= f for v in mechanism_ratios) for f in (2, 5)]
        ends = (
            [f"{v:.2g}" for v in np.quantile(mechanism_ratios, [0, 0.5, 1])]
            if mechanism_ratios
            else ["", "", ""]
        )
        rows.append(
            [name, str(runs_per_mechanism), str(len(mechanism_ratios)), *map(str, within), *ends]
        )
    # Summarize times and warnings.
    single = np.array(times)
    warning_errors = [v for _, v in all_step_errors if v is not None]
    wrong = [v for largest, v in all_step_errors if largest > 0.05]
    notes += [
        share("outputs within a factor of 2", outputs, 2),
        share("outputs within a factor of 5", outputs, 5),
        f"times with an error above {100 * VISIBLE:g} % of the range: within a factor of 2 "
        f"{np.mean((single >= 0.5) & (single <= 2)):.1%}, of 5 "
        f"{np.mean((single >= 0.2) & (single <= 5)):.1%} of {len(single)}",
        f"warned of few steps per period: {len(warning_errors)} of {len(all_step_errors)} motions, "
        f"with an error of the step above 1 % in {sum(v > 0.01 for v in warning_errors)}",
        f"motions with an error of the step above 5 %: {len(wrong)}, not warned of: "
        f"{sum(v is None for v in wrong)}",
        f"seeds from {seed} on; references have {FINER} times finer steps and elements",
    ]
    header = [
        "mechanism", "motions", "outputs", "within 2", "within 5", "smallest ratio", "median",
        "largest",
    ]  # fmt: skip
    report(folder, "discretization_motions", header, rows, {"ratios": outputs}, notes)


# --- studies ------------------------------------------------------------------------------------


def true_and_expected(
    response, inputs, steps: Sequence[int], parts: tuple[int, int]
) -> list[tuple]:
    """Return true and expected error of the bands with so many steps each.

    The truth has the times of the first number of steps, each of them divided into the first of the
    `parts`, and elements divided into the second. Errors are means over time, in parts of the width
    of the error bar, of the output where they are largest.
    """
    step = response.duration / steps[0]
    settings = {"duration": response.duration, "integrator": response.integrator}

    def fine(**values) -> xr.DataArray:
        mechanism = response.builder(**values).refined(parts[1])
        motion = fb.simulate(mechanism, step=step, substeps=parts[0], **settings)
        return motion if "sample" in motion.dims else motion.expand_dims(sample=1)

    truth = fb.propagate(fine, inputs, fb.AdaptivePCCI(TOLERANCE / 10, 400))
    exact = [truth[name].transpose("bound", "output", "time").values for name in BANDS]
    rows = []
    for count in steps:
        coarse = fb.dynamic_response(response.builder, step=response.duration / count, **settings)
        bands = fb.propagate(coarse, inputs, fb.AdaptivePCCI(TOLERANCE, correct=False))
        bands_at_times = bands.isel(time=slice(None, None, count // steps[0]))
        total_bands = bands_at_times.drop_vars([f"{name}_expansion_error" for name in BANDS])
        bar = exact[1]
        wide_mask = np.ptp(bar, axis=0).mean(axis=-1) > NO_WIDTH * np.abs(bar).max(axis=(0, 2))
        true, claim = (
            part.mean(axis=-1)[:, wide_mask].max(initial=0.0)
            for part in errors(total_bands, (exact[0], exact[1]))
        )
        rows.append((float(true), float(claim), bands.attrs["expansion_error"]))
    return rows


def studies(folder: Path, seed: int, cases_per_kind: int) -> None:
    """Judge the expected errors of studies of mechanisms with coarse steps."""
    rows = []
    error_rows = []
    notes = []
    halved_count = 0
    # Compare expected with true errors, mechanism by mechanism.
    for name, kind in KINDS.items():
        kind_errors = []
        for k in range(cases_per_kind):
            rng = np.random.default_rng([seed + k, zlib.crc32(name.encode())])
            case = study(name, seed + k, rng, kind)
            response = case.response
            count = round(response.duration / response.step / rng.uniform(1, 4))
            try:
                with warnings.catch_warnings(record=True) as warning_list:
                    warnings.simplefilter("always", fb.errors.FlexbandWarning)
                    case_errors = true_and_expected(
                        response, case.inputs, [max(count, 12)], (FINER, FINER)
                    )
                if any("completed with half" in str(w.message) for w in warning_list):
                    halved_count += 1
                else:
                    kind_errors += case_errors
            except fb.errors.SimulationError as error:
                notes.append(f"{name}, seed {seed + k} failed: {str(error)[:80]}")
        if not kind_errors:
            continue
        error_rows += kind_errors
        true, claim = np.array(kind_errors).T[:2]
        rows.append([
            name, str(len(kind_errors)), *(f"{100 * np.median(v):.2g}" for v in (true, claim)),
            str(sum(right(t, c) for t, c, _ in kind_errors)),
            str(sum(t > 5 * c > 0 for t, c, _ in kind_errors)),
        ])  # fmt: skip
    # Summarize all studies.
    right_count = sum(right(t, c) for t, c, _ in error_rows)
    low, high = binomtest(right_count, len(error_rows)).proportion_ci(method="exact")
    notes += [
        f"{halved_count} further studies, of which is warned that runs diverged and needed "
        "half the step",
        f"right {100 * right_count / len(error_rows):.0f} % ({100 * low:.0f} to "
        f"{100 * high:.0f} %): within a factor of 5 of the true error, or both below "
        f"{100 * TOLERANCE:g} %",
        f"seeds from {seed} on; references have {FINER} times finer steps and elements",
    ]
    header = ["mechanism", "studies", "true error [%]", "expected [%]", "right", "too small by 5"]
    report(folder, "discretization_studies", header, rows, {"true, expected": error_rows}, notes)


def right(true: float, claim: float) -> bool:
    """Return whether an expected error is within a factor of 5, or rightly below the tolerance."""
    return claim / 5 <= true <= 5 * claim or max(true, claim) < TOLERANCE


def paper(folder: Path) -> None:
    """Judge the expected errors of the slider–crank with the paper's elements."""
    example = runpy.run_path(str(ROOT / "examples" / "paper" / "slider_crank.py"))["study"]
    error_rows = true_and_expected(example.response, example.inputs, PAPER_STEPS, (64, FINER))
    rows = [
        [f"{1e3 * example.response.duration / n:g}", *(f"{100 * v:.2g}" for v in row_errors)]
        for n, row_errors in zip(PAPER_STEPS, error_rows, strict=True)
    ]
    header = ["step [ms]", "true error [%]", "expected [%]", "expansion alone [%]"]
    notes = [f"reference: step 1/64 ms, {FINER} times as many elements; errors in parts of its bar"]
    report(folder, "discretization_paper", header, rows, {"errors": error_rows}, notes)


def main() -> None:
    arguments = options(
        __doc__, 8, seed=(0, "first seed; documented tables have 1000000 or higher")
    )
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fb.errors.FlexbandWarning)
        paper(arguments.output)
        motions(arguments.output, arguments.seed, arguments.samples)
        studies(arguments.output, arguments.seed, max(1, arguments.samples // 2))


if __name__ == "__main__":
    main()
