"""Tables and remarks, from datasets with known numbers."""

import numpy as np
import pytest
import xarray as xr

import flexband as fb
from flexband.cli.messages import print_table
from flexband.report.page.answers import limits_table
from flexband.report.text.band_tables import accuracy_line, remarks, summary_table, worst_time
from flexband.report.text.numbers import number, percent, with_minus
from flexband.uncertainty.surrogates.diagnostics import trust


def bands(**variables):
    """Return bands of two outputs at three times; the error bar of u is widest at 1 s."""
    bar = np.array([[[0.0, -2.0, 0.0], [1.0, 1.0, 1.0]], [[1.0, 2.0, 1.0], [1.0, 1.0, 1.0]]])
    return xr.Dataset(
        {
            "mean": (("bound", "output", "time"), bar / 2),
            "error_bar": (("bound", "output", "time"), bar),
            **variables,
        },
        {"bound": ["lower", "upper"], "output": ["u", "v"], "time": [0.0, 1.0, 2.0],
         "unit": ("output", ["m", "N"])},
    )  # fmt: skip


def test_a_summary_has_ranges_and_the_largest_width():
    result = bands(relative_expected_error=("output", [0.03, 0.01]))
    header, rows = summary_table(result)
    assert rows[0] == ["u [m]", "-1 … 1", "-2 … 2", "4", "1 s", "3 %"]
    assert rows[1][-1] == ""  # no width to compare with
    assert header[-1] == "expected error"
    assert accuracy_line(result, None) == (
        "Estimated accuracy: ± 3 % of the band's width for u, the least accurate output."
    )
    errors = {f"{k}_expected_error": (("output", "time"), np.full((2, 3), 0.06))
              for k in ("mean", "error_bar")}  # fmt: skip
    earlier = bands(**errors)  # of an earlier version
    assert summary_table(earlier)[1][0][-1] == "3 %"
    assert "± 3 % of" in accuracy_line(earlier, None)
    assert "not estimated" in accuracy_line(bands(), None)
    header, rows = summary_table(bands(truncation=(("output", "time"), np.full((2, 3), 0.04))))
    assert (header[-1], rows[0][-1]) == ("truncation indicator", "1 %")


def test_a_small_component_has_the_error_of_its_own_width():
    """v is judged by the width of u, 2 on average; its own is 0.1."""
    errors = {f"{k}_expected_error": (("output", "time"), np.array([[0.06] * 3, [0.02] * 3]))
              for k in ("mean", "error_bar")}  # fmt: skip
    result = bands(**errors, relative_expected_error=("output", [0.03, 0.01]))
    result["error_bar"].values[1, 1] += 0.1
    assert [row[-1] for row in summary_table(result)[1]] == ["3 %", "20 %"]
    assert "± 3 % of the band's width for u" in accuracy_line(result, None)


def test_the_worst_time_is_told_beside_the_mean_over_time():
    """Errors of u are 2, 2 and 8 % of its mean width, times 1.5 at single times; v is constant."""
    error = np.array([0.04, 0.04, 0.16]) * np.array([[1.0], [1 / 3]])
    errors = {f"{k}_expected_error": (("output", "time"), error) for k in ("mean", "error_bar")}
    result = bands(**errors, pointwise_error=(("output", "time"), 1.5 * error))
    assert worst_time(result) == "12 % (u at time 2)"
    assert worst_time(result.isel(time=[0])) == ""


def test_the_end_of_a_narrow_band_is_told_apart_from_a_limit_that_it_is_close_to():
    result = bands()
    upper = np.array([[1.27, 2.19817, 1.3], [1.0, 2.0, 3.0]])
    result["error_bar"].values[:] = [upper - np.array([[0.0155], [9.0]]), upper]
    rows = summary_table(result)[1]
    assert rows[0][2] == "1.2545 … 2.19817"  # a limit is 2.198
    assert rows[1][2] == "-8 … 3"


def test_margins_of_limits_have_their_units():
    margins = xr.Dataset(
        {"verdict": ("limit", ["kept"]), "least_margin": ("limit", [0.5]),
         "least_margin_error": ("limit", [0.01])},
        {"limit": ["u below 1"], "unit": ("limit", ["rad"])},
    )  # fmt: skip
    assert limits_table(margins, None)[1] == [["u below 1", "met", "0.5 rad", "0.01 rad"]]
    without = limits_table(margins.drop_vars("unit"), None)[1]
    assert without == [["u below 1", "met", "0.5", "0.01"]]


