"""Machine code on disk: it runs only if all that it was made of is unchanged."""

import importlib
import os
import subprocess
import sys
import time
from pathlib import Path

import pytest

from flexband import caching

KERNEL = """
from flexband.caching import cached_on_disk
from springs import law

@cached_on_disk
def force(x):
    return law.stiffness(x) * x
"""
LAW = """
from numba import njit
from springs.numbers import K

@njit
def stiffness(x):
    return K
"""


def write(folder, stiffness=2.0):
    """Write a package whose entry calls a file that reads a number from another one."""
    package = folder / "springs"
    package.mkdir(exist_ok=True)
    files = {"__init__": "", "kernel": KERNEL, "law": LAW, "numbers": f"K = {stiffness}\n"}
    for name, text in files.items():
        (package / f"{name}.py").write_text(text, encoding="utf-8")
        os.utime(package / f"{name}.py", (1e9, 1e9))  # as a wheel may do
    return package


@pytest.fixture
def package(tmp_path, monkeypatch):
    monkeypatch.setattr(caching, "LOADED", float("inf"))
    monkeypatch.setattr(caching.SETTINGS, "CACHE_DIR", "")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "user"))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.syspath_prepend(str(tmp_path))
    yield write(tmp_path)
    forget()


def test_code_is_kept_until_something_changes(package):
    """Whether there is code does not depend on the signature."""
    force = importlib.import_module("springs.kernel").force
    assert not caching.kept(force)
    force(2.0)
    assert caching.kept(force)
    forget()
    write(package.parent, stiffness=3.0)
    force = importlib.import_module("springs.kernel").force
    assert not caching.kept(force)
    (package.parent / "file").write_text("", encoding="utf-8")
    force._cache.folders = [package.parent / "file" / "folder"]  # where none can be written
    assert caching.kept(force)


def forget():
    for name in [name for name in sys.modules if name.split(".")[0] == "springs"]:
        del sys.modules[name]
    importlib.invalidate_caches()
    for cached in (caching._basis, caching._read, caching._version):
        cached.cache_clear()


def force():
    """Return the force at 3 as a new process would, and whether its code came from the disk."""
    forget()
    function = importlib.import_module("springs.kernel").force
    return function(3.0), bool(function.stats.cache_hits)


def files(folder):
    return sorted(folder.rglob("*.nbc"))


def test_code_is_compiled_once(package):
    assert [force(), force()] == [(6.0, False), (6.0, True)]
    assert len(files(package / "__pycache__")) == 1


def test_a_change_of_any_file_that_the_entry_calls_into_is_seen(package):
    assert force() == (6.0, False)
    write(package.parent, 4.0)  # two imports below the entry, of the same size and time
    assert [force(), force()] == [(12.0, False), (12.0, True)]
    write(package.parent)
    assert force() == (6.0, True)


@pytest.mark.parametrize("name", ["DEPENDENCIES", "SETTINGS"])
def test_versions_and_settings_are_a_part_of_the_key(package, monkeypatch, name):
    force()
    if name == "SETTINGS":
        monkeypatch.setattr(caching.SETTINGS, "BOUNDSCHECK", 1)
    else:
        monkeypatch.setattr(caching, "version", lambda package: "9.9")
    assert force() == (6.0, False)


@pytest.mark.parametrize(
    "damage",
    [
        lambda code: b"",
        lambda code: code[:-1],
        lambda code: code[:100] + bytes([code[100] ^ 1]) + code[101:],
        lambda code: b"\0" * len(code),
        lambda code: caching.hashlib.sha256(b"no pickle").digest() + b"no pickle",
    ],
)
def test_a_damaged_file_is_dropped_and_made_again(package, damage):
    force()
    (file,) = files(package)
    sound = file.read_bytes()
    file.write_bytes(damage(sound))
    assert [force(), force()] == [(6.0, False), (6.0, True)]
    assert files(package) == [file]


def test_where_code_is_kept(package, tmp_path, monkeypatch):
    """Of the user if the package cannot be written to; where the user says, if he does."""
    (package / "__pycache__").write_text("not a folder", encoding="utf-8")
    assert [force(), force()] == [(6.0, False), (6.0, True)]
    assert len(files(tmp_path / "user" / "flexband")) == 1
    (tmp_path / "file").write_text("not a folder", encoding="utf-8")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "file"))
    assert [force(), force()] == [(6.0, False), (6.0, False)]  # nowhere
    monkeypatch.setattr(caching.SETTINGS, "CACHE_DIR", str(tmp_path / "own"))
    assert [force(), force()] == [(6.0, False), (6.0, True)]
    assert len(files(tmp_path / "own")) == 1


def test_code_of_a_package_for_all_users_is_read(package, tmp_path, monkeypatch):
    force()
    monkeypatch.setattr(caching.os, "utime", None)  # any attempt to write would be seen
    with monkeypatch.context() as patch:
        patch.setattr(caching.os, "utime", lambda file: (_ for _ in ()).throw(PermissionError))
        assert force() == (6.0, True)


def test_old_code_does_not_accumulate(package):
    for k in range(caching.KEPT + 3):
        write(package.parent, float(k))
        force()
    assert len(files(package)) == caching.KEPT
    assert force() == (3.0 * k, True)


def test_code_is_not_kept_if_a_file_changed_since_the_start(package, monkeypatch):
    """The code in memory may then be older than the file."""
    monkeypatch.setattr(caching, "LOADED", time.time() - 60.0)
    assert force() == (6.0, False)
    assert not files(package)


def test_processes_share_the_code(tmp_path):
    package = write(tmp_path)
    code = "from springs.kernel import force; print(force(3.0), len(force.stats.cache_hits))"
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])}
    environment.pop("NUMBA_CACHE_DIR", None)

    def start():
        command = [sys.executable, "-c", code]
        return subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, text=True)

    at_once = [start(), start()]
    assert {process.communicate()[0] for process in at_once} <= {"6.0 0\n", "6.0 1\n"}
    assert start().communicate()[0] == "6.0 1\n"
    assert len(list((package / "__pycache__").glob("*force*"))) == 1


def test_the_engine_depends_on_every_kernel():
    basis = caching._basis("flexband.mechanics.engine.entries")
    assert basis is not None
    kernels = Path(caching.__file__).parent / "mechanics" / "kernels"
    assert {file.name for file in kernels.glob("*.py")} < {entry[0] for entry in basis[:-7]}


def test_code_of_others_depends_on_the_kernels_it_calls():
    basis = caching._basis("tests.mechanics.models")
    assert basis is not None
    assert {"models.py", "equations.py"} <= {entry[0] for entry in basis[:-7]}


def test_code_calls_its_copies_of_functions():
    """A process uses the first of several weak functions of one name, whoever it was made for."""
    lines = "\n".join(f"    y = y * x + {k}.0 / (y - {k}.5)" for k in range(300))
    names = {}
    exec(f"def long(x):\n    y = x\n{lines}\n    return y\n", names)
    long = caching.compiled(names["long"])

    def twice(x):
        return long(x) + long(x + 1.0)

    entry = caching.cached_on_disk(twice)
    assert entry(0.3) == pytest.approx(names["long"](0.3) + names["long"](1.3), rel=1e-6)
    (overload,) = entry.overloads.values()
    defined = [f for f in overload.library._final_module.functions if not f.is_declaration]
    assert any("long" in f.name for f in defined)
    assert not {f.name for f in defined if f.linkage.name.startswith(("linkonce", "weak"))}
