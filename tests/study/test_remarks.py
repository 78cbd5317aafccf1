"""What runs warn of is kept with the runs, in every result, on the screen and on the page."""

import json
from dataclasses import replace

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import flexband as fb
from flexband.analysis.labelled_answers import remarks_on
from flexband.basics.warning import warn
from flexband.cli import app
from flexband.remarks.collection import CollectedRemark, remarks_of, worst_remarks
from flexband.remarks.remark import Doubted, Remark, RemarkKind
from flexband.study.results.netcdf import read_netcdf

ROD = """
import flexband as fb

def rod(force):
    rubber = {"density": 1000.0, "youngs_modulus": 1e6, "poissons_ratio": 0.3}
    return fb.Mechanism(
        bodies={"rod": fb.Beam(length=1.0, height=0.01, width=0.01, elements=2, **rubber)},
        joints={"clamp": fb.Weld("rod.start", (0.0, 0.0))},
        loads={"pull": fb.Force("rod.end", x=force)},
        sensors={"tip": fb.Position("rod.end")},
    )

study = fb.Study(
    fb.dynamic_response(rod, duration=0.1, output_step=1e-3, step=1e-4),
    {"force": fb.Interval(8.0, 12.0)},
    fb.PCCI(0, 3),
    requirements=[fb.Requirement("reach", "tip_X", below=2.0)],
)
"""


def run(*arguments, status):
    result = CliRunner().invoke(app, [*map(str, arguments)])
    assert result.exit_code == status, result.output
    return " ".join(result.output.split())


@pytest.mark.usefixtures("no_drawing")
@pytest.mark.parametrize("executor", [[], ["--executor", "processes:1"]])
def test_a_strain_is_kept_with_its_run_and_undecides_a_verdict(tmp_path, executor):
    """The static strain of 12 N is 12 %, which waves in the rod exceed more than twice."""
    file = tmp_path / "rod.py"
    out = tmp_path / "out"
    file.write_text(ROD, encoding="utf-8")
    line = "'rod' is stretched by 3"
    output = [run("run", file, "-o", out, *executor, status=3)]
    output.append(run("run", file, "-o", out, *executor, status=3))
    output.append(run("resume", out, "--trust", status=3))
    assert all("UNDECIDED reach (below 2): probably met with a margin" in text for text in output)
    assert all(line in text and "runs, the worst with force = 1" in text for text in output)
    assert "has this result already" in output[2]
    assert line in run("report", out, status=0)
    assert line in run("check", out, "--trust", status=3)
    for name in ("bands", "limits", "contributions", "verification"):
        (remark,) = remarks_of(read_netcdf(out / f"{name}.nc").attrs)
        assert remark.worst.kind is RemarkKind.LARGE_STRAIN
        assert remark.worst.size > 0.3
    assert line in (out / "report.html").read_text("utf-8").replace("&#39;", "'")
    assert json.loads((out / "study.json").read_text("utf-8"))["result"]["remarks"]
    surrogate = fb.load_surrogate(out / "surrogate.npz")
    assert remarks_of(surrogate.diagnostics.attrs)
    runs = fb.execution.open_runs(out)
    assert all(json.loads(text)[0]["part"] == "rod" for text in runs["remarks"].values if text)


def test_runs_that_are_read_from_a_store_keep_their_remarks(tmp_path):
    """A narrower study uses the runs of a wider one, and has their remarks, not worse ones."""
    namespace = {}
    exec(ROD, namespace)
    study = namespace["study"]
    with pytest.warns(fb.errors.StrainWarning):
        first = study.run(store=tmp_path)
    second = study.run(store=tmp_path)
    assert remarks_of(first.attrs) == remarks_of(second.attrs) != ()
    assert fb.execution.open_runs(tmp_path).sizes["run"] == 4


SHARED = """
import flexband as fb

def door(torque):
    return fb.Mechanism(
        bodies={"door": fb.RigidBody(mass=1.0, inertia=0.1, points={"a": (0.0, 0.0)})},
        joints={"top": fb.Revolute("door.a", (0.0, 0.0)), "low": fb.Revolute("door.a", (0.0, 0.0))},
        loads={"push": fb.Moment("door", torque)},
        sensors={"top": fb.Reaction("top"), "angle": fb.Angle("door")},
    )

study = fb.Study(
    fb.dynamic_response(door, duration=0.1, output_step=1e-2, step=1e-2),
    {"torque": fb.Interval(0.1, 0.2)},
    fb.PCCI(0, 2),
    requirements=[
        fb.Requirement("load", "top_X", below=9.0), fb.Requirement("turn", "angle", below=9.0),
    ],
)
"""


@pytest.mark.usefixtures("no_drawing")
def test_shared_reactions_put_only_themselves_in_doubt(tmp_path):
    file = tmp_path / "door.py"
    out = tmp_path / "out"
    file.write_text(SHARED, encoding="utf-8")
    output = run("run", file, "-o", out, status=3)
    assert "UNDECIDED load (below 9): probably met" in output
    assert "PASS turn (below 9): met" in output
    assert "but what sensor 'top' measures is one choice of many" in output


