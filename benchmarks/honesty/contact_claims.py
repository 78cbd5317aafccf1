"""Claims of studies of mechanisms with stops, clearances and friction, judged by many true runs.

Each seed draws a mechanism of `contact_mechanisms`, two to four uncertain inputs, and requirements
near what the outputs reach. The reference are runs on a grid of the inputs: bands follow by the
trapezoidal rule, which is exact for smooth functions of normal inputs, and shares of parts from
independent samples. The same is done with every second point in each direction; what the two
references judge differently is not sure, and is not counted. They have the same steps as the study,
so that errors of steps are not judged. Requirements are judged between the output times, too, by
runs at 32 times as many. An error bar μ ± kσ that leaves a bound only there is not sure either:
while a force jumps, it reaches where no run is.

Judged are expected errors, verdicts on requirements, and bands before the horizon of
predictability.

    python -m benchmarks.honesty.contact_claims --seed 1 --samples 100

goes on where it was stopped.
"""

from __future__ import annotations

import json
import time
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import xarray as xr

import flexband as fb
from benchmarks.harness import options, report
from benchmarks.honesty.contact_mechanisms import FAMILIES
from benchmarks.honesty.honesty import comparable_bands
from benchmarks.honesty.problems import Bands, Case
from benchmarks.honesty.rates import (
    FACTOR,
    ROUND_OFF,
    Outcome,
    Rate,
    false,
    outcome,
    rate,
    too_small,
)
from benchmarks.honesty.references import grid
from flexband.uncertainty.surrogates.diagnostics import unseen_share

TIMES = 40
FINER = 32
"""Number of steps between output times, and into how many parts references divide these."""

TOLERANCE = 0.01
RANDOM_NODES = (37, 19, 13)
INTERVAL_NODES = (33, 17, 9)
"""Numbers of points from −4.5 to 4.5 standard deviations, and from end to end of an interval."""

DIMENSIONS = [(0, 2), (1, 1), (2, 0), (0, 3), (1, 2), (2, 1), (0, 4), (2, 2)]
"""Numbers of random and interval inputs that are drawn."""

LEAST_RUNS = 600
"""Of the reference of mechanisms that move for a longer time."""

SIGMAS = 3.0
PARTS = 600
"""Independent samples that tell the true shares of parts."""


@dataclass(frozen=True)
class Reference:
    """True runs on a grid, (interval points, random points, outputs, times), and their weights.

    `fine_runs` are the same at more times.
    """

    runs: np.ndarray
    fine_runs: np.ndarray
    weights: np.ndarray

    def bands(self, sigmas: float = 1.0, *, fine: bool = False) -> Bands:
        """Return interval mean and interval error bar, (2, outputs, times) each."""
        runs = self.fine_runs if fine else self.runs
        mean = np.einsum("r,erot->eot", self.weights, runs)
        deviation = np.sqrt(np.einsum("r,erot->eot", self.weights, (runs - mean[:, None]) ** 2))
        low = mean - sigmas * deviation
        high = mean + sigmas * deviation
        return np.stack([mean.min(axis=0), mean.max(axis=0)]), np.stack(
            [low.min(axis=0), high.max(axis=0)]
        )


def nodes(n: int, m: int, max_runs: int) -> tuple[int, int] | None:
    """Return the largest numbers of points of n random and m interval inputs; None without any."""
    candidates = [
        (a, b)
        for a in RANDOM_NODES
        for b in INTERVAL_NODES
        if (a if n else 1) ** n * b**m <= max_runs
    ]
    return (
        max(candidates, key=lambda counts: counts[0] ** n * counts[1] ** m) if candidates else None
    )


