"""Build the wheel, and install, run and upgrade it on every Python of this machine.

The oldest Python gets the lowest versions that pyproject.toml states, all others the newest. The
oldest compiles the engine, the others the search for bounds. On the newest, the wheel is then
replaced by one with machine code, which must give the result of this working tree, and run the main
example, without compiling; on the oldest, by one whose search for bounds gives twice their values,
which must compute by it, and without compiling the engine. Both wheels are written into dist; with
`--check`, it is the oldest and the newest Python alone, with machine code for one instruction set,
and nothing is written.
"""

from __future__ import annotations

import math
import re
import shutil
import subprocess
import sys
import tempfile
import tomllib
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from objects import with_objects

ROOT = Path(__file__).parents[1]
PYTHONS = ("python3.11", "python3.12", "python3.13", "python3.14")
PIP = ("-m", "pip", "--quiet", "--disable-pip-version-check")
INSTALL = (*PIP, "install", "--no-compile")
STUDY = """
import numpy as np
import flexband as fb

def hanging(stiffness):
    mass = fb.PointMass(mass=1.0, position=(0.0, -1.0))
    spring = fb.Spring("mass", (0.0, 0.0), stiffness, 1.0)
    return fb.Mechanism(bodies={"mass": mass}, loads={"spring": spring, "gravity": fb.Gravity()},
                        sensors={"mass": fb.Position("mass")})

def response(stiffness):
    motion = fb.simulate(hanging(stiffness), duration=0.3, step=1e-3)
    return motion.sel(output="mass_Y").values[..., -1].reshape(-1)

study = fb.Study(response, {"stiffness": fb.Interval(90.0, 110.0)}, fb.PCCI(0, 2))
if __name__ == "__main__":
    print(response(np.array([100.0, 200.0]))[0])
"""

FORMULA = """
import flexband as fb

study = fb.Study(lambda stiffness: -9.81 / stiffness, {"stiffness": fb.Interval(90.0, 110.0)},
                 fb.PCCI(0, 2))
if __name__ == "__main__":
    print(float(study.run()["mean"].min()))
"""


def run(*command: object, folder: Path) -> str:
    """Run a command in a folder and return what it prints; stop if it fails."""
    done = subprocess.run(
        list(map(str, command)), cwd=folder, capture_output=True, text=True, check=False
    )
    if done.returncode:
        sys.exit(f"{' '.join(map(str, command))}\n{done.stdout}{done.stderr}")
    return done.stdout.strip()


def build(source: Path, folder: Path) -> Path:
    """Return the wheel of a source tree."""
    run(sys.executable, *PIP, "wheel", "--no-deps", "--wheel-dir", folder, source, folder=folder)
    (wheel,) = folder.glob("*.whl")
    return wheel


