"""Show that a change of the code changes no number (`make unchanged OPTIONS='--against REV'`).

The cases of unchanged_cases.py are computed with the working tree and with a commit, each in a
process of its own, and all arrays are compared bit for bit. With ``--save`` the results of the
commit are kept in a file, with which ``--compare`` compares any number of working trees.
"""

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
Results = dict[str, np.ndarray]  # by "case/variable"


def computed(source: Path, file: Path, names: list[str], **variables: str) -> Results:
    """Compute the cases with the package and the examples of a source tree, and write a file.

    Machine code that was just compiled may round otherwise than the same code read from disk, so a
    process that wrote machine code is followed by another one.
    """
    settings = {"OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(source / "src")}
    command = [sys.executable, Path(__file__).with_name("unchanged_cases.py"), file, *names]
    environment = {**variables, **os.environ, **settings}
    cache = Path(environment.get("NUMBA_CACHE_DIR", Path.home() / ".cache")) / "flexband"
    kept: set[Path] = {Path()}
    while kept != (kept := {f for place in (source / "src", cache) for f in place.rglob("*.o")}):
        subprocess.run(command, env=environment, cwd=file.parent, check=True)
    return loaded(file)


def computed_at(revision: str, file: Path, names: list[str]) -> Results:
    """Compute the cases with a commit; its machine code is kept in the folder of the user."""
    tree, git = file.with_name("tree"), ["git", "-C", ROOT, "worktree"]
    subprocess.run([*git, "add", "--quiet", "--detach", tree, revision], check=True)
    try:
        return computed(tree, file, names, NUMBA_CACHE_DIR=str(Path.home() / ".cache"))
    finally:
        subprocess.run([*git, "remove", "--force", tree], check=True)


def loaded(file: Path) -> Results:
    """Return the results in a file."""
    with np.load(file) as archive:
        return dict(archive)


def difference(before: np.ndarray, after: np.ndarray) -> str:
    """Return the largest difference of two arrays; "" if all bits are equal, but those of NaN."""
    kinds = [f"{array.dtype.kind}{array.shape}" for array in (before, after)]
    if kinds[0] != kinds[1]:
        return f"{kinds[1]} instead of {kinds[0]}"
    if before.dtype.kind != "f":
        unequal = np.count_nonzero(before != after)
        return f"{unequal} of {before.size} values" if unequal else ""
    nowhere = np.isnan(before) & np.isnan(after)
    if np.all(nowhere | ((before == after) & (np.signbit(before) == np.signbit(after)))):
        return ""
    finite = before[np.isfinite(before)]
    span = np.max(finite, initial=-np.inf) - np.min(finite, initial=np.inf)
    scale = span if span > 0 else np.abs(finite).max(initial=0.0) or 1.0
    return f"{np.abs(after - before)[~nowhere].max() / scale:.1e} of the range"


def compared(before: Results, after: Results) -> tuple[Table, int]:
    """Return the table of all cases, and how many of those with fixed orders differ."""
    cases: dict[str, list[str]] = defaultdict(list)
    for key in sorted(before.keys() | after.keys()):
        cases[key.split("/")[0]].append(key)
    rows, failures = Table("case", "arrays", "result"), 0
    for case, keys in cases.items():
        both = [key for key in keys if key in before and key in after]
        differences = {key: difference(before[key], after[key]) for key in both}
        if f"{case}/error" in after:
            differences[f"{case}/error"] = str(after[f"{case}/error"])
        lines = [f"{key.split('/', 1)[1]}: {text}" for key, text in differences.items() if text]
        failures += bool(lines) and not case.startswith("adaptive")
        if len(lines) > 8:
            lines[8:] = [f"… {len(lines) - 8} more arrays"]
        for side, results in (("before", before), ("after", after)):
            alone = [key.split("/")[1] for key in keys if key in results and key not in both]
            lines += [f"only {side}: {', '.join(alone)}"] if alone else []
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
    names = options.cases
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "results.npz"
        given = options.compare
        before = loaded(given) if given else computed_at(options.against, file, names)
        if options.save:
            with options.save.open("wb") as kept:
                np.savez_compressed(kept, **before)  # pyright: ignore[reportArgumentType]
            return
        after = computed(options.source.resolve(), file, names)
    before = {key: a for key, a in before.items() if not names or key.split("/")[0] in names}
    rows, failures = compared(before, after)
    count = len(before.keys() & after.keys())
    Console().print(rows, f"{count} arrays compared, {failures} cases differ")
    sys.exit(1 if failures else 0)


if __name__ == "__main__":
    main()
