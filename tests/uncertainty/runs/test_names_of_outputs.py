"""Names of a response's coordinates and outputs: refused at once, or right in every result."""

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import flexband as fb
from flexband.cli import app
from flexband.uncertainty.inputs.evaluation import OF_BANDS, RESERVED

TIMES = np.linspace(0.5, 1.0, 5)
INPUTS = {"a": fb.Interval(0.9, 1.1), "x": fb.Normal(0, 1)}


def response(a, x):
    values = np.stack([np.outer(a + 0.1 * x, TIMES), np.outer(a * a + 0.1 * x, TIMES)], axis=1)
    coords = {"output": ["u", "v"], "time": TIMES}
    return xr.DataArray(values, coords, ("sample", "output", "time"))


def test_all_variables_of_bands_are_known():
    """A method with a new one must name it."""
    methods = (
        fb.PCCI(1, 1),
        fb.AdaptivePCCI(),
        fb.methods.PhaseResolvedPCCI(1, 1),
        fb.MonteCarlo(8, 3),
    )
    results = [fb.propagate(response, INPUTS, method) for method in methods]
    surrogates = [fb.expand(response, INPUTS, method) for method in methods[:3]]
    results += [
        surrogate.diagnostics for surrogate in surrogates if isinstance(surrogate, fb.Surrogate)
    ]
    results += [fb.verify(surrogate, response, runs=4).verification for surrogate in surrogates]
    results.append(fb.propagate(response, INPUTS | {"x": fb.Choice(0.0, 1.0)}, fb.PCCI(1, 1)))
    names = {str(name) for result in results for name in result.variables}
    assert names - {"output", "time", "sample"} <= OF_BANDS | set(RESERVED)


@pytest.mark.parametrize("name", ["mean", "error_bar_at", "truncation", "trusted"])
@pytest.mark.parametrize("method", [fb.PCCI(1, 3), fb.AdaptivePCCI()])
def test_coordinates_called_as_bands_are_refused_at_the_first_batch(name, method):
    calls = []

    def with_coordinate(a, x):
        calls.append(len(a))
        return response(a, x).assign_coords({name: 1.0})

    with pytest.raises(
        fb.errors.InputError, match=f"other names than the variables of bands; got '{name}'"
    ):
        fb.propagate(with_coordinate, INPUTS, method)
    assert len(calls) <= 2  # one run is tried alone


@pytest.mark.parametrize("label", ["", " "])
def test_empty_names_of_outputs_are_refused(label):
    with pytest.raises(fb.errors.InputError, match="outputs of the response must have names"):
        fb.propagate(
            lambda a, x: response(a, x).assign_coords(output=["u", label]), INPUTS, fb.PCCI(1, 1)
        )


@pytest.mark.parametrize("name", ["side", "probability", "total", "verdict", "samples"])
def test_coordinates_called_as_answers_are_refused_by_name(name):
    surrogate = fb.expand(
        lambda a, x: response(a, x).assign_coords({name: 1.0}), INPUTS, fb.PCCI(1, 1)
    )
    limit = fb.Requirement("u", below=2.0)
    texts = []
    for answer in (
        lambda: fb.analysis.check_requirements(surrogate, limit),
        lambda: fb.analysis.failure_probability(surrogate, limit, accuracy=0.1),
        lambda: fb.analysis.sobol_indices(surrogate),
    ):
        try:
            answer()
        except fb.errors.InputError as error:
            texts.append(str(error))
    assert texts
    assert all(f"no dimension or coordinate '{name}'" in text for text in texts)


def test_outputs_with_numbers_as_names_are_named_on_the_command_line(tmp_path):
    study = tmp_path / "study.py"
    out = tmp_path / "out"
    study.write_text(
        """
import numpy as np
import xarray as xr
import flexband as fb

def response(a, x):
    time = np.array([0.5, 0.7, 1.0])
    values = np.stack([np.outer(a + 0.1 * x, time), np.outer(a + 0.2 * x, time)], axis=1)
    coords = {"output": [1, 2], "time": time}
    return xr.DataArray(values, coords, ("sample", "output", "time"))

inputs = {"a": fb.Interval(0.9, 1.1), "x": fb.Normal(0, 1)}
method = fb.AdaptivePCCI(phase_resolved=False)
study = fb.Study(response, inputs, method, requirements=fb.Requirement("1", below=2.0))
""",
        encoding="utf-8",
    )
    for words in (
        ["run", study, "--output", out, "--verify", 0],
        ["distribution", out, "2", "--kind", "p-box", "--time", 1],
        ["check", out, "--below", "2=2.5"],
        ["check", out, "--only", "1", "--trust"],
        ["derived", out, "peak", "1"],
        ["path", out, "1", "2"],
        ["report", out, "--p-boxes", 1],
    ):
        done = CliRunner().invoke(app, [str(word) for word in words])
        assert done.exit_code == 0, (words, done.output)
        assert "is not written" not in done.output
