"""Figures for papers show the numbers of the results, in print's size and notation."""

import numpy as np
import pytest
import xarray as xr
from matplotlib import pyplot
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

import flexband as fb
from flexband.report.plot.figures import limits_figure
from flexband.report.plot.series import literal
from flexband.report.plot.style import DARK, LIGHT, MIDDLE

TIME = np.linspace(0.0, 1.0, 11)


def response(a, b):
    values = np.stack([a[:, None] + 0 * TIME, a[:, None] * TIME + b[:, None]], axis=1)
    coords = {"output": ["F_X", "tip_Y"], "time": TIME, "unit": ("output", ["N", "mm"])}
    result = xr.DataArray(values, coords, ("sample", "output", "time"))
    result["time"].attrs["units"] = "s"
    return result


INPUTS = {"a": fb.Interval(1.0, 2.0), "b": fb.Normal(0.0, 0.5)}
STUDY = fb.Study(response, INPUTS, fb.PCCI(1, 1))


@pytest.fixture(scope="module")
def surrogate():
    return STUDY.expand()


@pytest.fixture
def ax():
    return Figure().add_subplot()


def edges(collection):
    """Return the lower and the upper edge of what `fill_between` has filled, at all times."""
    vertices = collection.get_paths()[0].vertices
    columns = [vertices[np.isclose(vertices[:, 0], t), 1] for t in TIME]
    return np.array([[column.min(), column.max()] for column in columns]).T


def test_bands_are_those_of_the_result(surrogate, ax):
    """μ = a t and σ = 0.5 over 1 ≤ a ≤ 2."""
    assert fb.plot.bands(surrogate.bands(), "tip_Y", ax=ax) is ax
    bar, mean = map(edges, ax.collections)
    np.testing.assert_allclose(mean, [TIME, 2 * TIME], atol=1e-9)
    np.testing.assert_allclose(bar, [TIME - 0.5, 2 * TIME + 0.5], atol=1e-9)
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("$t$ [s]", "tip_Y [mm]")
    texts = [text.get_text() for text in ax.get_legend().get_texts()]
    assert texts == [r"interval error bar, $\mu \pm \sigma$", r"interval mean, $\mu$"]


@pytest.mark.parametrize("nominal", [True, False])
def test_deviations_are_those_from_the_nominal_run(surrogate, ax, nominal):
    fb.plot.deviations(surrogate.bands(), STUDY.nominal() if nominal else None, "tip_Y", ax=ax)
    np.testing.assert_allclose(edges(ax.collections[1]), [-TIME / 2, TIME / 2], atol=1e-9)
    assert ax.get_ylabel() == "deviation of tip_Y [mm]"


def test_a_nominal_run_of_other_times_is_refused(surrogate):
    nominal = STUDY.nominal().assign_coords(time=TIME + 1)
    with pytest.raises(fb.errors.InputError, match="nominal must have the outputs and times"):
        fb.plot.deviations(surrogate.bands(), nominal, "F_X")


def test_contributions_are_stacked(surrogate, ax):
    contributions = fb.analysis.contributions(surrogate)
    fb.plot.contributions(contributions, "tip_Y", ax=ax)
    tops = np.cumsum(contributions["contribution"].sel(output="tip_Y").values, axis=0)
    for layer, top in zip(ax.collections, tops, strict=True):
        np.testing.assert_allclose(edges(layer)[1], top, atol=1e-9)
    np.testing.assert_allclose(ax.lines[0].get_ydata(), contributions["width"].sel(output="tip_Y"))
    with pytest.raises(fb.errors.InputError, match="contributions with shapley=True"):
        fb.plot.contributions(contributions, "tip_Y", variable="shapley")
    with pytest.raises(fb.errors.InputError, match="variable must be 'contribution' or 'shapley'"):
        fb.plot.contributions(contributions, "tip_Y", variable="width")


