"""Surrogates of runs that exist: their errors, what they do not tell, and tables that are wrong."""

import csv

import numpy as np
import pytest
import xarray as xr

import flexband as fb
from flexband.analysis.labelled_answers import doubts_of
from flexband.uncertainty.tables.places import folds, levels_within, shares

INPUTS = {"a": fb.Interval(-1.0, 1.0), "x": fb.Normal(0.0, 1.0)}
TIME = np.linspace(0.0, 1.0, 61)


def draw(count, seed=0, reach=1.0):
    rng = np.random.default_rng(seed)
    return {"a": rng.uniform(-reach, reach, count), "x": rng.standard_normal(count)}


def smooth(a, x):
    """Return sin a + a e^{0.3 x}: its mean is sin a + a e^{0.045}."""
    return np.sin(a) + a * np.exp(0.3 * x)


MEAN = np.sin(1.0) + np.exp(0.045)
BAR = MEAN + np.exp(0.045) * np.sqrt(np.expm1(0.09))


def error_of(surrogate):
    """Return the error of the upper end of the error bar, in parts of its width."""
    return abs(float(surrogate.bands()["error_bar"][1, 0]) - BAR) / (2 * BAR)


@pytest.mark.parametrize("count", [40, 80])
def test_an_error_is_found_by_rows_that_were_left_out(count):
    rows = draw(count)
    surrogate = fb.surrogate_of({**rows, "u": smooth(**rows)}, INPUTS)
    claim = surrogate.bands().attrs["expected_error"]
    assert error_of(surrogate) < 2e-4
    assert error_of(surrogate) / 3 < claim < 2e-3
    assert not doubts_of(surrogate)
    (margin,) = fb.analysis.check_requirements(surrogate, fb.Requirement("u", "u", below=4.0))[
        "verdict"
    ]
    assert margin == "kept"


def test_noise_is_told_by_repeated_rows_and_is_no_error():
    rows = {k: np.repeat(v, 4) for k, v in draw(60).items()}
    noise = 0.05 * np.random.default_rng(1).standard_normal(240)
    surrogate = fb.surrogate_of({**rows, "u": smooth(**rows) + noise}, INPUTS)
    (text,) = surrogate.diagnostics.attrs["noise"]
    assert float(text.removeprefix("u: ")) == pytest.approx(0.05, rel=0.1)
    claim = surrogate.bands().attrs["expected_error"]
    assert error_of(surrogate) / 3 < claim < 0.05 / np.sqrt(4) / BAR


def test_a_ringing_output_has_phases():
    rows = draw(40)
    frequency = 8.0 + 0.3 * rows["a"] + 0.1 * rows["x"]
    table = xr.Dataset(
        {
            **{k: ("sample", v) for k, v in rows.items()},
            "u": (("sample", "time"), np.cos(2 * np.pi * frequency[:, None] * TIME)),
        },
        {"time": TIME},
    )
    surrogate = fb.surrogate_of(table, INPUTS)
    assert surrogate.diagnostics["carriers"] == 1
    mean = surrogate.moments(a=0.0)["mean"].values.ravel()
    exact = np.cos(2 * np.pi * 8 * TIME) * np.exp(-((2 * np.pi * 0.1 * TIME) ** 2) / 2)
    np.testing.assert_allclose(mean, exact, atol=1e-4)


def test_there_is_no_verdict_where_no_row_is_near():
    rows = draw(60, reach=0.3)
    surrogate = fb.surrogate_of({**rows, "u": smooth(**rows)}, INPUTS)
    (doubt,) = doubts_of(surrogate)
    assert doubt == "no row of the table is near low a, high a"
    table = draw(60)
    inputs = {"a": fb.Interval(-1.0, 1.0), "b": fb.Interval(-1.0, 1.0)}
    columns = {"a": table["a"], "b": table["a"] + 0.01 * table["x"]}
    along = {k: np.clip(v, -1, 1) for k, v in columns.items()}
    doubts = doubts_of(fb.surrogate_of({**along, "u": along["a"] - along["b"]}, inputs))
    assert "low a with high b, high a with low b" in doubts[-1]