@dataclass(frozen=True)
class UncertainMechanism:
    """A mechanism with uncertain inputs; `points` are the numbers of points of the reference."""

    family: str
    seed: int
    response: Any
    inputs: Mapping[str, fb.Input]
    points: tuple[int, int]

    def references(self) -> tuple[list[Reference], xr.DataArray]:
        """Return the reference, that with every second point in each direction, and the units."""
        # Values of the inputs on the grid.
        normal = [k for k, v in self.inputs.items() if v.random]
        intervals = [k for k, v in self.inputs.items() if not v.random]
        a, b = self.points
        x = np.linspace(-4.5, 4.5, a)
        y = np.linspace(-1.0, 1.0, b)
        xi = grid(*[x] * len(normal)) if normal else np.zeros((1, 0))
        eta = grid(*[y] * len(intervals)) if intervals else np.zeros((1, 0))
        values = {}
        for k, name in enumerate(normal):
            distribution = self.inputs[name]
            values[name] = np.tile(distribution.mean + distribution.std * xi[:, k], len(eta))
        for k, name in enumerate(intervals):
            distribution = self.inputs[name]
            middle = (distribution.upper + distribution.lower) / 2
            half = (distribution.upper - distribution.lower) / 2
            values[name] = np.repeat(middle + half * eta[:, k], len(xi))
        # Runs at the output times, and at more.
        coarse, fine = (response(**values) for response in (self.response, self.fine_response))
        points = (*[b] * len(intervals), *[a] * len(normal))
        # The reference, and that of every second point.
        pair = []
        for step in (1, 2):
            density = np.exp(-0.5 * x[::step] ** 2)
            weights = (
                grid(*[density / density.sum()] * len(normal)).prod(axis=1)
                if normal
                else np.ones(1)
            )
            runs = [
                outputs.values.reshape(*points, *outputs.shape[1:])[
                    (slice(None, None, step),) * len(points)
                ].reshape(-1, len(weights), *outputs.shape[1:])
                for outputs in (coarse, fine)
            ]
            pair.append(Reference(*runs, weights))
        return pair, coarse["unit"].reset_coords(drop=True)

    @property
    def fine_response(self) -> Any:
        """The response at more times."""
        return replace(self.response, output_step=self.response.output_step / FINER)

    def parts(self, rng: np.random.Generator) -> np.ndarray:
        """Return runs of independent parts with uniform tolerances, at more times than others."""
        values = {
            name: rng.normal(distribution.mean, distribution.std, PARTS)
            if distribution.random
            else rng.uniform(distribution.lower, distribution.upper, PARTS)
            for name, distribution in self.inputs.items()
        }
        return self.fine_response(**values).values


def draw(
    seed: int, longer: float = 1.0, dimensions: Sequence[tuple[int, int]] = DIMENSIONS
) -> tuple[UncertainMechanism, np.random.Generator]:
    """Return the mechanism of a seed, and what draws its requirements.

    Chaotic ones only, with fewer runs of the reference, if they move for a longer time.
    """
    rng = np.random.default_rng(seed)
    names = [name for name, family in FAMILIES.items() if longer == 1.0 or family.chaotic]
    name = names[seed % len(names)]
    family = FAMILIES[name]
    max_runs = family.runs if longer == 1.0 else LEAST_RUNS
    nominal = {
        k: float(np.exp(rng.uniform(*np.log([low, high]))))
        for k, (low, high, _) in family.ranges.items()
    }
    candidates = [
        counts for counts in dimensions if sum(counts) <= len(nominal) and nodes(*counts, max_runs)
    ]
    n, m = candidates[rng.integers(len(candidates))]
    all_sensors = list(family.builder(**nominal).sensors)
    sensors = [str(k) for k in rng.permutation(all_sensors)[: rng.integers(1, 3)]]
    parameters = [str(k) for k in rng.permutation(list(nominal))[: n + m]]
    inputs: dict[str, fb.Input] = {}
    for k, parameter in enumerate(parameters):
        value = nominal.pop(parameter)
        radius = value * family.ranges[parameter][2] * 10 ** rng.uniform(-1, 0)
        inputs[parameter] = (
            fb.Normal(value, radius / 2) if k < n else fb.Interval(value - radius, value + radius)
        )
    duration = longer * float(np.exp(rng.uniform(*np.log(family.duration))))
    points = nodes(n, m, max_runs)
    assert points is not None

    def builder(**values: np.ndarray) -> fb.Mechanism:
        model = family.builder(**nominal, **values)
        return replace(model, sensors={name: model.sensors[name] for name in sensors})

    response = fb.dynamic_response(
        builder, duration=duration, step=duration / TIMES, threads=1,
        integrator=fb.GeneralizedAlpha(step_tolerance=1e-6),
    )  # fmt: skip
    return UncertainMechanism(name, seed, response, inputs, points), rng


def varying_outputs(reference: Reference, units: np.ndarray) -> np.ndarray:
    """Return the numbers of outputs that vary by more than rounding.

    That is large where a constraint keeps one component of a vector, but the other one moves.
    """
    bar = reference.bands()[1]
    width = np.ptp(bar, axis=0).max(axis=-1)
    size = np.abs(bar).max(axis=(0, 2))
    size = np.array([size[units == unit].max() for unit in units])
    return np.flatnonzero(width > ROUND_OFF * size)