def test_shapley_values_are_stacked_to_the_whole_width(surrogate, ax):
    contributions = fb.analysis.contributions(surrogate, shapley=True)
    fb.plot.contributions(contributions, "tip_Y", variable="shapley", ax=ax)
    width = contributions["width"].sel(output="tip_Y")
    np.testing.assert_allclose(edges(ax.collections[-1])[1], width, atol=1e-9)


def test_errors_of_zero_are_left_out(ax):
    results = fb.compare(STUDY, fb.PCCI(2, 2), [fb.PCCI(2, 2), fb.LHSScanning(20, 3)])
    fb.plot.errors(results, "tip_Y", ax=ax)
    exact, of_samples = (np.asarray(line.get_ydata()) for line in ax.lines)
    assert np.isnan(exact).all()
    error = 100 * results[2].errors["error_bar"].sel(output="tip_Y")
    np.testing.assert_allclose(of_samples, error)


def test_margins_and_bounds(surrogate, ax):
    limit = fb.Requirement("F_X", below=2.5)
    fb.plot.margins(fb.analysis.check_requirements(surrogate, limit), ax=ax)
    np.testing.assert_allclose(ax.lines[0].get_ydata(), 0.5, atol=1e-9)
    assert ax.get_ylabel() == "margin [N]"
    axes = Figure().add_subplot()
    quantiles = fb.analysis.quantiles(surrogate, [0.1, 0.9])
    fb.plot.bounds(quantiles, "quantiles", "F_X", ax=axes)
    for line, value in zip(axes.lines, (1.0, 2.0, 1.0, 2.0), strict=True):
        np.testing.assert_allclose(line.get_ydata(), value, atol=1e-9)


def test_one_number_is_a_bar(ax):
    bands = fb.propagate(lambda a: a, {"a": fb.Interval(1.0, 2.0)}, fb.PCCI(1, 1))
    fb.plot.bands(bands, ax=ax)
    (bar,) = ax.containers[0]
    np.testing.assert_allclose([bar.get_y(), bar.get_height()], [1.0, 1.0])


def test_the_output_must_be_named(surrogate):
    with pytest.raises(
        fb.errors.InputError, match="output must be one of 'F_X', 'tip_Y'; got None"
    ):
        fb.plot.bands(surrogate.bands())
    with pytest.raises(fb.errors.InputError, match="bands must be a result of propagate; got 3"):
        fb.plot.bands(3, "F_X")  # pyright: ignore


@pytest.mark.parametrize("suffix", ["pdf", "svg"])
@pytest.mark.parametrize("columns", [1, 2])
def test_figures_are_vectors_of_the_width_of_a_column(surrogate, tmp_path, columns, suffix):
    with fb.plot.style(columns):
        axes = fb.plot.bands(surrogate.bands(), "F_X")
        file = tmp_path / f"bands.{suffix}"
        axes.figure.savefig(file)
        pyplot.close(axes.figure)
    content = file.read_bytes()
    width = 72 * {1: 3.4, 2: 7.0}[columns]
    size = f"/MediaBox [ 0 0 {width:g}" if suffix == "pdf" else f'width="{width:g}pt"'
    assert size.encode() in content
    assert b"/Subtype /Image" not in content
    assert b"<image" not in content
    assert b"STIXGeneral" in content or suffix == "svg"


def test_grey_tells_bands_apart():
    light, middle, dark = (np.dot(to_rgb(c), (0.299, 0.587, 0.114)) for c in (LIGHT, MIDDLE, DARK))
    assert light - middle > 0.2
    assert middle - dark > 0.2


def test_names_are_those_of_the_study(surrogate, ax):
    """No letter is an index, and nothing is a formula: the rest of a report has plain names."""
    assert [literal(name) for name in ("F_X", "a$b")] == ["F_X", r"a\$b"]
    contributions = fb.analysis.contributions(surrogate).assign_coords(name=["pivot_x", "b"])
    fb.plot.contributions(contributions, "tip_Y", ax=ax)
    assert ax.get_legend().get_texts()[0].get_text() == "pivot_x"
    assert ax.get_ylabel() == "width of tip_Y [mm]"


