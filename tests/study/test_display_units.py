"""Units of the inputs of a study, and those in which its numbers are shown."""

import json
import re

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import flexband as fb
from flexband.cli import app
from flexband.report.page.inputs import inputs_table
from flexband.study.presentation.display import Display

PAIR = fb.Correlated({"p": fb.Normal(0.0, 1.0), "q": fb.Normal(0.0, 1.0)}, 0.5)
INPUTS = {"length": fb.Interval(1.0, 2.0), "load": fb.Normal(10.0, 1.0), "pair": PAIR, "two": 2.0}


def response(length, load, p, q, two):
    return (length * load + p + q + two)[:, None] * np.ones(2)


def test_the_table_of_inputs_tells_the_units_that_are_given():
    units = {"length": "mm", "q": "kg", "p": "N"}
    study = fb.Study(response, INPUTS, fb.PCCI(1, 1), units=units)
    header, rows = inputs_table(study.inputs, study.display)
    assert header[-1] == "unit"
    assert {row[0]: row[-1] for row in rows} == {
        "length": "mm",
        "load": "",
        "pair": "p: N; q: kg",
        "two": "",
    }
    assert "unit" not in inputs_table(study.inputs, Display())[0]


@pytest.mark.parametrize(
    ("units", "message"),
    [
        ({"lenght": "mm"}, "units must be 'length', 'load'.*got 'lenght'"),
        ({"length": 1e-3}, r"units\['length'\] must be a text, \"mm\" say; got 0.001"),
        ("mm", "units must be .*crank_length.*got 'mm'"),
    ],
)
def test_units_that_are_none_are_refused(units, message):
    with pytest.raises(fb.errors.InputError, match=message):
        fb.Study(response, INPUTS, fb.PCCI(1, 1), units=units)


STUDY = """
import numpy as np
import xarray as xr
import flexband as fb

TIMES = np.linspace(0.0, 1.0, 5)

def response(crank, load):
    angle = np.pi / 180 * np.multiply.outer(crank, 1000 * TIMES)
    force = np.multiply.outer(load, 1 + TIMES)
    coords = {"output": ["wiper", "F"], "time": TIMES, "unit": ("output", ["rad", "N"])}
    return xr.DataArray(np.stack([angle, force], 1), coords, ("sample", "output", "time"))

study = fb.Study(
    response,
    {"crank": fb.Interval(0.01, 0.03), "load": fb.Normal(2000.0, 100.0)},
    fb.AdaptivePCCI(),
    units={"crank": "m", "load": "N"},
    display_units={"crank": "mm", "wiper": "deg", "F": "kN", "load": "kN"},
    requirements=fb.Requirement("wiper", below=np.pi * 32 / 180),
)
"""


@pytest.fixture(scope="module")
def study_output(tmp_path_factory):
    """Return the folder of a study with display units, and what its run prints."""
    folder = tmp_path_factory.mktemp("display")
    (folder / "study.py").write_text(STUDY, encoding="utf-8")
    return folder / "out", call("run", folder / "study.py", "-o", folder / "out", "--verbose")


def call(*arguments):
    result = CliRunner().invoke(app, [*map(str, arguments)], env={"COLUMNS": "200"})
    assert result.exit_code in (0, 3), result.output
    return " ".join(result.output.split())


def test_a_study_is_shown_in_display_units_and_kept_in_the_others(study_output):
    """wiper is 10° to 30° after 1 s, F is 4 kN ± 0.2 kN."""
    folder, text = study_output
    assert "wiper below 32°: met with a margin of 2° at 1 s" in text
    assert re.search(r"wiper \[deg\] . 0 … 30 . 0 … 30 . 20 ", text)
    assert re.search(r"F \[kN\] . 2 … 4 . 1.9 … 4.2 . 0.4 ", text)
    bands = fb.load_surrogate(folder / "surrogate.npz").bands()
    assert bands["unit"].values.tolist() == ["rad", "N"]
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert "10 … 30 (20 ± 10)" in page
    assert "mean 2, standard deviation 0.1" in page
    data = json.loads(page.split('id="data">')[1].split("</script>")[0])
    assert [output["unit"] for output in data["charts"]["outputs"]] == ["deg", "kN"]
    assert data["charts"]["input_units"] == ["mm"]
    what_if = data["what_if"]
    np.testing.assert_allclose(what_if["width"], [20.0, 0.4], rtol=1e-9)
    np.testing.assert_allclose(np.ravel([m["scale"] for m in what_if["models"]]), [20.0, 0.4])
    ends = [(entry["unit"], entry["scale"] * entry["upper"]) for entry in what_if["intervals"]]
    assert ends == [("mm", pytest.approx(30.0))]
    assert [(entry["unit"], entry["scale"] * entry["size"]) for entry in what_if["sizes"]] == [
        ("kN", pytest.approx(0.1))
    ]


