"""Charts of outputs whose limits are far from narrow bands, on the screen and on paper."""

import pytest
from typer.testing import CliRunner

from flexband.cli import app

STUDY = """
import numpy as np
import xarray as xr
import flexband as fb

t = np.linspace(0.0, 1.0, 201)

def move(p, x):
    own = np.sin(2 * np.pi * t) + 1e-3 * (p + 0.1 * x)[:, None]
    return xr.DataArray(np.stack([own, own, own], axis=1), dims=("sample", "output", "time"),
        coords={"output": ["u", "v", "w"], "unit": ("output", ["m"] * 3), "time": t})

inputs = {"p": fb.Interval(-1.0, 1.0), "x": fb.Normal(0.0, 1.0)}
limits = [fb.Requirement("u", below=1.0012), fb.Requirement("w", above=-9.0)]
study = fb.Study(move, inputs, fb.AdaptivePCCI(0.01), requirements=limits)
"""


@pytest.fixture(scope="module")
def page_of(tmp_path_factory):
    folder = tmp_path_factory.mktemp("charts")
    (folder / "charts.py").write_text(STUDY, encoding="utf-8")
    words = ["run", str(folder / "charts.py"), "--output", str(folder), "--verify", "0"]
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 5, result.output
    return folder / "report.html"


def chart_of(page, number):
    """Return the figure of an output, and its chart, drawn."""
    figure = page.locator("figure.chart").nth(number)
    figure.scroll_into_view_if_needed()
    chart = figure.locator(".plot")
    chart.locator("svg.main-svg").first.wait_for()
    return figure, chart


def ends(chart):
    return chart.evaluate("plot => plot._fullLayout.yaxis.range")


def test_limits_far_from_narrow_bands_do_not_flatten_them(page_of, shared_page):
    page = shared_page(page_of, scheme="dark")
    figure, chart = chart_of(page, 0)
    low, high = ends(chart)  # the band is from −0.0011 to 0.0011, the limit 0.0002 to 2 above it
    assert -0.002 < low < -0.0011
    assert 0.0012 < high < 0.004
    assert "“u below 1.0012” is outside this axis where it is far" in figure.inner_text()
    button = figure.get_by_role("button", name="Whole limits")
    button.click()
    assert button.get_attribute("aria-pressed") == "true"
    assert ends(chart)[1] > 2.0
    button.click()
    assert ends(chart) == pytest.approx([low, high])
    box = chart.bounding_box()
    page.mouse.dblclick(box["x"] + box["width"] / 2, box["y"] + 60)
    page.wait_for_function(
        "plot => plot._fullLayout.yaxis.range[1] > 2", arg=chart.element_handle()
    )
    figure.get_by_role("button", name="Values").click()
    assert button.is_hidden()
    assert "outside this axis" not in figure.inner_text()
    assert figure.get_by_role("button", name="Values").get_attribute("aria-pressed") == "true"
    figure, chart = chart_of(page, 2)
    assert "“w above -9” is far from the bands at all times" in figure.inner_text()
    assert ends(chart)[0] > -0.002


def test_inputs_at_the_bounds_are_folded(page_of, shared_page):
    page = shared_page(page_of, 390, scheme="dark")
    figure, _ = chart_of(page, 0)
    assert "Lowest with p = −1; highest with p = 1" not in figure.inner_text()
    assert figure.locator(".reading").bounding_box()["height"] < 130
    figure.locator("summary").focus()
    page.keyboard.press("Enter")
    details = figure.locator("details").inner_text()
    assert "Lowest with p = −1; highest with p = 1" in details


@pytest.mark.parametrize("width", [1280, 390])
def test_all_charts_are_on_paper_in_its_colours(page_of, shared_page, width):
    """Chromium fires beforeprint, and takes what is drawn when its listeners return."""
    page = shared_page(page_of, width, scheme="dark")
    page.locator("#charts .keys").first.wait_for(state="attached")
    page.wait_for_function("document.querySelectorAll('#charts .keys').length === 6")
    looks = """() => {
      dispatchEvent(new Event("beforeprint"));
      return Array.from(document.querySelectorAll("#charts .plot"), (plot) =>
        [plot.querySelectorAll("svg.main-svg").length > 0, plot._fullLayout?.width,
         plot._fullLayout?.font.color]);
    }"""
    assert page.evaluate(looks) == [[True, 690, "#1a1d21"]] * 3
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    script = "plot => [plot._fullLayout.width - plot.clientWidth, plot._fullLayout.font.color]"
    width_error, ink = page.locator("#charts .plot").last.evaluate(script)
    assert abs(width_error) < 1
    assert ink == "#e8eaed"
