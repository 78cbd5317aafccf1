"""Public names: where they are, and what is loaded when."""

import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

import flexband as fb
from flexband.basics.namespaces import NAMESPACES
from tests.public_names import PLACES, PUBLIC

FLAT = {
    "Interval", "Normal", "RandomField", "PCCI", "ImprovedPCCI", "LHSScanning", "MonteCarlo",
    "AdaptivePCCI", "GeneralizedAlpha", "simulate", "propagate", "dynamic_response", "Study",
}  # fmt: skip
"""These stay where they are, whatever else moves."""


def test_few_names_are_flat():
    assert set(fb.__all__) >= FLAT
    assert (
        len(fb.__all__) <= 97
    )  # 90, states, an integral, requirements and their yield, a ramp, tables, joints that give,
    # animations
    assert sum(len(place.__all__) for place in PLACES.values()) == len(PUBLIC)


def test_every_namespace_can_be_imported_and_lists_its_names():
    for name in (*NAMESPACES, "plot"):
        module = import_module(f"flexband.{name}")
        assert getattr(fb, name) is module
        assert name in dir(fb)
        assert set(module.__all__) <= set(dir(module))
        assert module.__doc__


@pytest.mark.parametrize("name", NAMESPACES)
def test_names_of_a_namespace_are_not_those_of_its_modules(name):
    place = import_module(f"flexband.{name}")
    folder = Path(place.__file__).parent
    assert place.__dir__() == sorted(place.__all__)
    assert name == "errors" or not {file.stem for file in folder.iterdir()} & set(place.__all__)


def test_no_name_warns():
    code = "import warnings; warnings.simplefilter('error')\n" + "\n".join(
        f"from {place} import {name}" for place, module in PLACES.items() for name in module.__all__
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize(
    ("place", "name", "nearest"),
    [
        ("flexband", "RigidBoby", "flexband.RigidBody"),
        ("flexband", "Mattern", "flexband.fields.Matern"),
        ("flexband", "sobol_indices", "flexband.analysis.sobol_indices"),
        ("flexband", "analisys", "flexband.analysis"),
        ("flexband.fields", "matern", "flexband.fields.Matern"),
        ("flexband.fields", "RandomField", "flexband.RandomField"),
        ("flexband.errors", "SimulationEror", "flexband.errors.SimulationError"),
    ],
)
def test_a_misspelled_name_is_answered_with_the_nearest_one(place, name, nearest):
    message = f"module {place!r} has no attribute {name!r}; did you mean {nearest!r}"
    with pytest.raises(AttributeError, match=message.replace(".", r"\.")):
        getattr(import_module(place), name)


def test_nothing_like_it():
    with pytest.raises(AttributeError, match=r"no attribute 'nonsense'$"):
        fb.nonsense  # noqa: B018
    assert not hasattr(fb, "_repr_html_")


def test_namespaces_load_nothing_heavy():
    lazy = [f"flexband.{name}" for name in NAMESPACES if name != "errors"]
    code = f"import sys, {', '.join(lazy)}; print(*sys.modules)"
    process = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert not {"numpy", "numba", "scipy", "xarray", "matplotlib"} & set(process.stdout.split())
