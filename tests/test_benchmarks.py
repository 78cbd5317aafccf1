"""Every benchmark can be imported: names that it uses exist."""

import importlib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
MODULES = [
    ".".join(file.relative_to(ROOT).with_suffix("").parts)
    for file in (ROOT / "benchmarks").rglob("*.py")
    if file.name != "__init__.py"
]


PEERS = {"chaospy", "exudyn"}
"""`make bench` installs them."""


@pytest.mark.parametrize("module", sorted(MODULES))
def test_every_benchmark_is_imported(module):
    try:
        importlib.import_module(module)
    except ModuleNotFoundError as error:
        if error.name not in PEERS:
            raise
