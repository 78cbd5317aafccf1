"""Public names: where they are, what former ones say, and what is loaded when."""

import subprocess
import sys
import warnings
from importlib import import_module
from pathlib import Path

import pytest

import flexband as fb
from flexband import deprecation
from flexband.namespaces import NAMESPACES
from tests.public_names import PLACES, PUBLIC

FLAT = {
    "Interval", "Normal", "RandomField", "PCCI", "ImprovedPCCI", "LHSScanning", "MonteCarlo",
    "AdaptivePCCI", "GeneralizedAlpha", "simulate", "propagate", "dynamic_response", "Study",
}  # fmt: skip
"""These stay where they are, whatever else moves."""

FORMER = {
    "analysis": """allocate ReciprocalCost Grades derived check_limits p_box path quantiles Peak
        failure_probability Magnitude PeakTime RootMeanSquare Spectrum Trough contributions
        sobol_indices tolerance_for value_range""",
    "errors": """AssemblyError FlexbandWarning InputError ModelError ResolutionWarning RunError
        RunsNeeded SimulationError StoreError StrainWarning ToleranceWarning""",
    "execution": "Dask Processes Store open_runs",
    "fields": """Matern exponential squared_exponential triangular eole Field karhunen_loeve
        orthogonal_series""",
    "methods": "PhaseResolvedPCCI RegressionPCCI PerturbationChebyshev SobolScanning",
    "models": """elsewhere samplewise ExternalProgram FMU UMBridgeModel UMBridgeServer serve""",
    "sections": "Circle GeneralSection Rectangle FullIntegration SelectiveIntegration",
}
MOVED = [(place, name) for place, names in FORMER.items() for name in names.split()]


@pytest.fixture(autouse=True)
def _nothing_announced(monkeypatch):
    monkeypatch.setattr(deprecation, "_announced", set())


def test_few_names_are_flat():
    assert set(fb.__all__) >= FLAT
    assert (
        len(fb.__all__) <= 96
    )  # 90, states, an integral, requirements and their yield, a ramp, tables, joints that give
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


@pytest.mark.parametrize(("place", "name"), MOVED)
def test_former_names_are_the_same_objects_and_say_where_they_are(place, name):
    new = f"flexband.{place}.{name}"
    with pytest.warns(FutureWarning, match=f"^flexband.{name} is called {new} now") as caught:
        former = getattr(fb, name)
    assert former is getattr(import_module(f"flexband.{place}"), name)
    assert caught[0].filename == __file__
    assert name not in fb.__all__
    assert name not in dir(fb)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert getattr(fb, name) is former


def test_a_former_name_is_imported_with_a_warning_at_the_callers_line():
    with pytest.warns(FutureWarning, match=r"flexband\.fields\.Matern") as caught:
        from flexband import Matern  # noqa: PLC0415
    assert Matern is fb.fields.Matern
    assert caught[0].filename == __file__


def test_no_other_name_warns():
    code = "import warnings; warnings.simplefilter('error')\n" + "\n".join(
        f"from {place} import {name}" for place, module in PLACES.items() for name in module.__all__
    )
    subprocess.run([sys.executable, "-c", code], check=True)


@pytest.mark.parametrize(
    ("place", "name", "nearest"),
    [
        ("flexband", "RigidBoby", "flexband.RigidBody"),
        ("flexband", "Mattern", "flexband.fields.Matern"),
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
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert not {"numpy", "numba", "scipy", "xarray", "matplotlib"} & set(loaded.stdout.split())
