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
    given = {"duration": run.duration, "step": run.step}
    found = fb.discretization_error(run.mechanism, **given)
    coarse = fb.simulate(run.mechanism, **given)
    fine = fb.simulate(run.mechanism.refined(FINER), substeps=FINER, **given)
    difference = coarse - fine
    true = np.sqrt((difference**2).mean("time"))
    said = np.sqrt((found["error"] ** 2).mean("time"))
    size = np.sqrt((fine**2).mean("time"))
    judged = (true > LEAST * fine.std("time").clip(1e-3 * size)).values
    half = round(found.attrs["window"] / run.step / 2)
    square = np.apply_along_axis(
        np.convolve, -1, difference.values**2, np.ones(2 * half + 1), mode="same"
    )
    count = np.convolve(np.ones(fine.sizes["time"]), np.ones(2 * half + 1), mode="same")
    near = np.sqrt(square / count)
    seen = near > VISIBLE * np.ptp(fine.values, axis=-1, keepdims=True)
    seen[~judged] = False
    steps = np.sqrt((found["step_error"] ** 2).mean("time")) / fine.std("time").clip(1e-3 * size)
    warned = None
    if "few_steps" in coarse.attrs:
        warned = float(steps.sel(output=coarse.attrs["few_steps"].split("'")[1]))
    both = float(steps.max()), warned
    return list((said / true).values[judged]), found["error"].values[seen] / near[seen], both


def share(name: str, values: Sequence[float], factor: float) -> str:
    """Return the part of the ratios within a factor, with its 95 % interval."""
    inside = int(sum(1 / factor <= v <= factor for v in values))
    test = binomtest(inside, len(values)).proportion_ci(method="exact")
    ends = f"{100 * test.low:.0f} to {100 * test.high:.0f} %"
    return f"{name}: {100 * inside / len(values):.1f} % of {len(values)} ({ends})"


