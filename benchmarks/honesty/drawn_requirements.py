"""Verdicts on requirements that are drawn: windows, worst cases, probabilities, shares, and peaks.

Responses are waves of normal and interval inputs, at few output times; windows start and end
between these. Every verdict is compared with that of quadrature, samples and a grid of the
intervals at many more times. What differs by less than the error of these is not counted.
"""

from __future__ import annotations

import json
import math
import warnings
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import xarray as xr
from scipy.special import ndtri
from scipy.stats import qmc

import flexband as fb
from benchmarks.harness import options, report

TOLERANCE = 0.01
KINDS = ("worst case", "probability", "share of parts", "peak")
FINE = 241
"""Times of a window at which the reference looks."""


@dataclass(frozen=True)
class Wave:
    """A (1 + a x + b e) sin(2π f t + φ + c e + d x) + s t (1 + 0.2 g) + 0.1 z."""

    size: float
    frequency: float
    start: float
    slopes: np.ndarray  # a, b, c, d
    drift: float

    @staticmethod
    def draw(r: np.random.Generator) -> Wave:
        slopes = r.uniform(-1, 1, 4) * (0.3, 0.3, 0.5, 0.2)
        return Wave(10 ** r.uniform(-1, 2), r.uniform(0.5, 2.5), r.uniform(0, 7), slopes,
                    r.uniform(-0.5, 0.5))  # fmt: skip

    def values(self, x, z, e, g, t) -> np.ndarray:
        """Return the wave of arrays that broadcast."""
        a, b, c, d = self.slopes
        turn = 2 * np.pi * self.frequency * t + self.start + c * e + d * x
        wave = (1 + a * x + b * e) * np.sin(turn) + self.drift * t * (1 + 0.2 * g) + 0.1 * z
        return self.size * wave

    def response(self, times: np.ndarray):
        """Return the response at output times."""

        def response(x, z, e, g):
            columns = (np.asarray(v)[:, None] for v in (x, z, e, g))
            values = self.values(*columns, times)
            coords = {"output": ["u"], "time": times}
            return xr.DataArray(values[:, None], coords, ("sample", "output", "time"))

        return response


INPUTS = {"x": fb.Normal(0.0, 1.0), "z": fb.Normal(0.0, 1.0),
          "e": fb.Interval(-1.0, 1.0), "g": fb.Interval(-1.0, 1.0)}  # fmt: skip
SCATTER = {"e": fb.Uniform(-1.0, 1.0), "g": fb.Uniform(-1.0, 1.0)}


def box(count: int) -> np.ndarray:
    """Return a grid of e and g, (count × 3, 2)."""
    return np.array([(e, g) for e in np.linspace(-1, 1, count) for g in (-1.0, 0.0, 1.0)])


def highest_bar(wave: Wave, times: np.ndarray, sigmas: float) -> np.ndarray:
    """Return the highest μ + kσ over the intervals at each time."""
    x, weights = np.polynomial.hermite_e.hermegauss(40)
    weights = weights / weights.sum()
    highest = np.full(len(times), -np.inf)
    for e, g in box(161):
        values = wave.values(x[:, None], 0.0, e, g, times)
        mean = weights @ values
        std = np.sqrt(weights @ (values - mean) ** 2 + (0.1 * wave.size) ** 2)
        highest = np.maximum(highest, mean + sigmas * std)
    return highest


