"""The package as a whole: layers, names, and what importing it costs."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import flexband as fb

SOURCE = Path(fb.__file__).parent
ALLOWED = {
    "errors": {"errors"},
    "lanes": {"lanes"},
    "indices": {"indices"},
    "mechanics": {"errors", "lanes", "indices", "mechanics"},
    "uncertainty": {"errors", "uncertainty"},
    "study": {"errors", "uncertainty", "study"},
    "report": {"errors", "mechanics", "uncertainty", "study", "report"},
}


def imports(file):
    """Return the modules a file imports.

    Left out is what a function asks of the package's root when it is called, which is what users do
    too: the root loads a name's module only then, so such an import ties no layer to another.
    """
    tree = ast.parse(file.read_text(encoding="utf-8"))
    functions = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef)]
    late = {id(node) for function in functions for node in ast.walk(function)}
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            if node.module != "flexband" or id(node) not in late:
                yield node.module
        elif isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)


@pytest.mark.parametrize("part", ALLOWED)
def test_imports_go_downward(part):
    files = list((SOURCE / part).glob("*.py")) or [SOURCE / f"{part}.py"]
    assert files
    for file in files:
        for module in imports(file):
            top, _, rest = module.partition(".")
            if top == "flexband":
                assert rest.split(".")[0] in ALLOWED[part], f"{file.name} imports {module}"
            if part != "report":
                assert top not in ("matplotlib", "rich", "typer"), f"{file.name} imports {module}"


def test_importing_loads_nothing_heavy():
    code = "import flexband, sys; print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert not {"numpy", "numba", "scipy", "xarray", "matplotlib"} & set(loaded.stdout.split())


def test_public_names():
    assert set(fb.__all__) == set(fb._HOME)
    assert set(fb.__all__) <= set(dir(fb))
    for name in fb.__all__:
        assert getattr(fb, name).__doc__, name
    with pytest.raises(AttributeError, match="no attribute 'nonsense'"):
        fb.nonsense  # noqa: B018
