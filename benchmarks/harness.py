"""Shared by the benchmarks: options, alternating runs, machine data, and tables as files."""

from __future__ import annotations

import argparse
import json
import platform
import statistics
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from flexband.basics.cores import available_cores

ROOT = Path(__file__).parents[1]
PACKAGES = ("flexband", "numpy", "numba", "scipy", "xarray", "exudyn", "chaospy")


def options(
    description: str | None, samples: int, **extra_options: str | tuple[Any, str]
) -> argparse.Namespace:
    """Return the options of the command line: size, number of repetitions and output folder.

    `extra_options` are the further ones, name -> help of a text, or the default value and the help.
    """
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--samples", type=int, default=samples, help="samples per batch")
    parser.add_argument("--repeats", type=int, default=5, help="number of repetitions")
    parser.add_argument("--output", type=Path, default=ROOT / "output" / "bench")
    for name, definition in extra_options.items():
        default, meaning = ("", definition) if isinstance(definition, str) else definition
        option = f"--{name.replace('_', '-')}"
        parser.add_argument(option, type=type(default), default=default, help=meaning)
    return parser.parse_args()


def alternate(cases: Mapping[str, Callable[[], float]], repeats: int) -> dict[str, list[float]]:
    """Return `repeats` measurements of each case; the cases alternate."""
    measurements: dict[str, list[float]] = {name: [] for name in cases}
    for _ in range(repeats):
        for name, case in cases.items():
            measurements[name].append(case())
    return measurements


def medians(measurements: Mapping[str, Sequence[float]]) -> dict[str, float]:
    """Return the median of each case."""
    return {name: statistics.median(values) for name, values in measurements.items()}


def machine() -> dict[str, str]:
    """Return the processor, the number of cores and the versions of the software."""
    facts = {"processor": _processor(), "cores": str(available_cores())}
    facts["python"] = platform.python_version()
    for package in PACKAGES:
        try:
            facts[package] = version(package)
        except PackageNotFoundError:
            facts[package] = "not installed"
    return facts


def _processor() -> str:
    info = Path("/proc/cpuinfo")
    if info.is_file():
        for line in info.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def report(
    folder: Path,
    name: str,
    header: Sequence[str],
    rows: Sequence[Sequence[str]],
    measurements: Mapping[str, object],
    notes: Sequence[str] = (),
) -> None:
    """Print a table and write it to ``name.md`` and all numbers to ``name.json``."""
    facts = machine()
    lines = [f"## {name}", "", ", ".join(f"{key} {value}" for key, value in facts.items()), ""]
    lines += ["| " + " | ".join(header) + " |", "|" + " --- |" * len(header)]
    lines += ["| " + " | ".join(row) + " |" for row in rows]
    lines += ["", *(f"- {note}" for note in notes)]
    text = "\n".join(lines) + "\n"
    print(text)
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{name}.md").write_text(text, encoding="utf-8")
    numbers = json.dumps(
        {"machine": facts, "measured": measurements, "notes": list(notes)}, indent=1
    )
    (folder / f"{name}.json").write_text(numbers, encoding="utf-8")
