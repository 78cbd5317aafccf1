"""Machine code on disk: it runs only if all that it was made of is unchanged."""

import importlib
import os
import struct
import subprocess
import sys
import time
from collections import namedtuple
from pathlib import Path

import numpy as np
import pytest
from llvmlite import binding

from flexband.compilation import caching, targets
from flexband.compilation.functions import compiled
from flexband.compilation.targets import ENTRY
from flexband.mechanics.engine.entries import dynamics, statics
from flexband.study import compiling
from flexband.uncertainty.expansions.bounds.search import descents, starts
from flexband.uncertainty.phases.moments import by_points
from flexband.uncertainty.phases.phase_bounds import search

KERNEL = """
from flexband.compilation.caching import cached_on_disk
from springs import law

@cached_on_disk
def force(x, result):
    result[0] = law.stiffness(x) * x
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
    monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "user"))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)
    monkeypatch.syspath_prepend(str(tmp_path))
    yield write(tmp_path)
    forget()


def test_code_is_kept_until_something_changes(package, monkeypatch):
    """Whether there is code does not depend on the signature."""
    entry = importlib.import_module("springs.kernel").force
    assert not caching.is_compiled(entry)
    entry(2.0, np.zeros(1))
    assert caching.is_compiled(entry)
    forget()
    write(package.parent, stiffness=3.0)
    entry = importlib.import_module("springs.kernel").force
    assert not caching.is_compiled(entry)
    monkeypatch.setattr(caching, "_may_write", lambda folder: False)
    assert caching.is_compiled(entry)


def forget():
    for name in [name for name in sys.modules if name.split(".")[0] == "springs"]:
        del sys.modules[name]
    importlib.invalidate_caches()
    for cached in (caching._basis, caching._version, caching._file):
        cached.cache_clear()


def force(x=3.0):
    """Return the force as a new process would, and whether its code came from the disk."""
    forget()
    function = importlib.import_module("springs.kernel").force
    result = np.zeros(1)
    function(x, result)
    return result[0], not function.function.dispatcher.overloads


def files(folder):
    return sorted(folder.rglob("*.o"))


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
        monkeypatch.setattr(caching.SETTINGS, "boundscheck", True)
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
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "given"))
    assert [force(), force()] == [(6.0, False), (6.0, True)]
    assert len(files(tmp_path / "given")) == 1


def test_code_of_a_package_for_all_users_is_read(package, tmp_path, monkeypatch):
    force()
    monkeypatch.setattr(caching.os, "utime", None)  # any attempt to write would be seen
    with monkeypatch.context() as patch:
        patch.setattr(caching.os, "utime", lambda file: (_ for _ in ()).throw(PermissionError))
        assert force() == (6.0, True)


def test_old_code_does_not_accumulate(package, monkeypatch):
    monkeypatch.setattr(caching, "KEPT", 3)
    for k in range(caching.KEPT + 2):
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
    code = (
        "import numpy; from springs.kernel import force; x = numpy.zeros(1); force(3.0, x);"
        "print(x[0], int(not force.function.dispatcher.overloads))"
    )
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
    assert dynamics._basis is not None
    kernels = Path(caching.__file__).parents[1] / "mechanics" / "kernels"
    assert {file.name for file in kernels.rglob("*.py")} < {entry[0] for entry in dynamics._basis}


def test_code_on_disk_runs_without_numba():
    """Importing Numba takes longer than most runs."""
    code = (
        "import sys, numpy as np, flexband as fb; from tests.mechanics.models import pendulum;"
        "fb.simulate(pendulum(), duration=2e-3, step=1e-3);"
        "fb.propagate(lambda a: np.sin(a[:, None] * np.arange(9.0)), {'a': fb.Interval(0, 1)},"
        " fb.PCCI(1, 2)); print([name for name in sys.modules if name.startswith('numba')])"
    )
    for _ in range(2):  # the first process may have to compile
        last = subprocess.run([sys.executable, "-c", code], check=True, stdout=subprocess.PIPE)
    assert last.stdout == b"[]\n"


def test_code_of_others_depends_on_the_kernels_it_calls():
    basis = caching._basis("tests.mechanics.models")
    assert basis is not None
    assert {"models.py", "equations.py"} <= {entry[0] for entry in basis}


def test_code_that_the_package_comes_with(package, tmp_path, monkeypatch):
    """It runs as it is, with all versions, and never for other sources or settings."""
    force()
    (file,) = files(package)
    entry = importlib.import_module("springs.kernel").force
    shipped = entry.files(file.stem.rpartition("-")[2])[0]
    monkeypatch.setattr(caching, "SHIPPED", tmp_path / "objects")
    (tmp_path / "objects").mkdir()
    file.rename(tmp_path / "objects" / shipped.name)
    monkeypatch.setattr(caching, "version", lambda package: "9.9")
    assert force() == (6.0, True)
    assert not files(package)
    with monkeypatch.context() as patch:
        patch.setattr(caching.SETTINGS, "boundscheck", True)
        assert force() == (6.0, False)
        patch.setattr(caching.SETTINGS, "boundscheck", False)
        patch.setattr(caching, "instruction_set", lambda: ("x86-64", ""))
        assert force() == (6.0, False)
    write(package.parent, 3.0)
    assert force() == (9.0, False)
    number = package / "numbers.py"
    number.write_text("K = 2.0  # N/m\n", encoding="utf-8")
    assert force() == (6.0, True)


def symbols(content):
    """Return the symbols that an object needs, and those that others may use."""
    sections = {s.name(): s.data() for s in binding.ObjectFileRef.from_data(content).sections()}
    names = sections[b".strtab"]
    entries = list(struct.iter_unpack("<IBBHQQ", sections[b".symtab"]))
    name = {entry[0]: names[entry[0] :].partition(b"\0")[0].decode() for entry in entries}
    imports = {name[entry[0]] for entry in entries if entry[3] == 0} - {""}
    return imports, {name[entry[0]] for entry in entries if entry[3] and entry[1] >> 4}


@pytest.mark.skipif(sys.platform != "linux", reason="the objects are not in ELF")
def test_objects_need_the_c_library_alone():
    for part in compiling.PARTS.values():
        part[1]()
    entries = [dynamics, statics, starts, descents, search, by_points]
    for entry in entries:
        assert entry.codes
        for kind in entry.codes:
            paths = entry.files(caching._hash(kind))
            content = next(path.read_bytes() for path in paths if path.exists())
            imports, defined = symbols(content[32:])
            assert defined == {ENTRY}
            memory = {"malloc", "free", "memset", "memcpy", "memmove"}
            assert imports <= memory | {"atan2", "sincos", "pow"}


def test_code_that_needs_more_is_refused():
    def printed(x):
        print(x)

    def returned(x):
        return x

    with pytest.raises(TypeError, match=r"printed needs numba_gil_ensure, which"):
        caching.cached_on_disk(printed)(1.0)
    with pytest.raises(TypeError, match=r"returned returns float64; entries return nothing"):
        caching.cached_on_disk(returned)(1.0)


def test_code_calls_its_copies_of_functions():
    """A process uses the first of several weak functions of one name, whoever it was made for."""
    lines = "\n".join(f"    y = y * x + {k}.0 / (y - {k}.5)" for k in range(60))
    names = {}
    exec(f"def long(x):\n    y = x\n{lines}\n    return y\n", names)
    long = compiled(names["long"])

    def twice(x, result):
        result[0] = long(x) + long(x + 1.0)

    entry = caching.cached_on_disk(twice)
    result = np.zeros(1)
    entry(0.3, result)
    assert result[0] == pytest.approx(names["long"](0.3) + names["long"](1.3), rel=1e-6)


def test_arguments_of_all_kinds():
    """Numbers, arrays of all layouts, and named tuples of them."""

    def summed(a, b, numbers, flag, result):
        result[0] = a[1, 0] + 10 * b[2] + 100 * numbers.start + 1000 * numbers.array[1]
        result[1] = 1.0 if flag else 0.0

    entry = caching.cached_on_disk(summed)
    array = np.arange(6.0).reshape(2, 3)
    result = np.zeros(2)
    Numbers = namedtuple("Numbers", "start array")
    for a in (array, np.asfortranarray(array), array[:, ::2]):
        for flag in (True, False):
            entry(a, array[0], Numbers(7, array[1]), flag, result)
            assert list(result) == [3 + 20 + 700 + 4000, flag]
    array.flags.writeable = False
    entry(array, array[0], Numbers(np.int64(7), array[1]), False, result)
    assert list(result) == [4723, 0]


@pytest.mark.parametrize("name", ["x86-64-v4", "x86-64-v3", "x86-64"])
def test_the_largest_instruction_set_that_the_processor_has(monkeypatch, name):
    features = dict.fromkeys(targets.INSTRUCTION_SETS[name].split(), True) | {"avx512ifma": False}
    monkeypatch.setattr(targets.binding, "get_host_cpu_features", lambda: features)
    monkeypatch.setattr(targets.binding, "get_process_triple", lambda: "x86_64-any-linux")
    for setting in ("cpu_name", "cpu_features"):
        monkeypatch.setattr(targets.SETTINGS, setting, "")
    instruction_set = targets.instruction_set.__wrapped__
    monkeypatch.setattr(targets.SETTINGS, "enable_avx", True)
    assert instruction_set() == (name, "")
    monkeypatch.setattr(targets.SETTINGS, "cpu_name", "skylake")
    assert instruction_set() == ("skylake", "")