JUMP = """
import flexband as fb

def crank(speed):
    points = {"p": (-0.5, 0.0), "tip": (0.5, 0.0)}
    arm = fb.RigidBody(mass=1.0, inertia=0.1, points=points, position=(0.5, 0.0))
    motor = fb.PrescribedRotation("arm", lambda t: speed * (t - 0.05) * (t > 0.05))
    return fb.Mechanism(
        bodies={"arm": arm},
        joints={"pin": fb.Revolute("arm.p", (0.0, 0.0)), "motor": motor},
        sensors={"tip": fb.Position("arm.tip"), "pin": fb.Reaction("pin")},
    )

study = fb.Study(
    fb.dynamic_response(crank, duration=0.1, output_step=1e-3, step=1e-3),
    {"speed": fb.Interval(1.0, 2.0)},
    fb.PCCI(0, 2),
    requirements=[
        fb.Requirement("reach", "tip_Y", below=2.0), fb.Requirement("pull", "pin_X", above=-20.0),
        fb.Requirement("lift", "pin_Y", below=90.0),
    ],
)
"""


@pytest.mark.usefixtures("no_drawing")
def test_an_impulse_undecides_the_forces_that_it_is_in(tmp_path):
    """The centre of the arm moves upwards at once, which takes an impulse of pin_Y alone."""
    file = tmp_path / "crank.py"
    out = tmp_path / "out"
    file.write_text(JUMP, encoding="utf-8")
    output = run("run", file, "-o", out, status=3)
    assert "PASS reach (below 2): met" in output
    assert "PASS pull (above -20): met" in output
    assert "UNDECIDED lift (below 90): probably met" in output
    assert "the speed of a prescribed motion jumps at t = 0.05 s" in output
    assert "the worst with speed = 2)" in output


def response_with(remark):
    def response(a):
        warn("what is remarked", remarks=[remark])
        return xr.DataArray(
            np.stack([a, 2 * a], axis=1), {"output": ["x", "y"]}, ("sample", "output")
        )

    return response


@pytest.mark.parametrize(
    ("kind", "outputs", "error", "undecided"),
    [
        (RemarkKind.NOISE, ("x",), 0.5, {"x"}),
        (RemarkKind.NOISE, ("x",), 1e-3, set()),  # of the range 1, less than the margin of 0.1
        (RemarkKind.NOISE, ("x",), np.nan, {"x"}),
        (RemarkKind.HALVED_STEP, (), np.nan, {"x", "y"}),
        (RemarkKind.COARSE_STEP, (), 1e-3, set()),
        (RemarkKind.ADVICE, (), np.nan, set()),
        (RemarkKind.CHANGED_START, (), np.nan, set()),
    ],
)
def test_an_error_above_the_margin_or_an_unknown_one_undecides(
    kind, outputs, error, undecided, tmp_path
):
    remark = Remark(kind, "what is remarked", outputs=outputs, error=error)
    study = fb.Study(
        response_with(remark), {"a": fb.Interval(0.0, 1.0)}, fb.PCCI(0, 2),
        requirements=[fb.Requirement("x", "x", below=1.1), fb.Requirement("y", "y", below=2.2)],
    )  # fmt: skip
    with pytest.warns(fb.errors.FlexbandWarning, match="what is remarked"):
        verdicts = study.run_in(tmp_path).verdicts
    assert {verdict.name for verdict in verdicts if verdict.verdict == "UNDECIDED"} == undecided
    touched = {v.name for v in verdicts if v.remarks}
    doubtful = {"x", "y"} if kind.doubt_scope is Doubted.ALL else set(outputs)
    assert touched == doubtful
    second = study.run_in(tmp_path)
    assert second.reused
    assert [v.as_json() for v in second.verdicts] == [v.as_json() for v in verdicts]


def test_the_worst_of_a_topic_stands_for_it():
    def remark(size, part="a", runs=1):
        return CollectedRemark(Remark(RemarkKind.LARGE_STRAIN, f"{size}", size, part), runs)

    strains = [remark(0.2), remark(0.3, runs=2), remark(np.nan), remark(0.1, "b")]
    worst = worst_remarks(strains)
    assert [(group.worst.text, group.runs) for group in worst] == [("0.3", 4), ("0.1", 1)]
    assert worst_remarks(strains[::-1])[1].worst.text == "0.3"
    restored = [CollectedRemark.from_json(group.as_json()) for group in worst]
    assert [group.as_json() for group in restored] == [group.as_json() for group in worst]


def test_a_remark_on_a_whole_call_is_one_on_each_of_its_runs(tmp_path):
    remark = Remark(RemarkKind.ADVICE, "what is remarked")
    inputs = {"a": fb.Interval(0.0, 1.0)}
    method = fb.PCCI(0, 2)
    with pytest.warns(fb.errors.FlexbandWarning, match="what is remarked"):
        bands = fb.propagate(response_with(remark), inputs, method, store=tmp_path)
    (of_call,) = remarks_of(bands.attrs)
    assert of_call.runs == bands.attrs["runs"] - bands.attrs["runs_repeated"] > 1


def test_an_error_of_the_step_that_the_bands_include_counts_once():
    """It undecides a margin that is smaller, unless it is part of the expected error already."""
    remark = Remark(RemarkKind.COARSE_STEP, "a coarse step", error=0.5)
    with pytest.warns(fb.errors.FlexbandWarning, match="what is remarked"):
        surrogate = fb.expand(response_with(remark), {"a": fb.Interval(0, 1)}, fb.AdaptivePCCI())
    errors = surrogate.diagnostics["error_bar_expected_error"]
    with_step_error = replace(
        surrogate,
        diagnostics=surrogate.diagnostics.assign(error_bar_discretization_error=errors),
    )
    for case, error in ((surrogate, 0.5), (with_step_error, 0.0)):
        (entry,) = remarks_on(case)
        assert entry.worst.error == error