@pytest.mark.parametrize("sigmas", [1.0, 3.0])
@pytest.mark.parametrize(
    "method", [fb.AdaptivePCCI(), fb.methods.PhaseResolvedPCCI(), fb.methods.RegressionPCCI()]
)
def test_the_table_and_the_first_line_tell_the_same_error(method, sigmas):
    def response(a, b):
        y = np.exp(-np.outer(a, np.linspace(0, 1, 30)))
        values = np.stack([y * b[:, None] ** 2, np.sin(y + b[:, None])], axis=1)
        return xr.DataArray(values, {"output": ["u", "v"]}, ("sample", "output", "time"))

    inputs = {"a": fb.Interval(0.5, 1.0), "b": fb.Normal(1.0, 0.1)}
    result = fb.propagate(response, inputs, method, sigmas=sigmas)
    width = (result["error_bar"][1] - result["error_bar"][0]).mean("time")
    exact = result["error_bar_expected_error"].mean("time") / width
    relative = result["relative_expected_error"]
    np.testing.assert_allclose(relative, exact, rtol=0.1)  # widths at fewer times
    if "expected_error" in result.attrs:
        assert float(relative.max()) == pytest.approx(result.attrs["expected_error"])
    column = [row[5] for row in summary_table(result)[1]]
    assert column == [percent(float(v)) for v in relative]
    assert f"± {percent(float(relative.max()))} of" in accuracy_line(result, None)


def test_numbers_are_those_of_engineers():
    texts = {2.8e9: "2.8e9", 7.668e-5: "7.668e-5", 0.000123456: "0.0001235", 123456: "123500",
             -957: "-957", 0.0: "0", -1e6: "-1e6", np.inf: "inf", 9.9999e-5: "0.0001"}  # fmt: skip
    assert {v: number(v) for v in texts} == texts
    assert number(1.221e-16, scale=0.3) == "0"
    assert number(1e-4, scale=1e3) == "0.0001"
    assert number(0.1234567, 6) == "0.123457"


def test_per_cents_have_no_exponents():
    assert [percent(v) for v in (1.28, 0.994, 0.0123, 0.99999)] == [
        "128 %",
        "99 %",
        "1.2 %",
        "100 %",
    ]


def bands_with(expansion, discretization, refined):
    """Return bands whose errors are expected to be these parts."""
    total = expansion + (discretization if refined else 0.0)
    return bands().assign_attrs(
        expected_error=total,
        expansion_error=expansion,
        discretization_error=discretization,
        runs_checked=16,
        runs_refined=refined,
        runs_coarser=0,
        discretization="",
        largest_miss="of u at e = 0.3",
        stopped="",
        refined=["discretization"] if refined else [],
        tolerance=0.01,
    )


UNNOTICED = "An effect confined to less than a fifth of the input space can go unnoticed"
"""Of 16 runs, which 17 % of the space miss by 5 % chance."""

NOT_CORRECTED = "Not corrected: the runs have the error of their step and elements"


@pytest.mark.parametrize(("error", "is_met"), [(0.02, False), (0.005, True)])
def test_a_tolerance_is_mentioned_if_it_is_not_met(error, is_met):
    lines = remarks(bands_with(error, "not estimated", 0))
    assert lines[0] == (
        f"Expected error, mean over time: {100 * error:g} % of the error bar's width "
        "(16 check runs)"
    )
    assert lines[1] == "The error of the discretization (step, elements) is not estimated"
    misses = [line for line in lines if line.startswith("The tolerance of 1 % is NOT met")]
    assert len(misses) == (not is_met)
    assert ("The largest prediction error is of u at e = 0.3" in lines) == (not is_met)


@pytest.mark.parametrize(("error", "coarse"), [(0.4, True), (1.28, True), (0.002, False)])
def test_a_coarse_discretization_is_mentioned(error, coarse):
    lines = remarks(bands_with(0.004, error, 5))
    assert lines[0].startswith(f"Expected error, mean over time: {percent(0.004 + error)} ")
    assert lines[1] == (
        f"Of this, the expansion 0.4 %, discretization {percent(error)} (5 runs on "
        "finer discretizations)"
    )
    assert lines[2] == NOT_CORRECTED
    assert lines[3] == UNNOTICED
    assert [line.startswith("The discretization is coarse") for line in lines[4:]] == [
        True
    ] * coarse


def test_the_discretization_and_what_is_due_to_it_are_told():
    result = bands_with(0.004, 0.003, 10).assign_attrs(
        step_error=0.002, elements_error=0.001, halved=["step"], refined=["step", "elements"],
        discretization="step 0.000125, elements of link 8",
        carrier_frequencies=[184.4],
        steps_per_period=[43.38],
    )  # fmt: skip
    lines = remarks(result)
    assert "the expansion 0.4 %, step 0.2 %, elements 0.1 % (10 runs" in lines[1]
    line = "Discretization: step 0.000125, elements of link 8 (chosen by the method)"
    vibration = "A vibration of 184.4 Hz has 43.4 steps per period"
    assert lines[2:] == [NOT_CORRECTED, UNNOTICED, line, vibration]
    result.attrs["corrected"] = "step of u by phases"
    assert remarks(result)[2:] == [
        "Corrected by these runs: step of u by phases; the errors are what remains",
        UNNOTICED,
        line,
        vibration,
    ]
    del result.attrs["halved"]
    assert remarks(result)[4] == line.partition(" (")[0]
    doubtful = result.assign_attrs(expected_error=0.02, discretization_error=0.016, halved=["step"])
    assert remarks(doubtful)[-1].startswith("The tolerance of 1 % is NOT met by the discretization")