def test_two_levels_show_no_curve_and_few_rows_do_not_judge():
    grid = np.array(np.meshgrid([-1.0, 1.0], np.linspace(-2, 2, 9))).reshape(2, -1)
    table = {"a": grid[0], "x": grid[1], "u": grid[0] + grid[1]}
    (doubt,) = doubts_of(fb.surrogate_of(table, INPUTS))
    assert doubt == "a has 2 values in all rows, which show no curve"
    rows = draw(12)
    few = fb.surrogate_of({**rows, "u": smooth(**rows)}, INPUTS)
    assert "expected_error" not in few.bands().attrs
    assert any("not judged by runs" in doubt for doubt in doubts_of(few))


def test_levels_are_left_out_as_a_whole():
    """a³ − a vanishes at the three levels of a grid, which no other fold would notice."""
    grid = np.array(np.meshgrid(np.linspace(-1, 1, 5), np.linspace(-2, 2, 7))).reshape(2, -1)
    a, x = grid
    hidden = np.prod([a - level for level in np.linspace(-1, 1, 5)], axis=0)
    assert np.abs(hidden).max() < 1e-15
    surrogate = fb.surrogate_of({"a": a, "x": x, "u": a**4 + x}, INPUTS)
    assert surrogate.bands().attrs["expected_error"] > 0.05
    assert [np.unique(level).tolist() for level in levels_within(grid.T)] == [
        [-1, 1, 2, 3], [-1, 1, 2, 3, 4, 5]
    ]  # fmt: skip


def test_clusters_count_by_their_part_of_the_inputs_and_are_folds():
    rng = np.random.default_rng(0)
    rows = np.concatenate([0.02 * rng.standard_normal((50, 2)) + (c, c) for c in (-0.5, 0.5)])
    rows = np.concatenate([rows, [[0.9, -0.9], [-0.9, 0.9]]])
    targets = rng.uniform(-1, 1, (4000, 2))
    weight = shares(rows, targets)
    assert weight.sum() == pytest.approx(1.0)
    assert weight[-2:].sum() > 0.25
    fold = folds(rows, targets, 10, 0)
    assert not set(fold[:50]) & set(fold[50:100])
    assert len(np.unique(fold[:100])) == 2
    even = rng.uniform(-1, 1, (100, 2))
    assert len(np.unique(folds(even, targets, 10, 0))) == 10


def test_rows_beyond_an_interval_are_used_and_do_not_count():
    rows = draw(80, reach=2.0)
    surrogate = fb.surrogate_of({**rows, "u": smooth(**rows)}, INPUTS)
    assert error_of(surrogate) < 3e-3
    assert surrogate.space.inputs["a"] == fb.Interval(-1.0, 1.0)


def test_a_csv_a_data_frame_and_a_store_are_tables(tmp_path):
    rows = draw(40)
    values = smooth(**rows)
    expected = fb.surrogate_of({**rows, "u": values}, INPUTS).bands()
    file = tmp_path / "table.csv"
    with file.open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(["a [mm]", "x", "u [N]"])
        writer.writerows(zip(*rows.values(), values, strict=True))
    of_file = fb.surrogate_of(file, INPUTS, units={"a": "mm", "u": "N"}).bands()
    assert of_file.equals(expected)
    with pytest.raises(fb.errors.InputError, match=r"a must be in 'm', as given; it is in 'mm'"):
        fb.surrogate_of(file, INPUTS, units={"a": "m"})
    frame = xr.Dataset({k: ("row", v) for k, v in {**rows, "u": values}.items()}).to_dataframe()
    assert fb.surrogate_of(frame, INPUTS).bands().equals(expected)
    fb.propagate(smooth, INPUTS, fb.AdaptivePCCI(1e-3), store=tmp_path / "runs")
    of_runs = fb.surrogate_of(tmp_path / "runs", INPUTS)
    np.testing.assert_allclose(of_runs.bands()["mean"][1], MEAN, rtol=1e-3)


