"""Claimed and true errors with and without the correction of step and elements.

Mechanisms of many kinds, with too long steps and few elements, or with both left to the method, are
drawn from seeds; the method may be tuned to seeds below 1 000 000. References have no correction, a
tolerance of a tenth, steps 32 times and elements four times as fine as those of corrected bands;
16 times and four times if the method chose these. Errors and rates are those of
`benchmarks.honesty.honesty`.

Finished cases are added to a file, and a further call goes on from there: several may run at once
with other seeds or kinds. `--show` makes the tables of all cases of the file.
"""

from __future__ import annotations

import json
import time
import warnings
import zlib
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from unittest.mock import patch

import numpy as np
import xarray as xr

import flexband as fb
from benchmarks.harness import options, report
from benchmarks.honesty.corrected_draws import DRAWS, CoarseMechanism
from benchmarks.honesty.rates import Outcome, errors, right, too_small, widths
from flexband.mechanics.response import DynamicResponse

FINER = {False: (32, 4), True: (16, 4)}
"""How much finer steps and elements of the references are, where they are given, and chosen."""

MOST = 200
"""Runs of a reference."""

TOLERANCE = 0.01
"""Of the width of the bands."""

UNSURE = 0.2
"""Of the corrected bands' error: references with a larger error of their own judge nothing."""

LARGER = 1.0
"""Gain below which the correction makes a case worse."""

NO_WIDTH = 1e-12
"""In units of an output: narrower bands are rounding."""

BANDS = ("mean", "error_bar")


def solve(case: CoarseMechanism, *, correct: bool) -> xr.Dataset:
    """Return the bands of a case as the method gives them."""
    times = {"duration": case.duration, "output_step": case.step, "threads": 1}
    step = {} if case.free_discretization else {"step": case.step}
    response = fb.dynamic_response(case.mechanism, **times, **step)
    return fb.propagate(response, case.inputs, fb.AdaptivePCCI(TOLERANCE, correct=correct))


def truth(case: CoarseMechanism, halvings: Sequence[str]) -> xr.Dataset:
    """Return bands of fine steps and elements.

    Parameters
    ----------
    halvings : what the method halved, each time.
    """
    steps, elements = (
        count * 2 ** halvings.count(name)
        for count, name in zip(FINER[case.free_discretization], ("step", "elements"), strict=True)
    )

    def fine(**values) -> xr.DataArray:
        mechanism = case.mechanism(elements, **values)
        motion = fb.simulate(
            mechanism, duration=case.duration, step=case.step, substeps=steps, threads=1,
            integrator=fb.GeneralizedAlpha(tolerance=1e-12),
        )  # fmt: skip
        return motion if "sample" in motion.dims else motion.expand_dims(sample=1)

    return fb.propagate(fine, case.inputs, fb.AdaptivePCCI(TOLERANCE / 10, MOST))


@contextmanager
def count_work() -> Iterator[list[float]]:
    """Give a list to which every call of a response adds its steps, times elements and samples."""
    work: list[float] = []
    simulate = DynamicResponse.__call__

    def call(response: DynamicResponse, **values) -> xr.DataArray:
        motion = simulate(response, **values)
        discretization = response.description(**values).discretization
        elements = sum(n for name, n in discretization.items() if name != "step")
        work.append(motion.sizes["sample"] * response.duration / response.step * max(1, elements))
        return motion

    with patch.object(DynamicResponse, "__call__", call):
        yield work


def judge_case(kind: str, seed: int) -> dict[str, object]:
    """Return what is known of a case, as numbers and texts."""
    rng = np.random.default_rng([seed, zlib.crc32(kind.encode())])
    case = DRAWS[kind](rng)
    begin = time.process_time()
    record: dict[str, object] = {"kind": kind, "seed": seed, "free": case.free_discretization}
    # Run with and without correction, then the reference.
    try:
        bands_of = {}
        work = {}
        for correct in (False, True):
            with count_work() as calls, warnings.catch_warnings(record=True) as warning_list:
                warnings.simplefilter("always", fb.errors.FlexbandWarning)
                bands_of[correct] = solve(case, correct=correct)
            record["halved"] = any("completed with half" in str(w.message) for w in warning_list)
            work[correct] = sum(calls)
        exact = truth(case, bands_of[True].attrs.get("halved", []))
    except Exception as error:
        return record | {"failure": f"{type(error).__name__}: {error}"[:200]}
    # Compare errors and claims of outputs that are not rounding.
    exact_bands = tuple(exact[name].transpose("bound", "output", "time").values for name in BANDS)
    record["reference"] = float(exact.attrs["expected_error"])
    for correct, bands in bands_of.items():
        total_bands = bands.drop_vars([f"{name}_expansion_error" for name in BANDS])
        del total_bands.attrs["expansion_error"]
        true, claim = (part.mean(axis=-1).max(axis=0) for part in errors(total_bands, exact_bands))
        bar = exact_bands[1]
        wide_mask = widths(exact_bands) > np.maximum(1e-6 * np.abs(bar).max(axis=(0, 2)), NO_WIDTH)
        attrs = bands.attrs
        record["corrected" if correct else "plain"] = {
            "true": true[wide_mask].tolist(),
            "claim": claim[wide_mask].tolist(),
            "runs": int(attrs["runs"]),
            "expansion": float(attrs["expansion_error"]),
            "step": float(attrs.get("step_error", 0.0)),
            "elements": float(attrs.get("elements_error", 0.0)),
            "counts": [
                int(attrs[k]) for k in ("runs_fitted", "runs_checked", "runs_refined")
            ] + [int(attrs["runs_coarser"])],
            "work": work[correct],
            "kinds": str(attrs.get("corrected", "")),
            "discretization": attrs["discretization"],
        }  # fmt: skip
    return record | {"seconds": time.process_time() - begin}