def peaks_of_samples(wave: Wave, times: np.ndarray, seed: int, *, scattered: bool) -> np.ndarray:
    """Return the largest values in a window, (places, samples), sorted."""
    u = qmc.Sobol(4, rng=np.random.default_rng(seed)).random_base2(16 if scattered else 14)
    x, z = ndtri(np.clip(u[:, :2], 1e-12, 1 - 1e-12)).T
    times = times[:: max(1, len(times) // 60)]
    if scattered:
        e, g = 2 * u[:, 2:].T - 1
        values = [wave.values(x, z, e, g, t) for t in times]
        return np.sort(np.max(values, axis=0))[None]
    peak_rows = [np.max([wave.values(x, z, e, g, t) for t in times], axis=0) for e, g in box(9)]
    return np.sort(np.stack(peak_rows), axis=1)


def probability(peaks: np.ndarray, limit: float) -> float:
    """Return the largest probability of a peak above a limit."""
    return max(1 - np.searchsorted(row, limit) / len(row) for row in peaks)


def limit_of(peaks: np.ndarray, p: float) -> float:
    """Return the limit that is exceeded with a probability, at the worst place."""
    return float(max(row[min(len(row) - 1, math.ceil((1 - p) * len(row)))] for row in peaks))


def case(seed: int) -> list[dict]:
    """Return verdicts on one requirement of each kind, and what is true."""
    r = np.random.default_rng([seed, 99])
    # Draw a response.
    wave = Wave.draw(r)
    times = np.linspace(0.0, 1.0, int(r.integers(18 * wave.frequency + 12, 90)))
    response = wave.response(times)
    records = []
    requirements = []
    all_times = np.linspace(0.0, 1.0, FINE)
    width = float(np.mean(highest_bar(wave, all_times, 1.0)
                          + highest_bar(Wave(wave.size, wave.frequency, wave.start + np.pi,
                                             wave.slopes, -wave.drift),
                                        all_times, 1.0)))  # fmt: skip
    # Draw requirements near what is true.
    for kind in KINDS[:3]:
        first, last = np.sort(r.uniform(0.0, 1.0, 2))
        last = min(1.0, max(last, first + 0.05))
        window = None if r.random() < 0.2 else (float(first), float(last))
        fine = np.linspace(*(window or (0.0, 1.0)), FINE)
        part = float(r.choice([-1.0, 1.0]) * 10 ** r.uniform(-2.5, -0.3))
        if kind == "worst case":
            bound = float(highest_bar(wave, fine, 3.0).max()) + part * width
            margin = part
            criterion = fb.analysis.WorstCase(3.0)
            is_clear = abs(part) > 0.003
        else:
            peaks = peaks_of_samples(wave, fine, seed, scattered=kind != "probability")
            allowed_probability = float(10 ** r.uniform(-2.5, -0.5))
            exact = limit_of(peaks, allowed_probability)
            bound = exact + part * width
            margin = part
            true = probability(peaks, bound)
            is_clear = not allowed_probability / 1.15 < true < allowed_probability * 1.15
            make = fb.analysis.Probability if kind == "probability" else fb.analysis.ShareOfParts
            criterion = make(allowed_probability)
        requirements.append(fb.Requirement(kind, "u", below=bound, during=window,
                                           criterion=criterion))  # fmt: skip
        records.append({"kind": kind, "margin": margin, "clear": is_clear, "seed": seed})
    # Let a study judge them.
    study = fb.Study(response, INPUTS, fb.AdaptivePCCI(TOLERANCE), requirements=requirements,
                     scatter=SCATTER)  # fmt: skip
    with TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        result = study.run_in(folder, fb.RunOptions())
        for record, verdict in zip(records, result.verdicts, strict=True):
            record |= {"verdict": str(verdict.verdict), "reason": str(verdict.reason)}
        records.append(peak(wave, times, seed))
    return records


def peak(wave: Wave, times: np.ndarray, seed: int) -> dict:
    """Return whether the bounds of a peak over the intervals are those of a grid."""
    inputs = INPUTS | {"x": 0.0, "z": 0.0}
    surrogate = fb.expand(wave.response(times), inputs, fb.AdaptivePCCI(1e-4))
    bounds = fb.analysis.derived(surrogate, fb.analysis.Peak("u"))
    fine = np.linspace(0.0, 1.0, 4 * FINE)
    grid = [wave.values(0.0, 0.0, e, g, fine).max() for e, g in box(201)]
    exact = np.array([min(grid), max(grid)])
    off = float(np.abs(np.ravel(bounds["range"]) - exact).max() / wave.size)
    return {"kind": "peak", "margin": 1.0, "clear": True, "seed": seed,
            "verdict": "PASS" if off < 2e-3 else f"off by {off:.2g}"}  # fmt: skip


def row(kind: str, records: list[dict]) -> list[str]:
    """Return the line of a kind of requirement."""
    of_kind = [record for record in records if record["kind"] == kind]
    clear_records = [record for record in of_kind if record["clear"]]
    false_passes = [e for e in clear_records if e["verdict"] == "PASS" and e["margin"] < 0]
    false_failures = [
        e for e in clear_records if e["verdict"] not in ("PASS", "UNDECIDED") and e["margin"] > 0
    ]
    clear_margins = [record for record in of_kind if abs(record["margin"]) > 5 * TOLERANCE]
    undecided_count = sum(record["verdict"] == "UNDECIDED" for record in clear_margins)
    false_seeds = ", ".join(str(record["seed"]) for record in false_passes + false_failures)
    return [kind, str(len(of_kind)), str(len(false_passes)), str(len(false_failures)),
            str(len(clear_margins)),
            f"{100 * undecided_count / max(1, len(clear_margins)):.0f} %", false_seeds]  # fmt: skip


def main() -> None:
    arguments = options(__doc__, 100, seed=(0, "first seed; documented tables have fresh ones"))
    file = Path(arguments.output) / f"drawn_requirements_{arguments.seed}.jsonl"
    file.parent.mkdir(parents=True, exist_ok=True)
    records: list[dict] = []
    with file.open("w", encoding="utf-8") as stream:
        for seed in range(arguments.seed, arguments.seed + arguments.samples):
            records += (verdicts := case(seed))
            stream.writelines(json.dumps(record) + "\n" for record in verdicts)
            stream.flush()
    header = ["kind", "requirements", "false PASS", "false FAIL", "clear", "of these UNDECIDED",
              "seeds of false ones"]  # fmt: skip
    notes = [
        f"seeds from {arguments.seed} on; clear margins are above {5 * TOLERANCE:g} of the width"
    ]
    rows = [row(kind, records) for kind in KINDS]
    report(arguments.output, "drawn_requirements", header, rows, {}, notes)


if __name__ == "__main__":
    main()