def violated(smallest=-2e-4):
    """Return margins of 1 − cos that are least at t = 1, as `check_requirements` returns them."""
    t = np.linspace(0.0, 2.0, 401)
    margin = xr.DataArray(
        [1 - np.cos(np.pi * (t - 1)) + smallest, 3 + t],
        {"limit": ["u below 2.198", "v above a value that takes many words to say it all"],
         "time": ("time", t, {"units": "s"}), "unit": "rad"},
        ("limit", "time"),
    )  # fmt: skip
    error = xr.full_like(margin, 1e-6)
    return xr.Dataset({"margin": margin, "expected_error": error}, attrs={"sigmas": 3.0})


@pytest.mark.parametrize("smallest", [-2e-4, 2e-4, 0.0])
def test_the_least_margin_is_seen_however_small_it_is(smallest):
    figure = limits_figure(violated(smallest))
    overview, close = figure.axes
    low, high = close.get_ylim()
    assert low < 0.0 < high < 0.01
    start, end = close.get_xlim()
    assert 0.9 < start < 1.0 < end < 1.1
    title = f"{smallest:g} rad at time 1 s" if smallest else "0 rad at time 1 s"
    assert title in close.get_title().replace("\n", " ")
    assert overview.get_ylim()[1] > 5.0
    figure.draw_without_rendering()
    for axes in figure.axes:  # nothing is cut off
        for text in (axes.title, axes.get_legend()):
            box = text.get_window_extent()
            assert 0 <= box.x0 < box.x1 <= figure.bbox.width
        assert axes.title.get_window_extent().y0 >= axes.get_legend().get_window_extent().y1


def test_margins_that_are_seen_have_no_second_picture():
    assert len(limits_figure(violated(0.5)).axes) == 1


def test_probabilities_are_between_zero_and_one(ax):
    t = np.arange(6.0)
    upper = [[0.0, 1.0, 1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 2e-4, 3e-2, 0.0, np.nan]]
    probabilities = xr.DataArray(
        [np.zeros((2, 6)), upper],
        {"bound": ["lower", "upper"], "limit": ["rare", "other"], "time": t},
        ("bound", "limit", "time"),
    )
    fb.plot.probability(xr.Dataset({"at_each_time": probabilities}), ax=ax)
    assert ax.get_ylim() == (0.0, 1.0)
    np.testing.assert_array_equal(ax.lines[0].get_ydata(), upper[0])  # from zero, so peaks are seen
    assert ax.yaxis.get_transform().linthresh == pytest.approx(1e-4)
    legend = ax.get_legend().get_window_extent()
    assert legend.y0 >= ax.get_window_extent().y1  # beside no data


def test_margins_of_several_units_have_axes_of_their_own():
    def response(a, x):
        values = np.stack([np.outer(a, TIME), 1e3 * np.outer(a, TIME)], axis=1)
        coords = {"output": ["u", "F"], "unit": ("output", ["m", "N"]), "time": TIME}
        result = values + x[:, None, None] * np.array([1.0, 1e3])[:, None]
        return xr.DataArray(result, coords, ("sample", "output", "time"))

    inputs = {"a": fb.Interval(0.9, 1.1), "x": fb.Normal(0.0, 0.1)}
    surrogate = fb.expand(response, inputs, fb.PCCI(1, 1))
    for bounds, count in (((9.0, 9e3), 2), ((1.2, 9e3), 3)):
        limits = [fb.Requirement(name, below=b) for name, b in zip(("u", "F"), bounds, strict=True)]
        margins = fb.analysis.check_requirements(surrogate, limits)
        figure = limits_figure(margins, fb.analysis.failure_probability(surrogate, limits))
        labels = [axes.get_ylabel() for axes in figure.axes]
        assert labels == ["margin [m]", "margin [N]", "probability of being outside"][:count]
    assert "μ ± 3σ" in figure.axes[0].get_title()