def outcomes(records: Sequence[Mapping], name: str) -> list[Outcome]:
    """Return the outcomes of cases with or without correction."""
    return [
        Outcome(
            record["kind"],
            record["seed"],
            record[name]["runs"],
            max(record[name]["true"], default=0.0),
            max(record[name]["claim"], default=0.0),
        )
        for record in records
    ]


def gain(record: Mapping) -> float:
    """Return how many times smaller the true error is at equal engine time, of a given step.

    It is that of the corrected outputs, whose errors the correction changes. Uncorrected errors are
    taken to fall with the square of the step.
    """
    plain = record["plain"]
    corrected = record["corrected"]
    pairs = zip(plain["true"], corrected["true"], strict=True)
    changes = [(before, after) for before, after in pairs if before != after]
    before, after = (max(values, default=1.0) for values in zip(*changes, strict=True))
    return before * (plain["work"] / corrected["work"]) ** 2 / max(after, 1e-300)


def row(name: str, records: Sequence[Mapping]) -> list[str]:
    """Return the line of a kind."""
    plain, corrected = (outcomes(records, which) for which in ("plain", "corrected"))
    corrected_records = [record for record in records if record["corrected"]["kinds"]]
    gains = [gain(record) for record in corrected_records if not record["free"]]
    work = [
        record["plain"]["work"] / record["corrected"]["work"]
        for record in corrected_records
        if record["free"]
    ]
    middle = [np.median([100 * o.true for o in some]) for some in (plain, corrected)]
    ratios = [o.claim / max(o.true, 1e-300) for o in corrected]
    return [
        name,
        str(len(records)),
        str(len(corrected_records)),
        *(f"{v:.2g}" for v in middle),
        f"{100 * np.median([result.claim for result in corrected]):.2g}",
        f"{np.median(ratios):.2g}",
        str(sum(right(o, TOLERANCE) for o in corrected)),
        str(sum(right(o, TOLERANCE) for o in plain)),
        str(sum(map(too_small, corrected))),
        str(sum(map(too_small, plain))),
        f"{np.median(gains):.2g}" if gains else "",
        str(sum(v < LARGER for v in gains)),
        f"{np.median(work):.2g}" if work else "",
    ]


HEADER = [
    "kind", "cases", "corrected", "true error uncorrected [%]", "true error [%]", "claim [%]",
    "claim/true, median", "right", "right uncorrected", "too small by 5",
    "too small by 5 uncorrected", "gain at equal engine time, median", "gain below 1",
    "engine time saved where free, median",
]  # fmt: skip


def show(folder: Path, lines: Sequence[str]) -> None:
    """Write the tables of all cases of a file."""
    records = {(r["kind"], r["seed"]): r for r in map(json.loads, lines)}
    failures = [r for r in records.values() if "failure" in r]
    halved_records = [r for r in records.values() if r.get("halved") and "failure" not in r]
    usable_records = [r for r in records.values() if "failure" not in r and not r.get("halved")]
    sure_records = [
        r for r in usable_records
        if r["reference"] <= max(UNSURE * max(r["corrected"]["true"], default=0.0), 1e-3)
    ]  # fmt: skip
    rows = [
        row(kind, of_kind)
        for kind in DRAWS
        if (of_kind := [r for r in sure_records if r["kind"] == kind])
    ]
    rows.append(row("all", sure_records))
    corrected_records = [r for r in sure_records if r["corrected"]["kinds"]]
    if corrected_records:
        rows.append(row("all that are corrected", corrected_records))
    small = [f"{o.family}:{o.seed}" for o in outcomes(sure_records, "corrected") if too_small(o)]
    wrong = [
        f"{o.family}:{o.seed}"
        for o in outcomes(sure_records, "corrected")
        if not too_small(o) and not right(o, TOLERANCE)
    ]
    fixed_records = [r for r in corrected_records if not r["free"]]
    worse = [f"{r['kind']}:{r['seed']} ({gain(r):.2g})" for r in fixed_records if gain(r) < LARGER]
    notes = [
        f"too small by 5: {', '.join(small) or 'none'}",
        f"not right, since too large: {', '.join(wrong) or 'none'}",
        f"worse at equal engine time: {', '.join(worse) or 'none'}",
        f"{len(usable_records) - len(sure_records)} cases whose reference is not sure enough, "
        f"{len(failures)} failed",
        f"{len(halved_records)} with runs that needed half the step, whose error is not estimated",
    ]
    report(folder, "correction", HEADER, rows, {"cases": list(records.values())}, notes)


def main() -> None:
    arguments = options(
        __doc__,
        40,
        seed=(0, "first seed; documented tables have 1000000 or higher"),
        kinds=("", "kinds, separated by commas; all by default"),
        show=(0, "1: make the tables only"),
        file=("correction.jsonl", "name of the file of finished cases"),
    )
    file = arguments.output / arguments.file
    file.parent.mkdir(parents=True, exist_ok=True)
    lines = file.read_text(encoding="utf-8").splitlines() if file.is_file() else []
    finished_cases = {(r["kind"], r["seed"]) for r in map(json.loads, lines)}
    kinds = arguments.kinds.split(",") if arguments.kinds else list(DRAWS)
    samples_per_kind = -(-arguments.samples // len(kinds))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for seed in range(arguments.seed, arguments.seed + samples_per_kind * (not arguments.show)):
            for kind in kinds:
                if (kind, seed) not in finished_cases:
                    line = json.dumps(judge_case(kind, seed))
                    with file.open("a", encoding="utf-8") as stream:
                        stream.write(line + "\n")
    show(arguments.output, file.read_text(encoding="utf-8").splitlines())


if __name__ == "__main__":
    main()