def requirements(
    mechanism: UncertainMechanism,
    outputs: np.ndarray,
    varying: np.ndarray,
    references: list[Reference],
    rng: np.random.Generator,
) -> tuple[list[fb.Requirement], list[list[bool]]]:
    """Return requirements near what outputs reach, and whether each reference has them met."""
    limits = []
    met = []
    ends = [reference.bands(SIGMAS)[1] for reference in references]
    fine_ends = [reference.bands(SIGMAS, fine=True)[1] for reference in references]
    width = np.ptp(ends[0], axis=0).mean(axis=-1)
    random = any(distribution.random for distribution in mechanism.inputs.values())
    # Worst cases near the ends of the bands.
    for o in rng.permutation(varying)[:2]:
        side = rng.choice(["below", "above"])
        margin = width[o] * 10 ** rng.uniform(-2, 0)
        margin *= rng.choice([-1.0, 1.0])
        extreme, *of_side = (
            bar[1, o].max() if side == "below" else -bar[0, o].min()
            for bar in [ends[0], *fine_ends, *(ends if random else [])]
        )
        bound = extreme + margin
        signed_bound = bound if side == "below" else -bound
        limits.append(
            fb.Requirement(f"worst {o}", str(outputs[o]), **{str(side): float(signed_bound)})
        )
        met.append([bool(value <= bound) for value in of_side])
    # Probabilities and shares near those of independent parts.
    runs = mechanism.parts(rng)
    at_outputs = runs[..., ::FINER]
    every_random = all(distribution.random for distribution in mechanism.inputs.values())
    criterion_of = fb.analysis.Probability if every_random else fb.analysis.ShareOfParts
    for o in rng.permutation(varying)[:2]:
        highest = np.sort(at_outputs[:, o].max(axis=-1))
        true = 10 ** rng.uniform(-2, -0.5)
        bound = highest[round((1 - true) * PARTS)]
        at_most = float(np.clip(true * 2 ** rng.uniform(-2, 2), 0.005, 0.9))
        criterion = criterion_of(at_most)
        limits.append(
            fb.Requirement(f"share {o}", str(outputs[o]), below=float(bound), criterion=criterion)
        )
        share = np.mean(runs[:, o].max(axis=-1) > bound)
        error = 2 * np.sqrt(share / PARTS)
        met.append([bool(share + s * error <= at_most) for s in (-1, 1)])
    return limits, met


def judge_mechanism(seed: int, method: Any, longer: float) -> dict[str, Any]:
    """Return what a study claims, and how far that is true; its failure if it fails.

    There are no requirements on mechanisms that move for a longer time.
    """
    mechanism, rng = draw(seed, longer)
    about: dict[str, Any] = {
        "seed": seed,
        "family": mechanism.family,
        "inputs": len(mechanism.inputs),
    }
    with warnings.catch_warnings(), TemporaryDirectory() as folder:
        warnings.simplefilter("ignore")
        try:
            return about | _judge(mechanism, rng if longer == 1.0 else None, method, folder)
        except (fb.errors.InputError, fb.errors.RunError) as error:
            return about | {"failure": f"{type(error).__name__}: {error}"[:200]}


def _judge(
    mechanism: UncertainMechanism, rng: np.random.Generator | None, method: Any, folder: str
) -> dict[str, Any]:
    references, units = mechanism.references()
    varying = varying_outputs(references[0], units.values)
    if not len(varying):
        return {"failure": "no output depends on the inputs"}
    # Make the study with its requirements.
    limits = list[fb.Requirement]()
    met = list[list[bool]]()
    if rng is not None:
        limits, met = requirements(mechanism, units["output"].values, varying, references, rng)
    scatter = {k: fb.Uniform(v.lower, v.upper) for k, v in mechanism.inputs.items() if not v.random}
    study = fb.Study(
        mechanism.response, mechanism.inputs, method, requirements=limits, scatter=scatter
    )
    start_time = time.process_time()
    result = study.run_in(folder)
    if not any(distribution.random for distribution in mechanism.inputs.values()):
        for store in {path.parent for path in Path(folder).rglob("runs.zarr")}:
            met = _refute(limits, met, fb.execution.open_runs(store)["outputs"].dropna("run"))
    about: dict[str, Any] = {
        "cpu": time.process_time() - start_time,
        "doubts": [str(doubt.kind) for doubt in result.doubts],
        "sampled": result.parts is not None,
        "unchecked": result.limits_unchecked,
        "verdicts": [
            {"name": v.name, "verdict": str(v.verdict), "reason": str(v.reason), "met": pair}
            for v, pair in zip(result.verdicts, met, strict=False)
        ],
    }
    # Compare its bands with the references.
    case = Case(
        mechanism.family, mechanism.seed, mechanism.response, mechanism.inputs, lambda _: truths[0]
    )
    truths = [reference.bands() for reference in references]
    bands = comparable_bands(result.bands, case)
    alike = str(bands.attrs.get("same_counts", "")).split(", ")
    counts = np.array([str(name) in alike for name in bands["output"].values])
    about["counts"] = [_share(references[0], o, bands) for o in varying[counts[varying]]]
    varying = varying[~counts[varying]]
    if len(varying):
        about["whole"] = [_outcome(mechanism, bands, varying, truth) for truth in truths]
    about["outputs"] = [_of_output(mechanism, bands, int(o), truths, result) for o in varying]
    return about