def lowest(folder: Path) -> Path:
    """Write the lowest versions that pyproject.toml states as a file of constraints."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    file = folder / "lowest.txt"
    lines = [re.sub(">=", "==", one) for one in project["dependencies"]]
    file.write_text("\n".join(lines), encoding="utf-8")
    return file


def check(
    name: str, base: str, wheel: Path, folder: Path, constraints: Path | None, study: str
) -> Path:
    """Install the wheel in an environment of its own, run it, and return the interpreter."""
    home = folder / name
    home.mkdir()
    run(base, "-m", "venv", home / "venv", folder=home)
    python = home / "venv" / "bin" / "python"
    limits = ("--constraint", constraints) if constraints else ()
    run(python, *INSTALL, "--only-binary", ":all:", *limits, wheel, folder=home)
    (home / "study.py").write_text(study, encoding="utf-8")
    flexband = python.with_name("flexband")
    run(flexband, "run", "study.py", "--verify", 2, folder=home)
    assert (home / "output" / "surrogate.npz").exists()
    run(flexband, "compare", "--help", folder=home)
    version = run(flexband, "--version", folder=home)
    print(f"{name}: flexband {version}, {'lowest' if constraints else 'newest'} versions: passed")
    return python


def upgrade(python: Path, folder: Path) -> None:
    """Replace the wheel by one whose bounds are twice the values, of the same version."""
    home = python.parents[2]
    (home / "formula.py").write_text(FORMULA, encoding="utf-8")
    exact = -1 - 9.81 / 100.0 * (1 - math.cos(0.3 * math.sqrt(100.0)))
    assert abs(float(run(python, "study.py", folder=home)) - exact) < 1e-5
    before, objects = run(python, "formula.py", folder=home), set(home.rglob("*dynamics*.o"))
    source = folder / "changed"
    unneeded = shutil.ignore_patterns(".venv", ".git", ".*_cache", "output")
    shutil.copytree(ROOT, source, ignore=unneeded)
    kernel = source / "src/flexband/uncertainty/expansions/bounds/search.py"
    text = kernel.read_text(encoding="utf-8")
    changed = text.replace("minimum[n] = values[n]", "minimum[n] = 2.0 * values[n]")
    assert changed != text
    kernel.write_text(changed, encoding="utf-8")
    (folder / "other").mkdir()
    other = build(source, folder / "other")
    run(python, *INSTALL, "--no-deps", "--force-reinstall", other, folder=home)
    after = run(python, "formula.py", folder=home)
    assert abs(float(before) + 9.81 / 90.0) < 1e-3, before
    assert float(after) == 2 * float(before), after
    assert abs(float(run(python, "study.py", folder=home)) - exact) < 1e-5
    assert set(home.rglob("*dynamics*.o")) == objects
    print(f"upgraded wheel: {before} -> {after}: passed")


def check_objects(python: Path, pure: Path, *, every: bool) -> None:
    """Show that a wheel with objects compiles nothing and gives the results of this tree."""
    home = python.parents[2]
    (home / "study.py").write_text(STUDY, encoding="utf-8")
    compiled = run(sys.executable, "study.py", folder=home)
    assert any(home.rglob("*.o"))
    wheel = with_objects(pure, every=every)
    run(python, *INSTALL, "--no-deps", "--force-reinstall", wheel, folder=home)
    before = set(home.rglob("*.o"))
    assert run(python, "study.py", folder=home) == compiled
    example = ROOT / "examples/slider_crank.py"
    run(python, "-m", "flexband", "run", example, "--output", "example", folder=home)
    assert set(home.rglob("*.o")) == before
    print(f"{wheel.name}: passed")
    if every:
        (ROOT / "dist").mkdir(exist_ok=True)
        for file in (pure, wheel):
            shutil.copy(file, ROOT / "dist")
        print("both wheels are in dist")


def main() -> None:
    """Check the wheel on all Pythons at once."""
    with tempfile.TemporaryDirectory() as place:
        folder, every = Path(place), "--check" not in sys.argv
        wheel = build(ROOT, folder)
        pythons = {name: python for name in PYTHONS if (python := interpreter(name))}
        names = list(pythons) if every else list(dict.fromkeys((min(pythons), max(pythons))))
        limits = [lowest(folder), *[None] * (len(names) - 1)]
        studies = [STUDY, *[FORMULA] * (len(names) - 1)]
        with ThreadPoolExecutor(min(2, len(names))) as pool:
            jobs = [
                pool.submit(check, name, pythons[name], wheel, folder, limit, study)
                for name, limit, study in zip(names, limits, studies, strict=True)
            ]
            installed = [job.result() for job in jobs]
            last = pool.submit(check_objects, installed[-1], wheel, every=every)
            pool.submit(upgrade, installed[0], folder).result()
            last.result()
    print(f"{len(names) + 2} passed, 0 failed")


def interpreter(name: str) -> str | None:
    """Return a Python that can make environments: on the path, or one that pyenv has."""
    found = [shutil.which(name)]
    if shutil.which("pyenv"):
        own = name.removeprefix("python") + "."
        versions = run("pyenv", "versions", "--bare", folder=ROOT).split()
        found += [
            str(Path(run("pyenv", "prefix", version, folder=ROOT)) / "bin" / name)
            for version in versions
            if version.startswith(own)
        ]
    for python in filter(None, found):
        command = [python, "-c", "import ensurepip, venv"]
        if subprocess.run(command, capture_output=True, check=False).returncode == 0:
            return python
    print(f"{name}: not on this machine, skipped")
    return None


if __name__ == "__main__":
    main()
