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
from benchmarks.honesty.honesty import compared
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

    The same is at `more` times.
    """

    runs: np.ndarray
    more: np.ndarray
    weights: np.ndarray

    def bands(self, sigmas: float = 1.0, *, between: bool = False) -> Bands:
        """Return interval mean and interval error bar, (2, outputs, times) each."""
        runs = self.more if between else self.runs
        mean = np.einsum("r,erot->eot", self.weights, runs)
        deviation = np.sqrt(np.einsum("r,erot->eot", self.weights, (runs - mean[:, None]) ** 2))
        low = mean - sigmas * deviation
        high = mean + sigmas * deviation
        return np.stack([mean.min(axis=0), mean.max(axis=0)]), np.stack(
            [low.min(axis=0), high.max(axis=0)]
        )


def nodes(n: int, m: int, most: int) -> tuple[int, int] | None:
    """Return the largest numbers of points of n random and m interval inputs; None without any."""
    fitting = [
        (a, b) for a in RANDOM_NODES for b in INTERVAL_NODES if (a if n else 1) ** n * b**m <= most
    ]
    return max(fitting, key=lambda both: both[0] ** n * both[1] ** m) if fitting else None


@dataclass(frozen=True)
class Drawn:
    """A mechanism with uncertain inputs; `points` are the numbers of points of the reference."""

    family: str
    seed: int
    response: Any
    inputs: Mapping[str, fb.Input]
    points: tuple[int, int]

    def references(self) -> tuple[list[Reference], xr.DataArray]:
        """Return the reference, that with every second point in each direction, and the units."""
        normal = [k for k, v in self.inputs.items() if v.random]
        intervals = [k for k, v in self.inputs.items() if not v.random]
        a, b = self.points
        x = np.linspace(-4.5, 4.5, a)
        y = np.linspace(-1.0, 1.0, b)
        xi = grid(*[x] * len(normal)) if normal else np.zeros((1, 0))
        eta = grid(*[y] * len(intervals)) if intervals else np.zeros((1, 0))
        values = {}
        for k, name in enumerate(normal):
            given = self.inputs[name]
            values[name] = np.tile(given.mean + given.std * xi[:, k], len(eta))
        for k, name in enumerate(intervals):
            given = self.inputs[name]
            middle = (given.upper + given.lower) / 2
            half = (given.upper - given.lower) / 2
            values[name] = np.repeat(middle + half * eta[:, k], len(xi))
        made, more = (response(**values) for response in (self.response, self.finer))
        points = (*[b] * len(intervals), *[a] * len(normal))
        both = []
        for step in (1, 2):
            one = np.exp(-0.5 * x[::step] ** 2)
            weights = grid(*[one / one.sum()] * len(normal)).prod(axis=1) if normal else np.ones(1)
            runs = [
                each.values.reshape(*points, *each.shape[1:])[
                    (slice(None, None, step),) * len(points)
                ].reshape(-1, len(weights), *each.shape[1:])
                for each in (made, more)
            ]
            both.append(Reference(*runs, weights))
        return both, made["unit"].reset_coords(drop=True)

    @property
    def finer(self) -> Any:
        """The response at more times."""
        return replace(self.response, output_step=self.response.output_step / FINER)

    def parts(self, rng: np.random.Generator) -> np.ndarray:
        """Return runs of independent parts with uniform tolerances, at more times than others."""
        values = {
            name: rng.normal(given.mean, given.std, PARTS)
            if given.random
            else rng.uniform(given.lower, given.upper, PARTS)
            for name, given in self.inputs.items()
        }
        return self.finer(**values).values


def draw(
    seed: int, longer: float = 1.0, dimensions: Sequence[tuple[int, int]] = DIMENSIONS
) -> tuple[Drawn, np.random.Generator]:
    """Return the mechanism of a seed, and what draws its requirements.

    Chaotic ones only, with fewer runs of the reference, if they move for a longer time.
    """
    rng = np.random.default_rng(seed)
    names = [name for name, family in FAMILIES.items() if longer == 1.0 or family.chaotic]
    name = names[seed % len(names)]
    family = FAMILIES[name]
    most = family.runs if longer == 1.0 else LEAST_RUNS
    nominal = {
        k: float(np.exp(rng.uniform(*np.log([low, high]))))
        for k, (low, high, _) in family.ranges.items()
    }
    fitting = [both for both in dimensions if sum(both) <= len(nominal) and nodes(*both, most)]
    n, m = fitting[rng.integers(len(fitting))]
    every = list(family.builder(**nominal).sensors)
    sensors = [str(k) for k in rng.permutation(every)[: rng.integers(1, 3)]]
    chosen = [str(k) for k in rng.permutation(list(nominal))[: n + m]]
    inputs: dict[str, fb.Input] = {}
    for k, parameter in enumerate(chosen):
        value = nominal.pop(parameter)
        radius = value * family.ranges[parameter][2] * 10 ** rng.uniform(-1, 0)
        inputs[parameter] = (
            fb.Normal(value, radius / 2) if k < n else fb.Interval(value - radius, value + radius)
        )
    duration = longer * float(np.exp(rng.uniform(*np.log(family.duration))))
    points = nodes(n, m, most)
    assert points is not None

    def builder(**values: np.ndarray) -> fb.Mechanism:
        made = family.builder(**nominal, **values)
        return replace(made, sensors={name: made.sensors[name] for name in sensors})

    response = fb.dynamic_response(
        builder, duration=duration, step=duration / TIMES, threads=1,
        integrator=fb.GeneralizedAlpha(step_tolerance=1e-6),
    )  # fmt: skip
    return Drawn(name, seed, response, inputs, points), rng


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
    drawn: Drawn,
    outputs: np.ndarray,
    varying: np.ndarray,
    references: list[Reference],
    rng: np.random.Generator,
) -> tuple[list[fb.Requirement], list[list[bool]]]:
    """Return requirements near what outputs reach, and whether each reference has them met."""
    made = []
    met = []
    ends = [reference.bands(SIGMAS)[1] for reference in references]
    between = [reference.bands(SIGMAS, between=True)[1] for reference in references]
    width = np.ptp(ends[0], axis=0).mean(axis=-1)
    random = any(given.random for given in drawn.inputs.values())
    for o in rng.permutation(varying)[:2]:
        side = rng.choice(["below", "above"])
        margin = width[o] * 10 ** rng.uniform(-2, 0)
        margin *= rng.choice([-1.0, 1.0])
        reached, *of_side = (
            bar[1, o].max() if side == "below" else -bar[0, o].min()
            for bar in [ends[0], *between, *(ends if random else [])]
        )
        bound = reached + margin
        signed = bound if side == "below" else -bound
        made.append(fb.Requirement(f"worst {o}", str(outputs[o]), **{str(side): float(signed)}))
        met.append([bool(value <= bound) for value in of_side])
    runs = drawn.parts(rng)
    at_outputs = runs[..., ::FINER]
    every_random = all(given.random for given in drawn.inputs.values())
    criterion_of = fb.analysis.Probability if every_random else fb.analysis.ShareOfParts
    for o in rng.permutation(varying)[:2]:
        highest = np.sort(at_outputs[:, o].max(axis=-1))
        true = 10 ** rng.uniform(-2, -0.5)
        bound = highest[round((1 - true) * PARTS)]
        at_most = float(np.clip(true * 2 ** rng.uniform(-2, 2), 0.005, 0.9))
        criterion = criterion_of(at_most)
        made.append(
            fb.Requirement(f"share {o}", str(outputs[o]), below=float(bound), criterion=criterion)
        )
        share = np.mean(runs[:, o].max(axis=-1) > bound)
        error = 2 * np.sqrt(share / PARTS)
        met.append([bool(share + s * error <= at_most) for s in (-1, 1)])
    return made, met


def judged(seed: int, method: Any, longer: float) -> dict[str, Any]:
    """Return what a study claims, and how far that is true; its failure if it fails.

    There are no requirements on mechanisms that move for a longer time.
    """
    drawn, rng = draw(seed, longer)
    about: dict[str, Any] = {"seed": seed, "family": drawn.family, "inputs": len(drawn.inputs)}
    with warnings.catch_warnings(), TemporaryDirectory() as folder:
        warnings.simplefilter("ignore")
        try:
            return about | _judged(drawn, rng if longer == 1.0 else None, method, folder)
        except (fb.errors.InputError, fb.errors.RunError) as error:
            return about | {"failure": f"{type(error).__name__}: {error}"[:200]}


def _judged(
    drawn: Drawn, rng: np.random.Generator | None, method: Any, folder: str
) -> dict[str, Any]:
    references, units = drawn.references()
    varying = varying_outputs(references[0], units.values)
    if not len(varying):
        return {"failure": "no output depends on the inputs"}
    limits = list[fb.Requirement]()
    met = list[list[bool]]()
    if rng is not None:
        limits, met = requirements(drawn, units["output"].values, varying, references, rng)
    scatter = {k: fb.Uniform(v.lower, v.upper) for k, v in drawn.inputs.items() if not v.random}
    study = fb.Study(drawn.response, drawn.inputs, method, requirements=limits, scatter=scatter)
    begun = time.process_time()
    result = study.run_in(folder)
    if not any(given.random for given in drawn.inputs.values()):
        for store in {path.parent for path in Path(folder).rglob("runs.zarr")}:
            met = _refuted(limits, met, fb.execution.open_runs(store)["outputs"].dropna("run"))
    about: dict[str, Any] = {
        "cpu": time.process_time() - begun,
        "doubts": [str(doubt.kind) for doubt in result.doubts],
        "sampled": result.parts is not None,
        "unchecked": result.limits_unchecked,
        "verdicts": [
            {"name": v.name, "verdict": str(v.verdict), "reason": str(v.reason), "met": both}
            for v, both in zip(result.verdicts, met, strict=False)
        ],
    }
    case = Case(drawn.family, drawn.seed, drawn.response, drawn.inputs, lambda _: truths[0])
    truths = [reference.bands() for reference in references]
    found = compared(result.bands, case)
    alike = str(found.attrs.get("same_counts", "")).split(", ")
    counts = np.array([str(name) in alike for name in found["output"].values])
    about["counts"] = [_share(references[0], o, found) for o in varying[counts[varying]]]
    varying = varying[~counts[varying]]
    if len(varying):
        about["whole"] = [_outcome(drawn, found, varying, truth) for truth in truths]
    about["outputs"] = [_of_output(drawn, found, int(o), truths, result) for o in varying]
    return about


def _refuted(
    limits: list[fb.Requirement], met: list[list[bool]], runs: xr.DataArray
) -> list[list[bool]]:
    """Return whether requirements are met; no worst case is that a run within intervals leaves."""
    left = [limit.corridor(runs).margin(runs.values, runs.values).min() < 0 for limit in limits]
    worst = [isinstance(limit.criterion, fb.analysis.WorstCase) for limit in limits]
    return [
        [False, False] if out and of_worst else both
        for out, of_worst, both in zip(left, worst, met, strict=True)
    ]


def _share(reference: Reference, o: int, found: xr.Dataset) -> dict[str, float]:
    """Return the share of parts whose count differs from the bands at any time, and the stated."""
    count = found["error_bar"].isel(output=o, bound=0).values
    differ = (np.abs(reference.runs[:, :, o] - count) > 0.5).any(axis=-1)
    stated = unseen_share(found.attrs["runs_fitted"] + found.attrs["runs_checked"])
    return {"true": float((differ * reference.weights).sum(axis=1).mean()), "stated": stated}


def _of_output(
    drawn: Drawn, found: xr.Dataset, o: int, truths: list[Bands], result: Any
) -> dict[str, Any]:
    """Return what is claimed of an output, and how far that is true, by each reference."""
    name = str(found["output"].values[o])
    about: dict[str, Any] = {"output": name}
    for key, where in (("trusted", found), ("confirmed", result.verification)):
        if where is not None and key in where:
            about[key] = bool(where[key].sel(output=name))
    about["whole"] = [_outcome(drawn, found, [o], truth) for truth in truths]
    if result.parts is not None:
        end = float(result.parts["horizon_low"].sel(output=name))
        before = int(np.searchsorted(found["time"].values, end))
        about |= {"horizon": end, "times": before}
        if before > 1:
            about["before"] = [_outcome(drawn, found, [o], truth, before) for truth in truths]
    return about


def _outcome(
    drawn: Drawn, found: xr.Dataset, chosen: Any, truth: Bands, times: int | None = None
) -> dict[str, Any]:
    bands = found.isel(output=chosen, time=slice(times))
    mean, bar = (band[:, chosen, :times] for band in truth)
    return asdict(outcome(drawn.family, drawn.seed, bands, (mean, bar)))


def sure(pair: list[dict[str, Any]], judge: Callable[[Outcome], bool]) -> list[bool]:
    """Return the judgement of an outcome if both references lead to it, or nothing."""
    both = {judge(Outcome(**one)) for one in pair}
    return list(both) if len(both) == 1 else []


def rates(cases: Sequence[dict[str, Any]]) -> list[Rate]:
    """Return the rates that are required."""
    done = [case for case in cases if "failure" not in case]
    outputs = [one for case in done for one in case["outputs"]]
    before = [one["before"] for one in outputs if "before" in one]
    trusted = [
        one["whole"] for one in outputs if one.get("trusted", True) and one.get("confirmed", True)
    ]
    decided = [
        (v["verdict"] == "PASS") != v["met"][0]
        for case in done
        for v in case["verdicts"]
        if v["verdict"] != "UNDECIDED" and len(set(v["met"])) == 1
    ]

    def of(
        name: str, pairs: Iterable[Any], judge: Callable[[Outcome], bool], required: str
    ) -> Rate:
        return rate(name, [hit for pair in pairs for hit in sure(pair, judge)], required)

    def untrue(one: Outcome) -> bool:
        return false(one, TOLERANCE)

    def misleading(one: Outcome) -> bool:
        return too_small(one) and one.true > TOLERANCE

    def kept(one: Outcome) -> bool:
        return not misleading(one)

    few = f"too small by {FACTOR:g}"
    return [
        of(
            f"studies with claims {few}",
            [c["whole"] for c in done if "whole" in c],
            too_small,
            "at most 1 %",
        ),
        of(f"outputs with claims {few}", [o["whole"] for o in outputs], misleading, "at most 1 %"),
        of(f"confirmed outputs with claims {few}", trusted, misleading, "at most 1 %"),
        of("confirmed outputs, false", trusted, untrue, "at most 1 %"),
        rate(
            "counts alike in all runs, of which more parts differ than stated",
            [one["true"] > one["stated"] for case in done for one in case["counts"]],
            "at most 5 %",
        ),
        rate("verdicts that are false", decided, "at most 1 %"),
        of("bands before the horizon, right", before, kept, "90 %"),
    ]


def row(name: str, cases: Sequence[dict[str, Any]]) -> list[str]:
    """Return the line of a family."""
    done = [case for case in cases if "failure" not in case]
    verdicts = [v["verdict"] for case in done for v in case["verdicts"]]
    before = [o["before"][0] for case in done for o in case["outputs"] if "before" in o]

    def middle(values: Iterable[float]) -> str:
        numbers = list(values)
        return f"{np.median(numbers):.2g}" if numbers else ""

    return [
        name,
        str(len(cases)),
        str(len(cases) - len(done) or ""),
        middle(case["whole"][0]["runs"] for case in done if "whole" in case),
        middle(100 * case["whole"][0]["true"] for case in done if "whole" in case),
        middle(100 * case["whole"][0]["claim"] for case in done if "whole" in case),
        str(sum(case["sampled"] for case in done)),
        middle(100 * one["true"] for one in before),
        middle(100 * one["claim"] for one in before),
        *(str(verdicts.count(verdict)) for verdict in ("PASS", "FAIL", "UNDECIDED")),
        middle(case["cpu"] for case in done),
    ]


def judged_cases(
    path: str, seeds: Sequence[int], judge: Callable[[int], dict[str, Any]]
) -> list[dict[str, Any]]:
    """Return the judged cases of seeds, with a "seed" each; those in a file are not judged again.

    The file has a line for each. It is made if it is missing.
    """
    file = Path(path)
    file.parent.mkdir(parents=True, exist_ok=True)
    lines = file.read_text(encoding="utf-8").splitlines() if file.exists() else []
    known = {case["seed"]: case for case in map(json.loads, lines)}
    for seed in seeds:
        if seed not in known:
            known[seed] = judge(seed)
            with file.open("a", encoding="utf-8") as stream:
                stream.write(json.dumps(known[seed]) + "\n")
    return [known[seed] for seed in seeds]


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
    cases = judged_cases(arguments.file, seeds, lambda seed: judged(seed, method, arguments.longer))
    families = {case["family"] for case in cases}
    rows = [
        row(name, [c for c in cases if c["family"] == name])
        for name in FAMILIES
        if name in families
    ]
    rows.append(row("all", cases))
    required = rates(cases)
    notes = [
        f"seeds {seeds[0]} to {seeds[-1]}, tolerance {100 * TOLERANCE:g} %; errors, runs and CPU "
        "time are medians",
        *map(str, required),
        *[f"failed: {c['seed']} {c['failure']}" for c in cases if "failure" in c],
    ]
    report(
        arguments.output,
        "contact_claims",
        HEADER,
        rows,
        {"rates": [asdict(r) for r in required]},
        notes,
    )


if __name__ == "__main__":
    main()
