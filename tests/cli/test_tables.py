"""The command that makes a surrogate of runs that exist."""

import csv

import numpy as np
import pytest
from typer.testing import CliRunner

import flexband as fb
from flexband.cli import app
from flexband.cli.commands import load

STUDY = """
import flexband as fb

inputs = {"force": fb.Interval(9.0, 11.0), "play": fb.Normal(0.0, 0.1)}
study = fb.Study(
    fb.models.elsewhere("force", "play"), inputs, fb.AdaptivePCCI(0.01),
    requirements=[fb.Requirement("deflection", "u", below=LIMIT)], units={"force": "N"},
)
"""


def run(folder, limit, rows, *options, header=("force [N]", "play", "u")):
    """Write a study and a table, and return what the command tells of them."""
    rng = np.random.default_rng(0)
    force = rng.uniform(9.0, 11.0, rows)
    play = rng.normal(0.0, 0.1, rows)
    with (folder / "runs.csv").open("w", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(header)
        writer.writerows(zip(force, play, 0.2 * force + play**2, strict=True))
    (folder / "study.py").write_text(STUDY.replace("LIMIT", str(limit)))
    load(["from-table"])
    files = str(folder / "study.py"), str(folder / "runs.csv")
    return CliRunner().invoke(app, ["from-table", *files, "-o", str(folder / "out"), *options])


@pytest.mark.parametrize(("limit", "verdict", "status"), [(2.4, "PASS", 0), (2.1, "FAIL", 5)])
def test_a_table_has_verdicts(tmp_path, limit, verdict, status):
    result = run(tmp_path, limit, 40)
    assert result.exit_code == status, result.output
    assert result.output.startswith(verdict)
    assert "of the error bar's width, as" in result.output
    surrogate = fb.load_surrogate(tmp_path / "out" / "surrogate.npz")
    np.testing.assert_allclose(surrogate.bands()["mean"][:, 0], [1.81, 2.21], atol=1e-3)


def test_few_rows_decide_nothing(tmp_path):
    result = run(tmp_path, 2.4, 12)
    assert result.exit_code == 3
    assert result.output.startswith("UNDECIDED")


def test_a_table_in_another_unit_is_refused(tmp_path):
    result = run(tmp_path, 2.4, 40, header=("force [kN]", "play", "u"))
    assert result.exit_code == 1
    assert "force must be in 'N', as given; it is in 'kN'" in " ".join(result.output.split())