def motions(folder: Path, seed: int, each: int) -> None:
    """Judge `discretization_error`."""
    rows = []
    notes = []
    outputs = []
    times = []
    warned = []
    for name, draw in DRAWN.items():
        own: list[float] = []
        for k in range(each):
            try:
                whole, single, few = ratios(
                    draw(np.random.default_rng([seed + k, zlib.crc32(name.encode())]))
                )
            except fb.errors.SimulationError as error:
                notes.append(f"{name}, seed {seed + k} failed: {str(error)[:80]}")
                continue
            own += whole
            times += list(single)
            warned.append(few)
        outputs += own
        within = [sum(1 / f <= v <= f for v in own) for f in (2, 5)]
        ends = [f"{v:.2g}" for v in np.quantile(own, [0, 0.5, 1])] if own else ["", "", ""]
        rows.append([name, str(each), str(len(own)), *map(str, within), *ends])
    single = np.array(times)
    named = [v for _, v in warned if v is not None]
    wrong = [v for most, v in warned if most > 0.05]
    notes += [
        share("outputs within a factor of 2", outputs, 2),
        share("outputs within a factor of 5", outputs, 5),
        f"times with an error above {100 * VISIBLE:g} % of the range: within a factor of 2 "
        f"{np.mean((single >= 0.5) & (single <= 2)):.1%}, of 5 "
        f"{np.mean((single >= 0.2) & (single <= 5)):.1%} of {len(single)}",
        f"warned of few steps per period: {len(named)} of {len(warned)} motions, with an error of "
        f"the step above 1 % in {sum(v > 0.01 for v in named)}",
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


def both(response, inputs, steps: Sequence[int], parts: tuple[int, int]) -> list[tuple]:
    """Return true and expected error of the bands with so many steps each.

    The truth has the times of the first number of steps, each of them divided into the first of the
    `parts`, and elements divided into the second. Errors are means over time, in parts of the width
    of the error bar, of the output where they are largest.
    """
    step = response.duration / steps[0]
    given = {"duration": response.duration, "integrator": response.integrator}

    def fine(**values) -> xr.DataArray:
        mechanism = response.builder(**values).refined(parts[1])
        motion = fb.simulate(mechanism, step=step, substeps=parts[0], **given)
        return motion if "sample" in motion.dims else motion.expand_dims(sample=1)

    truth = fb.propagate(fine, inputs, fb.AdaptivePCCI(TOLERANCE / 10, 400))
    exact = [truth[name].transpose("bound", "output", "time").values for name in BANDS]
    rows = []
    for count in steps:
        coarse = fb.dynamic_response(response.builder, step=response.duration / count, **given)
        found = fb.propagate(coarse, inputs, fb.AdaptivePCCI(TOLERANCE, correct=False))
        same = found.isel(time=slice(None, None, count // steps[0]))
        whole = same.drop_vars([f"{name}_expansion_error" for name in BANDS])
        bar = exact[1]
        wide = np.ptp(bar, axis=0).mean(axis=-1) > NO_WIDTH * np.abs(bar).max(axis=(0, 2))
        true, claim = (
            part.mean(axis=-1)[:, wide].max(initial=0.0)
            for part in errors(whole, (exact[0], exact[1]))
        )
        rows.append((float(true), float(claim), found.attrs["expansion_error"]))
    return rows


def studies(folder: Path, seed: int, each: int) -> None:
    """Judge the expected errors of studies of mechanisms with coarse steps."""
    rows = []
    found = []
    notes = []
    halved = 0
    for name, kind in KINDS.items():
        own = []
        for k in range(each):
            rng = np.random.default_rng([seed + k, zlib.crc32(name.encode())])
            case = study(name, seed + k, rng, kind)
            response = case.response
            count = round(response.duration / response.step / rng.uniform(1, 4))
            try:
                with warnings.catch_warnings(record=True) as issued:
                    warnings.simplefilter("always", fb.errors.FlexbandWarning)
                    one = both(response, case.inputs, [max(count, 12)], (FINER, FINER))
                if any("completed with half" in str(w.message) for w in issued):
                    halved += 1
                else:
                    own += one
            except fb.errors.SimulationError as error:
                notes.append(f"{name}, seed {seed + k} failed: {str(error)[:80]}")
        if not own:
            continue
        found += own
        true, claim = np.array(own).T[:2]
        rows.append([
            name, str(len(own)), *(f"{100 * np.median(v):.2g}" for v in (true, claim)),
            str(sum(right(t, c) for t, c, _ in own)), str(sum(t > 5 * c > 0 for t, c, _ in own)),
        ])  # fmt: skip
    good = sum(right(t, c) for t, c, _ in found)
    low, high = binomtest(good, len(found)).proportion_ci(method="exact")
    notes += [
        f"{halved} further studies, of which is warned that runs diverged and needed half the step",
        f"right {100 * good / len(found):.0f} % ({100 * low:.0f} to {100 * high:.0f} %): within a "
        f"factor of 5 of the true error, or both below {100 * TOLERANCE:g} %",
        f"seeds from {seed} on; references have {FINER} times finer steps and elements",
    ]
    header = ["mechanism", "studies", "true error [%]", "expected [%]", "right", "too small by 5"]
    report(folder, "discretization_studies", header, rows, {"true, expected": found}, notes)


def right(true: float, claim: float) -> bool:
    """Return whether an expected error is within a factor of 5, or rightly below the tolerance."""
    return claim / 5 <= true <= 5 * claim or max(true, claim) < TOLERANCE


def paper(folder: Path) -> None:
    """Judge the expected errors of the slider–crank with the paper's elements."""
    one = runpy.run_path(str(ROOT / "examples" / "paper" / "slider_crank.py"))["study"]
    found = both(one.response, one.inputs, PAPER_STEPS, (64, FINER))
    rows = [
        [f"{1e3 * one.response.duration / n:g}", *(f"{100 * v:.2g}" for v in own)]
        for n, own in zip(PAPER_STEPS, found, strict=True)
    ]
    header = ["step [ms]", "true error [%]", "expected [%]", "expansion alone [%]"]
    notes = [f"reference: step 1/64 ms, {FINER} times as many elements; errors in parts of its bar"]
    report(folder, "discretization_paper", header, rows, {"errors": found}, notes)


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
