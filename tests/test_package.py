"""The package as a whole: layers, names, and what importing it costs."""

import ast
import re
import subprocess
import sys
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from matplotlib.figure import Figure

import flexband as fb
from flexband.cli.commands import MODULES, asks_for_help, commands

SOURCE = Path(fb.__file__).parent
ROOMS = [
    "remarks",
    "basics.words",
    "basics.absent",
    "basics.namespaces",
    "errors",
    "basics",
    "compilation",
    "execution",
    "mechanics.kernels",
    "mechanics.time_functions",
    "mechanics.bodies",
    "mechanics.contact.geometry",
    "mechanics.contact",
    "mechanics.joints",
    "mechanics.loads",
    "mechanics.sensors",
    "mechanics.model",
    "mechanics.assembly",
    "mechanics.engine",
    "mechanics.linearization",
    "mechanics",
    "models",
    "uncertainty.expansions",
    "uncertainty.inputs",
    "uncertainty.phases",
    "uncertainty.surrogates",
    "uncertainty.methods",
    "uncertainty.adaptive",
    "uncertainty.phase_resolved",
    "uncertainty.runs",
    "uncertainty",
    "requirements",
    "analysis",
    "study",
    "report.text",
    "report.shapes",
    "report.drawing",
    "report.plot",
    "report.page",
    "report",
    "cli",
    "cli.answers",
    "__main__",
]
"""The folders and modules of the package, from the lowest up: each imports only those above it in
this list, and lower files of its own."""

HALVES = {"mechanics", "uncertainty"}, {"mechanics", "requirements"}, {"mechanics", "analysis"}
"""These do not know each other."""

NAMESPACES = {
    SOURCE / f"{name}.py"
    for name in ("contact", "fields", "loads", "methods", "plot", "sections", "sensors")
}
"""Files of public names alone, which belong to no room."""

FILES = {
    ".".join(file.relative_to(SOURCE).with_suffix("").parts): file
    for file in SOURCE.rglob("*.py")
    if file.name != "__init__.py" and file not in NAMESPACES
}

COMMAND_FILES = {FILES[f"cli.{module}"] for module in MODULES}


def room(module):
    """Return which of the rooms a module belongs to."""
    rooms = [name for name in ROOMS if f"{module}.".startswith(f"{name}.")]
    assert rooms, f"{module} belongs to no room"
    return ROOMS.index(max(rooms, key=len))


@cache
def imports(file):
    """Return every module that a file imports, inside functions as well, but not for types alone.

    Commands import what stands below ``if TYPE_CHECKING`` when they are called.
    """
    tree = ast.parse(file.read_text(encoding="utf-8"))
    if file not in COMMAND_FILES:
        tree.body = [node for node in tree.body if not is_for_types(node)]
    nodes = list(ast.walk(tree))
    from_modules = [node.module for node in nodes if isinstance(node, ast.ImportFrom)]
    modules = [alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names]
    return [*filter(None, from_modules), *modules]


def is_for_types(node):
    """Return whether a statement is ``if TYPE_CHECKING``."""
    return isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING"


def own_imports(file):
    """Yield the modules of the package that a file imports; the package itself counts as "cli"."""
    for module in imports(file):
        if module == "flexband":
            yield "cli"
        elif module.startswith("flexband."):
            yield module.removeprefix("flexband.")


@pytest.mark.parametrize("module", FILES)
def test_imports_go_downward(module):
    for other in own_imports(FILES[module]):
        assert room(other) <= room(module), f"{module} imports {other}"
        halves = {other.split(".")[0], module.split(".")[0]}
        assert halves not in HALVES, f"{module} imports {other}"


def test_no_circle():
    waiting = {module: set(own_imports(file)) & FILES.keys() for module, file in FILES.items()}
    while waiting:
        leaves = {
            module for module, dependencies in waiting.items() if not dependencies & waiting.keys()
        }
        assert leaves, f"these import each other: {sorted(waiting)}"
        waiting = {
            module: dependencies for module, dependencies in waiting.items() if module not in leaves
        }


def test_only_the_report_and_the_command_line_import_what_draws_and_prints():
    for module, file in FILES.items():
        if module.split(".")[0] not in ("report", "cli"):
            packages = {name.split(".")[0] for name in imports(file)}
            assert not packages & {"matplotlib", "rich", "typer"}, module


def test_importing_loads_nothing_heavy():
    code = "import flexband, sys; print(*sys.modules)"
    process = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert not {"numpy", "numba", "scipy", "xarray", "matplotlib"} & set(process.stdout.split())


HELP = [["--help"], *([name, "--help"] for name in commands())]
HEAVY = {"numba", "scipy", "xarray", "pandas", "zarr", "matplotlib", "plotly"}


@pytest.mark.parametrize("commands", [[["--version"], *HELP], [["status", "."]]])
def test_commands_that_compute_nothing_load_nothing_heavy(commands, tmp_path):
    code = f"""
import sys
from contextlib import suppress
from flexband.cli import app
for arguments in {commands}:
    with suppress(SystemExit):
        app(arguments)
    assert "flexband.cli.application" in sys.modules
    assert not {HEAVY} & sys.modules.keys(), arguments
"""
    subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, cwd=tmp_path)


def test_a_help_page_is_asked_for_anywhere_but_after_two_hyphens():
    assert asks_for_help(["run", "study.py", "--help"])
    assert not asks_for_help(["run", "--", "--help"])


def test_every_module_with_commands_is_known():
    folder = SOURCE / "cli"
    modules = {
        ".".join(file.relative_to(folder).with_suffix("").parts)
        for file in folder.rglob("*.py")
        if re.search(r"\n@(app\.command|answer_command)\(", file.read_text(encoding="utf-8"))
    }
    assert set(MODULES) == modules


def test_public_names():
    assert {"Mechanism", "propagate", "PCCI", "Interval", "draw", "describe"} <= set(fb.__all__)
    assert set(fb.__all__) <= set(dir(fb))
    for name in fb.__all__:
        assert getattr(fb, name).__doc__, name
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        fb.nonsense  # noqa: B018


def test_notebooks_show_a_mechanism_as_its_drawing():
    by_type = {}
    kind = SimpleNamespace(for_type=by_type.__setitem__)
    formatter = SimpleNamespace(formatters={"image/png": kind, "text/html": kind})
    fb.load_ipython_extension(SimpleNamespace(display_formatter=formatter))
    mass = fb.PointMass(mass=1.0, position=(np.float64(0.0), 0.0))
    image = by_type[fb.Mechanism](fb.Mechanism(bodies={"m": mass}))
    assert image.startswith(b"\x89PNG")
    assert by_type[Figure](fb.draw(fb.Mechanism(bodies={"m": mass}))) == image