def _refute(
    limits: list[fb.Requirement], met: list[list[bool]], runs: xr.DataArray
) -> list[list[bool]]:
    """Return whether requirements are met; no worst case is that a run within intervals leaves."""
    violations = [
        limit.corridor(runs).margin(runs.values, runs.values).min() < 0 for limit in limits
    ]
    worst = [isinstance(limit.criterion, fb.analysis.WorstCase) for limit in limits]
    return [
        [False, False] if out and of_worst else pair
        for out, of_worst, pair in zip(violations, worst, met, strict=True)
    ]


def _share(reference: Reference, o: int, bands: xr.Dataset) -> dict[str, float]:
    """Return the share of parts whose count differs from the bands at any time, and the stated."""
    count = bands["error_bar"].isel(output=o, bound=0).values
    difference_mask = (np.abs(reference.runs[:, :, o] - count) > 0.5).any(axis=-1)
    expected_share = unseen_share(bands.attrs["runs_fitted"] + bands.attrs["runs_checked"])
    return {
        "true": float((difference_mask * reference.weights).sum(axis=1).mean()),
        "stated": expected_share,
    }


def _of_output(
    mechanism: UncertainMechanism, bands: xr.Dataset, o: int, truths: list[Bands], result: Any
) -> dict[str, Any]:
    """Return what is claimed of an output, and how far that is true, by each reference."""
    name = str(bands["output"].values[o])
    about: dict[str, Any] = {"output": name}
    for key, where in (("trusted", bands), ("confirmed", result.verification)):
        if where is not None and key in where:
            about[key] = bool(where[key].sel(output=name))
    about["whole"] = [_outcome(mechanism, bands, [o], truth) for truth in truths]
    if result.parts is not None:
        end = float(result.parts["horizon_low"].sel(output=name))
        before = int(np.searchsorted(bands["time"].values, end))
        about |= {"horizon": end, "times": before}
        if before > 1:
            about["before"] = [_outcome(mechanism, bands, [o], truth, before) for truth in truths]
    return about


def _outcome(
    mechanism: UncertainMechanism,
    bands: xr.Dataset,
    outputs: Any,
    truth: Bands,
    times: int | None = None,
) -> dict[str, Any]:
    selection = bands.isel(output=outputs, time=slice(times))
    mean, bar = (band[:, outputs, :times] for band in truth)
    return asdict(outcome(mechanism.family, mechanism.seed, selection, (mean, bar)))


def agreement(pair: list[dict[str, Any]], judge: Callable[[Outcome], bool]) -> list[bool]:
    """Return the judgement of an outcome if both references lead to it, or nothing."""
    judgements = {judge(Outcome(**record)) for record in pair}
    return list(judgements) if len(judgements) == 1 else []


def rates(cases: Sequence[dict[str, Any]]) -> list[Rate]:
    """Return the rates that are required."""
    successes = [case for case in cases if "failure" not in case]
    outputs = [record for case in successes for record in case["outputs"]]
    before = [record["before"] for record in outputs if "before" in record]
    trusted_outputs = [
        record["whole"]
        for record in outputs
        if record.get("trusted", True) and record.get("confirmed", True)
    ]
    false_verdicts = [
        (v["verdict"] == "PASS") != v["met"][0]
        for case in successes
        for v in case["verdicts"]
        if v["verdict"] != "UNDECIDED" and len(set(v["met"])) == 1
    ]

    def rate_of(
        name: str, pairs: Iterable[Any], judge: Callable[[Outcome], bool], required: str
    ) -> Rate:
        return rate(name, [hit for pair in pairs for hit in agreement(pair, judge)], required)

    def is_untrue(claim: Outcome) -> bool:
        return false(claim, TOLERANCE)

    def is_misleading(claim: Outcome) -> bool:
        return too_small(claim) and claim.true > TOLERANCE

    def holds(claim: Outcome) -> bool:
        return not is_misleading(claim)

    few = f"too small by {FACTOR:g}"
    return [
        rate_of(
            f"studies with claims {few}",
            [c["whole"] for c in successes if "whole" in c],
            too_small,
            "at most 1 %",
        ),
        rate_of(
            f"outputs with claims {few}",
            [o["whole"] for o in outputs],
            is_misleading,
            "at most 1 %",
        ),
        rate_of(
            f"confirmed outputs with claims {few}", trusted_outputs, is_misleading, "at most 1 %"
        ),
        rate_of("confirmed outputs, false", trusted_outputs, is_untrue, "at most 1 %"),
        rate(
            "counts alike in all runs, of which more parts differ than stated",
            [record["true"] > record["stated"] for case in successes for record in case["counts"]],
            "at most 5 %",
        ),
        rate("verdicts that are false", false_verdicts, "at most 1 %"),
        rate_of("bands before the horizon, right", before, holds, "90 %"),
    ]


