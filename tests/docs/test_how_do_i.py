"""Every line of the page "How do I …?" works."""

import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import flexband as fb
from flexband.cli.application import app
from flexband.cli.commands import load

PAGE = Path(__file__).parents[2] / "docs/how-to/how-do-i.md"
CODE = sorted(set(re.findall(r"`([^`]+)`", PAGE.read_text(encoding="utf-8"))))
PYTHON = [code for code in CODE if re.match(r"fb\.|surrogate\.|bands\W|\{", code)]
COMMANDS = [code for code in CODE if code.startswith("flexband ")]


@pytest.fixture(scope="module")
def names():
    """What the page calls the reader's."""
    mechanism = fb.Mechanism(
        bodies={"crank": fb.RigidBody(mass=1.0, inertia=0.01, points={"pin": (0.1, 0.0)})},
        joints={"shaft": fb.Revolute("crank.pin", (0.0, 0.0))},
        loads={"gravity": fb.Gravity(), "spring": fb.TorsionSpring("crank", stiffness=10.0)},
        sensors={"centre": fb.Position("crank")},
    )
    inputs = {name: fb.Interval(0.9, 1.1) for name in "abc"}
    time = np.linspace(0.0, 1.0, 21)

    def response(a, b, c):
        height = a[:, None] * np.sin(3 * time) + b[:, None] * c[:, None] * time
        coords = {"output": ["height"], "time": time}
        return xr.DataArray(height[:, None], coords, ("sample", "output", "time"))

    surrogate = fb.expand(response, inputs, fb.AdaptivePCCI(tolerance=0.01))
    bands = surrogate.bands()
    return {
        "fb": fb,
        "mechanism": mechanism,
        "inputs": inputs,
        "response": response,
        "surrogate": surrogate,
        "bands": bands,
        "measurements": np.random.default_rng(0).normal(10.0, 0.1, 100),
    }


@pytest.mark.parametrize("code", PYTHON)
def test_the_python_works(code, names, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    fb.save_surrogate(names["surrogate"], "surrogate.npz")
    eval(code, dict(names))


@pytest.mark.parametrize("code", COMMANDS)
def test_the_command_has_these_options(code):
    command = code.split()[1]
    load([command, "--help"])
    text = CliRunner().invoke(app, [command, "--help"], env={"COLUMNS": "200"}).output
    assert set(re.findall(r"--[\w-]+", code)) <= set(re.findall(r"--[\w-]+", text))


def test_the_page_is_long_enough_to_be_searched():
    rows = [line for line in PAGE.read_text(encoding="utf-8").splitlines() if line.startswith("| ")]
    assert len([row for row in rows if "How do I" not in row and "---" not in row]) >= 40
