"""Show that a change of the code changes no number (`make unchanged OPTIONS='--against REV'`).

The cases of unchanged_cases.py are computed with the working tree and with a commit, each in a
process of its own, and all arrays are compared bit for bit. With ``--save`` the results of the
commit are kept in a file, with which ``--compare`` compares any number of working trees.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).parents[1]
CASES = Path(__file__).with_name("unchanged_cases.py")
RAISED = "error"
"""Variable of a case that could not be computed: the error's text."""

Results = dict[str, np.ndarray]
"""Arrays by "case/variable"."""


def computed(source: Path, file: Path, names: list[str], **variables: str) -> Results:
    """Compute the cases with the package and the examples of a source tree, and write a file."""
    settings = {"OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(source / "src")}
    environment = {**variables, **os.environ, **settings}
    command = [sys.executable, CASES, file, *names]
    subprocess.run(command, env=environment, cwd=file.parent, check=True)
    return loaded(file)


def computed_at(revision: str, file: Path, names: list[str]) -> Results:
    """Compute the cases with a commit, which is checked out into a temporary folder.

    Its machine code is kept in the folder of the user, not beside the source.
    """
    cache = str(Path.home() / ".cache")
    with tempfile.TemporaryDirectory() as place:
        tree = Path(place) / "tree"
        git = ["git", "-C", str(ROOT), "worktree"]
        add = [*git, "add", "--detach", "--quiet", str(tree), revision]
        try:
            subprocess.run(add, check=True)
            return computed(tree, file, names, NUMBA_CACHE_DIR=cache)
        finally:
            subprocess.run([*git, "remove", "--force", str(tree)], check=False)


def loaded(file: Path) -> Results:
    """Return the results in a file."""
    with np.load(file) as archive:
        return dict(archive)


def difference(before: np.ndarray, after: np.ndarray) -> str:
    """Return the largest difference of two arrays as text; "" if all bits are equal but of NaN."""
    if before.shape != after.shape:
        return f"shape {after.shape} instead of {before.shape}"
    if before.dtype.kind != after.dtype.kind:
        return f"type {after.dtype} instead of {before.dtype}"
    if before.dtype.kind not in "fc":
        unequal = np.count_nonzero(before != after)
        return f"{unequal} of {before.size} values" if unequal else ""
    if before.dtype.kind == "c":
        before, after = (np.stack([array.real, array.imag]) for array in (before, after))
    nowhere = np.isnan(before) & np.isnan(after)
    if np.all(nowhere | ((before == after) & (np.signbit(before) == np.signbit(after)))):
        return ""
    finite = np.isfinite(before) & np.isfinite(after)
    if not np.array_equal(before[~finite], after[~finite], equal_nan=True):
        return "infinite or NaN at other places"
    numbers = before[finite]
    span = np.ptp(numbers) or np.abs(numbers).max() or 1.0
    return f"{np.abs(after[finite] - numbers).max() / span:.1e} of the range"


def table(before: Results, after: Results) -> tuple[Table, int]:
    """Return the comparison of all cases, and how many with fixed orders differ."""
    cases: dict[str, list[str]] = defaultdict(list)
    for key in sorted(before.keys() | after.keys()):
        case, variable = key.split("/", 1)
        cases[case].append(variable)
    rows, failures = Table("case", "arrays", "result"), 0
    for case, variables in cases.items():
        both = [name for name in variables if all(f"{case}/{name}" in r for r in (before, after))]
        pairs = {name: (before[f"{case}/{name}"], after[f"{case}/{name}"]) for name in both}
        differences = {name: text for name, pair in pairs.items() if (text := difference(*pair))}
        lines = [f"[red]{name}: {text}" for name, text in differences.items()]
        if RAISED in variables and f"{case}/{RAISED}" in after:
            lines = [f"[red]not computed: {after[f'{case}/{RAISED}']}"]
        failures += bool(lines) and not case.startswith("adaptive")
        for side, results in (("before", before), ("after", after)):
            alone = [k for k in variables if k not in both and f"{case}/{k}" in results]
            lines += [f"[yellow]only {side}: {', '.join(alone)}"] if alone else []
        rows.add_row(case, str(len(both)), "\n".join(lines or ["equal"]))
    return rows, failures


def main() -> None:
    """Compute, compare, and exit with 1 if a number at fixed orders differs."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--against", default="HEAD~1", metavar="REV", help="commit (HEAD~1)")
    parser.add_argument("--save", type=Path, metavar="FILE", help="keep the commit's results, stop")
    parser.add_argument("--compare", type=Path, metavar="FILE", help="instead of a commit")
    parser.add_argument("--source", type=Path, default=ROOT, metavar="FOLDER", help="working tree")
    parser.add_argument("--cases", nargs="+", default=[], metavar="NAME", help="only these")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as place:
        file = Path(place) / "before.npz"
        if options.compare:
            before = loaded(options.compare)
            chosen = {key: key.split("/")[0] in options.cases for key in before}
            before = {k: v for k, v in before.items() if chosen[k] or not options.cases}
        else:
            before = computed_at(options.against, file, options.cases)
        if options.save:
            with options.save.open("wb") as kept:
                np.savez_compressed(kept, **before)
            return
        after = computed(options.source.resolve(), Path(place) / "after.npz", options.cases)
    rows, failures = table(before, after)
    console = Console()
    console.print(rows)
    console.print(f"{len(before.keys() & after.keys())} arrays compared, {failures} cases differ")
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
