"""Results written into a folder from Python."""

import numpy as np
import pytest

import flexband as fb
from flexband.report.plot.figures import bands_figure, errors_figure
from flexband.report.study_figures import write_comparison_report
from flexband.study.comparison import compare

STUDY = fb.Study(
    lambda x, y: np.exp(0.1 * x + y)[:, None] * np.ones(5),
    {"x": fb.Normal(0, 1), "y": fb.Interval(0, 1)},
    fb.PCCI(),
)


def test_figures_define_their_terms():
    upper, lower = bands_figure({"PCCI": STUDY.run()}, "").axes
    assert upper.get_title().replace("\n", " ") == (
        "Interval mean: the range of the mean μ over all values of the interval inputs"
    )
    assert (
        lower.get_title()
        .replace("\n", " ")
        .startswith("Interval error bar: the range from the lowest μ − σ to")
    )
    (entry,) = upper.get_legend().get_texts()
    assert entry.get_text() == "PCCI"


def test_the_legend_of_bands_hides_none_and_touches_no_title():
    scan = fb.propagate(STUDY.response, STUDY.inputs, fb.LHSScanning(10, 3))
    figure = bands_figure({"LHS": scan, "PCCI": STUDY.run()}, "")
    figure.draw_without_rendering()
    for axes in figure.axes:
        legend = axes.get_legend()
        title = axes.title.get_window_extent()
        assert legend is not None
        legend = legend.get_window_extent()
        assert axes.bbox.y1 <= legend.y0 + 1
        assert legend.y1 <= title.y0


def test_a_comparison_states_what_times_include(tmp_path):
    results = compare(STUDY, fb.LHSScanning(10, 3), [fb.PCCI(1, 2), fb.ImprovedPCCI(1, 2)])
    page = write_comparison_report(tmp_path, "PCCI", STUDY, results, [(1, 2)])
    text = page.read_text(encoding="utf-8")
    assert "Times do not include compilation." in text
    assert text.count('<img src="data:image/png;base64,') == 3
    assert [file.name for file in tmp_path.iterdir()] == ["report.html"]


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("others", [[], [fb.PCCI(1, 1)]])
def test_errors_of_zero_are_left_out_of_their_figure(others):
    results = compare(STUDY, fb.PCCI(1, 2), [fb.PCCI(1, 2), *others])
    figure = errors_figure(results, "")
    figure.draw_without_rendering()
    for axes in figure.axes:
        errors = np.asarray(axes.lines[0].get_ydata())
        assert np.isnan(errors[0])
        assert np.all(errors[1:] > 0)
