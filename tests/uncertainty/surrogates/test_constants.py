"""Outputs that are constant, or rounding errors of others, decide neither verdicts nor rankings."""

import json

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import flexband as fb
from flexband.analysis.limits.limit_verdicts import LimitCheck, requirement_verdicts
from flexband.basics.rounding import Units
from flexband.cli import app
from flexband.report.text import band_tables
from flexband.report.text.headline import what_matters
from flexband.uncertainty.surrogates.axes import units_of

T = np.linspace(0.0, 1.0, 11)
INPUTS = {"k": fb.Interval(1.0, 1.2), "x": fb.Normal(0.0, 0.1)}
MIN_SPEED = ["c", "noise", "small"]
WIDE = [1.0, 0.0, 4e-26, 3e-17]


def response(k, x):
    """One output that moves, a constant, and two that are zero but for rounding."""
    coarse = np.sign(np.sin(1e9 * (k + 7 * x)))[:, None] * np.cos(40 * T)
    moving = (k + 0.3 * x)[:, None] * np.sin(3 * T)
    values = np.stack([moving, 0 * moving + 2.0, 1e-26 * coarse, 3e-17 * coarse], axis=1)
    coords = {"output": ["y", *MIN_SPEED], "unit": ("output", ["m"] * 4), "time": T}
    return xr.DataArray(values, coords, ("sample", "output", "time"))


@pytest.fixture(scope="module")
def surrogate():
    return fb.expand(response, INPUTS, fb.AdaptivePCCI())


def test_units_tell_what_is_rounding():
    labels = response(np.ones(0), np.zeros(0))
    np.testing.assert_array_equal(units_of(labels).of, [3, 3, 3, 3])
    assert len(set(units_of(labels.drop_vars("unit")).of)) == 4
    wide = np.array([1.0, 0.0, 3e-17])
    size = np.array([1.0, 2.0, 3e-17])
    same = Units(np.zeros(3, dtype=int), np.zeros(3))
    other = Units.unknown(3)
    assert same.varies(wide, size).tolist() == [True, False, False]
    assert other.varies(wide, size).tolist() == [True, False, True]  # 30 aF beside 1 m


def test_no_runs_are_spent_on_rounding_errors(surrogate):
    attrs = surrogate.diagnostics.attrs
    assert attrs["expected_error"] < 1e-10
    assert "not_trusted" not in attrs
    assert attrs["runs_fitted"] + attrs["runs_checked"] < 60


def test_constants_are_named_and_judged_by_nothing(surrogate):
    bands = surrogate.bands()
    verification = fb.verify(surrogate, response).verification
    assert band_tables.constants(bands) == MIN_SPEED
    _, rows = band_tables.summary_table(bands, verification)
    assert [row[3:] for row in rows[1:]] == [["constant", "", "", ""]] * 3
    assert rows[2][1:3] == ["0 … 0", "0 … 0"]
    assert verification["confirmed"].values.all()
    assert float((verification["implied_error"] / verification["bar_width"]).max()) <= 2e-5
    assert band_tables.accuracy_line(bands, None).split(" for ")[1].startswith("y,")


def test_a_constant_that_new_runs_leave_is_told():
    """No run that is fitted has a k above 1.199, from which on an output jumps."""

    def jumps(k, x):
        result = response(k, x)
        result[:, 1] += (np.asarray(k) > 1.1999)[:, None] * (np.asarray(x) > 0.05)[:, None]
        return result

    expansion = fb.expand(response, INPUTS, fb.PCCI(1, 1))
    verification = fb.verify(expansion, jumps, runs=64).verification
    assert verification["missed"].sel(output="c") > 0.01


def verdicts_of(contributions, margins):
    return requirement_verdicts(LimitCheck(margins, None, written=False), contributions, None)


def test_contributions_and_narrowing_leave_constants_out(surrogate, tmp_path):
    contributions = fb.analysis.contributions(surrogate)
    assert contributions["varies"].values.tolist() == [True, False, False, False]
    assert not contributions["mean_share"].sel(output=MIN_SPEED).values.any()
    assert what_matters(contributions, []).startswith("What matters most: k (")
    limits = fb.analysis.check_requirements(
        surrogate, [fb.Requirement("c", below=3.0), fb.Requirement("y", below=2.0)]
    )
    assert what_matters(contributions, verdicts_of(contributions, limits)).startswith(
        "What matters most: k ("
    )
    of_constant = fb.analysis.check_requirements(surrogate, fb.Requirement("c", below=3.0))
    assert all(verdict.input_share == 0 for verdict in verdicts_of(contributions, of_constant))
    assert not fb.analysis.sobol_indices(surrogate)["defined"].sel(output=MIN_SPEED).values.any()
    fb.save_surrogate(surrogate, tmp_path / "surrogate.npz")
    for command in (["narrow", "k=1.05..1.1"], ["contributions"], ["tolerance", "k"]):
        arguments = [command[0], str(tmp_path), *command[1:]]
        result = CliRunner().invoke(app, arguments, env={"COLUMNS": "200"})
        assert result.exit_code == 0, result.output
        assert result.output.count("constant") in (3, 12)
    shares = json.loads(CliRunner().invoke(app, ["contributions", str(tmp_path), "--json"]).stdout)
    assert shares["mean_share"]["c"] == [None, None]


def test_narrow_names_the_only_output(tmp_path):
    expansion = fb.expand(lambda k, x: (k + x)[:, None] * T, INPUTS, fb.AdaptivePCCI())
    fb.save_surrogate(expansion, tmp_path / "surrogate.npz")
    output = CliRunner().invoke(app, ["narrow", str(tmp_path), "k=1.1..1.2"]).output
    assert "response" in output