def test_outputs_that_are_not_trusted_are_named_with_the_reason():
    result = bands()
    assert remarks(result) == []
    labels = result["mean"].isel(bound=slice(0)).drop_vars("bound")
    for shares, lines in (
        ([0.49, 0.0], []),
        ([0.1, 0.624], ["Not reliable: v (62 % of its variation in check runs is missed)"]),
        (
            [0.5, np.nan],
            [
                "Not reliable: u (50 % of its variation in check runs is missed); "
                "v (nan % of its variation in check runs is missed)"
            ],
        ),
    ):
        trusted = trust(labels, np.array(shares))
        assert trusted["trusted"].values.tolist() == [part < 0.5 for part in shares]
        assert remarks(result.assign_attrs(trusted.attrs)) == lines
    assert "the response (90 % of" in trust(labels[:, 0], np.array([0.9])).attrs["not_trusted"]


def test_outputs_may_have_numbers_or_no_names():
    for output in ([7, 8], None):
        unnamed = bands().drop_vars(["output", "unit"])
        result = unnamed if output is None else unnamed.assign_coords(output=output)
        last = "8" if output else "1"
        assert summary_table(result)[1][1][0] == last
        labels = result["mean"].isel(bound=slice(0)).drop_vars("bound")
        assert trust(labels, np.array([0.0, 1.0])).attrs["not_trusted"].startswith(f"{last} (100 %")


def test_a_verification_is_a_column_and_a_remark():
    verification = xr.Dataset(
        {"confirmed": ("output", [True, False])},
        {"output": ["u", "v"]},
        {"verdict": "NOT confirmed: v is missed"},
    )
    header, rows = summary_table(bands(), verification)
    assert header[-1] == "confirmed"
    assert [row[-1] for row in rows] == ["yes", "NO"]
    assert remarks(bands(), verification) == ["NOT confirmed: v is missed"]


def test_the_share_that_runs_may_not_have_seen_is_told():
    lines = remarks(bands_with(0.001, "not estimated", 0).assign_attrs(runs_generic=8))
    assert lines[2] == (
        "An effect confined to less than a third of the input space can go unnoticed"  # 31 %
    )


@pytest.mark.parametrize("width", [80, 200])
def test_cells_are_never_cut_or_wrapped(width, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", str(width))
    header = ["output", "interval mean", "error bar", "largest width", "at", "expected error", "ok"]
    row = ["-0.0002497 … 0.0003095", "-0.0002668 … 0.0003336", "7.668e-5", "0.03775 s", "0.81 %"]
    rows = [[f"output {k} [m]", *row, "yes"] for k in range(8)]
    print_table("many", (header, rows))
    lines = capsys.readouterr().out.splitlines()
    assert max(map(len, lines)) <= width
    for k, cells in enumerate(rows):
        text = " ".join(line for line in lines if f"output {k} " in line)
        assert all(cell in text for cell in [cells[0], *map(with_minus, cells[1:])])
        assert text.count(f"output {k} ") == (2 if width == 80 else 1)


def test_tables_that_are_split_are_about_equally_wide(monkeypatch, capsys):
    outputs = ["rocker", "bend", "C_X", "C_Y", "mid_X", "mid_Y"]
    header = [
        "input",
        *(f"{output}, {statistic}" for output in outputs for statistic in ("mean", "at widest")),
    ]
    for width, parts in ((80, [6, 6]), (120, [6, 6]), (60, [4, 4, 4]), (300, [12])):
        monkeypatch.setenv("COLUMNS", str(width))
        print_table("shares", (header, [["youngs_modulus", *["12.3 %"] * 12]]))
        lines = capsys.readouterr().out.splitlines()
        assert [line.count("%") for line in lines if "youngs" in line] == parts


def test_headers_of_a_part_are_on_one_line_if_they_fit(monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", "80")
    result = bands(relative_expected_error=("output", [0.03, 0.01]))
    verification = xr.Dataset({"confirmed": ("output", [True, True])}, {"output": ["u", "v"]})
    header, rows = summary_table(result, verification)
    wide = [[row[0], "-120.3 … 253.9", "-235.2 … 286.9", *row[3:]] for row in rows]
    print_table("demo", (header, wide))
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 1 + 2 * (3 + 2 + 1)
    assert any("error bar μ ± σ" in line for line in lines)
    assert any("largest width" in line and "expected error" in line for line in lines)
