"""Errors of the methods against the number of runs, on studies with known bands.

An error is ∫|Δ| dt / ∫|reference| dt over both bounds, the largest of all outputs. At full size the
benchmark writes its table into docs/evidence/accuracy.md and its figure to
docs/images/accuracy.png.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from matplotlib.figure import Figure

import flexband as fb
from benchmarks.accuracy.cases import cases
from benchmarks.accuracy.estimates import claimed_error, details, estimates, notes
from benchmarks.accuracy.references import Case
from benchmarks.harness import ROOT, options, report
from flexband.study.comparison import relative_error
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.methods.method import Method

FULL = 200
"""With at least this many samples of LHS–Scanning the documentation is written."""

MAX_RUNS = 4000
MAX_POINTS = 32
"""Most runs of a method, and most points of the scan of LHS–Scanning."""

ERROR_RANGE = 5e-4, 100.0
"""Range of the errors in the figure [%]."""

START = "<!-- accuracy -->"
END = "<!-- end of accuracy -->"
STYLES = {
    "adaptive PCCI": "D-",
    "phase-resolved PCCI": "o-",
    "improved PCCI": "s--",
    "LHS–Scanning": "^:",
    "Sobol–Scanning": "v:",
    "regression PCCI": "x--",
    "perturbation–Chebyshev": "+:",
}

BUDGET = 96
"""Most runs of the adaptive method."""


def methods(case: Case, samples: int) -> Iterator[Method]:
    """Yield the methods to apply to a case, except those that take too many runs."""
    space = Space(case.inputs)
    candidates: list[Method] = [
        fb.AdaptivePCCI(tolerance, BUDGET, correct=False) for tolerance in (0.01, 0.001)
    ]
    candidates += [fb.methods.PhaseResolvedPCCI(*orders) for orders in case.orders]
    for highest_orders in case.orders[-1:]:
        candidates.append(fb.ImprovedPCCI(*highest_orders))
        for order in (3, 5) if samples >= FULL else ():
            candidates.append(
                fb.ImprovedPCCI(
                    *({name: min(order, 9 * k) for name, k in o.items()} for o in highest_orders)
                )
            )
        candidates.append(
            fb.methods.PerturbationChebyshev({name: 3 * q for name, q in highest_orders[1].items()})
        )
    candidates += [fb.methods.RegressionPCCI(order) for order in (2, 3)]
    points = [p for p in (5, 4, 3, 2) if p**space.interval_dimension <= MAX_POINTS]
    kinds = (fb.LHSScanning, fb.methods.SobolScanning)
    candidates += [kind(samples // 2, p) for p in points[:1] for kind in kinds]
    yield from (method for method in candidates if method.runs(space) <= MAX_RUNS)


def percent(band: xr.DataArray, truth: xr.DataArray) -> float:
    """Return the largest relative error of all outputs in per cent."""
    return 100 * float(np.max(relative_error(band, truth)))


def expected_error(bands: xr.Dataset, truth: xr.Dataset, variable: str) -> str:
    """Return the error that a method expects in per cent, or "" if it estimates none."""
    error = claimed_error(bands, variable)
    if error is None:
        return ""
    mean_error = error.mean("time")
    size = np.abs(truth[variable]).mean(("bound", "time"))
    return f"{100 * float((mean_error / size).max()):.2g}"


def main() -> None:
    arguments = options(__doc__, FULL, cases="run only the cases whose names contain this text")
    full_size = arguments.samples >= FULL
    studies = [(name, make) for name, make in cases().items() if arguments.cases in name]
    # Compare the bands of every method with the reference.
    rows = []
    points = {}
    claims = {}
    for name, make in studies[: None if full_size or arguments.cases else 2]:
        case = make()
        truth = case.reference()
        points[name] = {}
        for method in methods(case, arguments.samples):
            bands = fb.propagate(case.response, case.inputs, method)
            errors = [percent(bands[v], truth[v]) for v in ("mean", "error_bar")]
            expected_errors = [expected_error(bands, truth, v) for v in ("mean", "error_bar")]
            trusted = "" if "trusted" not in bands or bool(bands["trusted"].all()) else "no"
            runs = bands.attrs["runs"]
            rows.append(
                [
                    name,
                    method.label,
                    str(runs),
                    *(f"{e:.2g}" for e in errors),
                    *expected_errors,
                    trusted,
                ]
            )
            points[name].setdefault(method.name, []).append((runs, *errors))
            claims[name, method.name, method.label] = dict(estimates(bands, truth))
    # Write the table; at full size, the documentation too.
    header = ["case", "method", "runs", "mean", "error bar"]
    header += ["expected, mean", "expected, error bar", "trusted"]
    lines = [
        "errors are in per cent; orders are those of the random, then of the interval inputs",
        *notes(claims),
    ]
    measurements = {"points": points, "claims": details(claims)}
    report(arguments.output, "accuracy", header, rows, measurements, lines)
    if full_size and not arguments.cases:
        figure(points).savefig(ROOT / "docs" / "images" / "accuracy.png", dpi=100)
        write_table(ROOT / "docs" / "evidence" / "accuracy.md", header, rows, lines)


def figure(points: dict) -> Figure:
    """Draw the error of the interval error bar against runs, one panel per case."""
    ordinary_cases = {name: by_method for name, by_method in points.items() if "trap" not in name}
    drawing = Figure(figsize=(14, 8), layout="constrained")
    panels = drawing.subplots(3, 5, sharey=True).flat
    for (name, by_method), axes in zip(ordinary_cases.items(), panels, strict=False):
        for method, errors in by_method.items():
            runs, _, bar = np.array(sorted(errors)).T
            axes.loglog(runs, bar, STYLES[method], label=method, markersize=4)
        axes.set_title(name, fontsize=9)
        axes.grid(alpha=0.3)
        axes.set_ylim(*ERROR_RANGE)
    for axes in panels:
        axes.set_axis_off()
    drawing.supxlabel("runs")
    drawing.supylabel("error of the interval error bar [%]")
    drawing.axes[0].legend(fontsize=7)
    return drawing


def write_table(file: Path, header: list[str], rows: list[list[str]], lines: Sequence[str]) -> None:
    """Write the table, and the lines below it, between its marks in a file."""
    text = file.read_text(encoding="utf-8")
    table = ["| " + " | ".join(cells) + " |" for cells in [header, ["---"] * len(header), *rows]]
    table += ["", *(f"- {line}" for line in lines)]
    before, _, rest = text.partition(START)
    _, _, after = rest.partition(END)
    file.write_text("\n".join([before + START, *table, END]) + after, encoding="utf-8")


if __name__ == "__main__":
    main()