@pytest.mark.usefixtures("no_drawing")
def test_answers_are_shown_in_display_units(study_output):
    folder, _ = study_output
    text = call("check", folder, "--trust")
    assert "deg at time 1, with crank = 30 mm" in text
    text = call("allocate", folder, "--cost", "crank=1", "--trust", "--no-confirm")
    assert re.search(r"crank . 10 . 10 . mm ", text)
    assert re.search(r"wiper \[deg\] . 20 .* 5 mm . 50 %", call("tolerance", folder, "crank"))
    text = call("narrow", folder, "crank=0.019..0.021", "--trust")
    assert re.search(r"wiper \[deg\] . 10 . 1 . 10 %", text)
    assert "crank: 19 … 21 (20 ± 1) mm" in text
    text = call("distribution", folder, "-p", 0.5)
    assert re.search(r"F \[kN\] . 0.5 . 2[.\d]* . 4[.\d]* ", text)
    text = call("derived", folder, "peak", "wiper")
    assert re.search(r"peak of wiper \[deg\].*mean . 10 . 30 ", text)
    assert xr.load_dataset(folder / "derived.nc")["mean"].max() == pytest.approx(np.pi / 6)


@pytest.mark.parametrize(
    ("display", "units", "message"),
    [
        (
            {"length": "N"},
            {"length": "mm"},
            r"display_units\['length'\] must be a unit for mm; got",
        ),
        ({"length": "mm"}, {}, r"requires units\['length'\], the unit of the number that"),
        ({"y": "furlong"}, {}, r"display_units\['y'\] must be a unit of m, kg.*got 'furlong'"),
        ("mm", {}, "display_units must be names with units.*got 'mm'"),
    ],
)
def test_display_units_that_do_not_fit_inputs_are_refused(display, units, message):
    with pytest.raises(fb.errors.InputError, match=message):
        fb.Study(response, INPUTS, fb.PCCI(1, 1), units=units, display_units=display)


@pytest.mark.parametrize(
    ("display", "message"),
    [
        ({"y": "mm"}, r"display_units\['y'\] must be a unit for N; got 'mm'"),
        ({"z": "mm"}, "display_units must be of y, plain, a; got 'z'"),
        ({"plain": "mm"}, r"display_units\['plain'\] requires an output with a unit"),
    ],
)
def test_display_units_that_do_not_fit_outputs_are_refused(display, message):
    def two(a):
        coords = {"output": ["y", "plain"], "unit": ("output", ["N", ""])}
        return xr.DataArray(np.stack([a, a], 1), coords, ("sample", "output"))

    study = fb.Study(two, {"a": fb.Interval(0, 1)}, fb.PCCI(0, 1), display_units=display)
    with pytest.raises(fb.errors.InputError, match=message):
        study.run()


def test_no_part_of_a_result_keeps_the_unit_it_was_computed_in():
    """Every variable with a unit is a thousandth in kN; shares, places and counts are the same."""
    namespace = {}
    exec(STUDY, namespace)
    study = namespace["study"]
    surrogate = study.expand()
    kilo = Display({"F": "kN"})
    limit = fb.Requirement("force", "F", below=4.5, unit="kN")
    margins = fb.analysis.check_requirements(surrogate, limit)
    in_kilo = kilo.data(margins)
    lengths = {
        "margin", "expected_error", "above", "below", "least_margin", "least_margin_error",
        "margin_between", "margin_at_most", "grid_error", "stated_scale", "extent",
    }  # fmt: skip
    for name, variable in margins.data_vars.items():
        if variable.dtype.kind == "f":
            scale = 1e-3 if name in lengths else 1.0
            np.testing.assert_allclose(in_kilo[name], variable * scale, err_msg=name)
    bands = surrogate.bands()
    verification = fb.verify(surrogate, study.response, runs=4).verification
    for result in (bands, verification, fb.analysis.contributions(surrogate)):
        scaled = kilo.data(result)
        for name, variable in result.data_vars.items():
            if "output" in variable.dims and variable.dtype.kind == "f":
                unitless = (
                    "input" in variable.dims or "share" in f"{name}" or "relative" in f"{name}"
                )
                expected = variable * xr.DataArray([1.0, 1.0 if unitless else 1e-3], dims="output")
                np.testing.assert_allclose(scaled[name], expected, err_msg=name)