def test_tables_of_times_are_wide_or_long():
    rows = draw(20)
    u = rows["a"][:, None] * TIME[:5] + rows["x"][:, None]
    wide = {**rows, **{f"u[time={t}]": u[:, k] for k, t in enumerate(TIME[:5])}}
    long = {k: np.repeat(v, 5) for k, v in rows.items()}
    long |= {"t": np.tile(TIME[:5], 20), "u": u.ravel()}
    first = fb.surrogate_of(wide, INPUTS)
    second = fb.surrogate_of(long, INPUTS, time="t")
    assert first.bands()["mean"].dims == ("bound", "output", "time")
    np.testing.assert_allclose(first.bands()["mean"], second.bands()["mean"], atol=1e-12)
    np.testing.assert_allclose(first.bands()["mean"][1, 0], TIME[:5], atol=1e-9)


def test_options_have_rows_of_their_own():
    rows = draw(60)
    gear = np.array(["short", "long"])[np.arange(60) % 2]
    table = {**rows, "gear": gear, "u": smooth(**rows) * np.where(gear == "long", 2.0, 1.0)}
    either = fb.surrogate_of(table, INPUTS | {"gear": fb.Choice("short", "long")})
    np.testing.assert_allclose(either.bands()["mean"][:, 0], [-2 * MEAN, 2 * MEAN], rtol=2e-2)
    likely = fb.Choice("short", "long", probabilities=(0.5, 0.5))
    mixed = fb.surrogate_of(table, INPUTS | {"gear": likely})
    np.testing.assert_allclose(mixed.bands()["mean"][:, 0], [-1.5 * MEAN, 1.5 * MEAN], rtol=2e-2)
    third = fb.Choice("short", "long", "reverse", probabilities=(0.5, 0.4, 0.1))
    (doubt,) = doubts_of(fb.surrogate_of(table, INPUTS | {"gear": third}))
    assert doubt == "no row of the table has gear = 'reverse'"


ROWS = draw(20)
GOOD = {**ROWS, "u": smooth(**ROWS)}
TWICE = {k: np.append(v, v[0]) for k, v in GOOD.items()}


@pytest.mark.parametrize(
    ("table", "inputs", "message"),
    [
        ({"a": GOOD["a"], "u": GOOD["u"]}, INPUTS, "must have the columns x; it has a, u"),
        (ROWS, INPUTS, "must have an output besides a, x"),
        (GOOD | {"u": np.where(ROWS["a"] > 0.5, np.nan, 1.0)}, INPUTS, r"finite; row \d+ is not"),
        (GOOD | {"x": np.where(ROWS["a"] > 0.5, np.nan, 1.0)}, INPUTS, r"x must be finite; row"),
        ({k: v[:6] for k, v in GOOD.items()}, INPUTS, "8 different rows or more for a, x; got 6"),
        (TWICE | {"u": np.append(GOOD["u"], 50.0)}, INPUTS, "rows 1, 21 differ as much as rows"),
        (GOOD | {"u": ["1"] * 19 + ["?"]}, INPUTS, r"u must have numbers; row 20 has '\?'"),
        (GOOD, INPUTS | {"f": fb.RandomField(1.0, 0.1, 1.0)}, "f must be a number for each row"),
        (3.0, INPUTS, "must be a path, a DataFrame, a Dataset or a mapping of columns"),
        ("table.txt", INPUTS, "must be a .csv or .nc file, or a folder with runs"),
    ],
)
def test_bad_tables_are_refused_by_name(table, inputs, message):
    with pytest.raises(fb.errors.InputError, match=message):
        fb.surrogate_of(table, inputs)


def test_a_long_table_has_the_same_times_in_every_run():
    long = {k: np.repeat(v, 3) for k, v in ROWS.items()}
    long |= {"t": np.tile([0.0, 1.0, 2.0], 20), "u": np.repeat(GOOD["u"], 3)}
    with pytest.raises(fb.errors.InputError, match="a must be the same at all times of run 1"):
        fb.surrogate_of(long | {"a": long["a"] + np.arange(60) % 2}, INPUTS, time="t")
    with pytest.raises(fb.errors.InputError, match="all runs must have the same times"):
        fb.surrogate_of({k: v[:-1] for k, v in long.items()}, INPUTS, time="t")