def row(name: str, cases: Sequence[dict[str, Any]]) -> list[str]:
    """Return the line of a family."""
    successes = [case for case in cases if "failure" not in case]
    verdicts = [v["verdict"] for case in successes for v in case["verdicts"]]
    before = [o["before"][0] for case in successes for o in case["outputs"] if "before" in o]

    def middle(values: Iterable[float]) -> str:
        numbers = list(values)
        return f"{np.median(numbers):.2g}" if numbers else ""

    return [
        name,
        str(len(cases)),
        str(len(cases) - len(successes) or ""),
        middle(case["whole"][0]["runs"] for case in successes if "whole" in case),
        middle(100 * case["whole"][0]["true"] for case in successes if "whole" in case),
        middle(100 * case["whole"][0]["claim"] for case in successes if "whole" in case),
        str(sum(case["sampled"] for case in successes)),
        middle(100 * record["true"] for record in before),
        middle(100 * record["claim"] for record in before),
        *(str(verdicts.count(verdict)) for verdict in ("PASS", "FAIL", "UNDECIDED")),
        middle(case["cpu"] for case in successes),
    ]


def judge_cases(
    path: str, seeds: Sequence[int], judge: Callable[[int], dict[str, Any]]
) -> list[dict[str, Any]]:
    """Return the judged cases of seeds, with a "seed" each; those in a file are not judged again.

    The file has a line for each. It is made if it is missing.
    """
    file = Path(path)
    file.parent.mkdir(parents=True, exist_ok=True)
    lines = file.read_text(encoding="utf-8").splitlines() if file.exists() else []
    cases = {case["seed"]: case for case in map(json.loads, lines)}
    for seed in seeds:
        if seed not in cases:
            cases[seed] = judge(seed)
            with file.open("a", encoding="utf-8") as stream:
                stream.write(json.dumps(cases[seed]) + "\n")
    return [cases[seed] for seed in seeds]


HEADER = [
    "family", "mechanisms", "failed", "runs", "true error [%]", "claim [%]", "sampled",
    "true error before the horizon [%]", "claim there [%]", "PASS", "FAIL", "UNDECIDED", "CPU [s]",
]  # fmt: skip


def main() -> None:
    arguments = options(
        __doc__,
        100,
        seed=(1, "first seed; those of documented tables must not be looked at before"),
        file=("output/contact_claims.jsonl", "one line for each mechanism that was judged"),
        longer=(1.0, "factor of the durations; chaotic mechanisms only, if it is not 1"),
    )
    seeds = range(arguments.seed, arguments.seed + arguments.samples)
    method = fb.AdaptivePCCI(TOLERANCE, correct=False)
    cases = judge_cases(
        arguments.file, seeds, lambda seed: judge_mechanism(seed, method, arguments.longer)
    )
    families = {case["family"] for case in cases}
    rows = [
        row(name, [c for c in cases if c["family"] == name])
        for name in FAMILIES
        if name in families
    ]
    rows.append(row("all", cases))
    required_rates = rates(cases)
    notes = [
        f"seeds {seeds[0]} to {seeds[-1]}, tolerance {100 * TOLERANCE:g} %; errors, runs and CPU "
        "time are medians",
        *map(str, required_rates),
        *[f"failed: {c['seed']} {c['failure']}" for c in cases if "failure" in c],
    ]
    report(
        arguments.output,
        "contact_claims",
        HEADER,
        rows,
        {"rates": [asdict(r) for r in required_rates]},
        notes,
    )


if __name__ == "__main__":
    main()
