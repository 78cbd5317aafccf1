"""The report of a study, opened in a browser as its reader does."""

import re

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import flexband as fb
from flexband.cli import app
from flexband.report.page.charts import DIGITS

STUDY = '''"""How far does <b>it</b> swing?"""
import numpy as np
import xarray as xr
import flexband as fb

t = np.linspace(0.0, 2.0, 401)

def swing(stiffness, amplitude, phase):
    angle = np.sqrt(stiffness)[:, None] * 2 * np.pi * t
    first = amplitude[:, None] * np.cos(angle) + phase[:, None]
    turn = t * amplitude[:, None]
    values = np.stack(
        [first, 1e3 * t + 0.1 * first, np.cos(turn) + phase[:, None], np.sin(turn)], axis=1)
    return labelled(values)

def labelled(values):
    return xr.DataArray(values, dims=("sample", "output", "time"), coords={
        "output": ["x</script><img src=x onerror=alert(1)>", "y_Y", "P_X", "P_Y"],
        "unit": ("output", ["m", "N", "m", "m"]), "time": ("time", t, {"units": "s"})})

study = fb.Study(swing, {
    "stiffness": fb.Interval(380.0, 420.0), "amplitude": fb.Interval(0.9, 1.1),
    "phase": fb.Normal(0.0, 0.1)}, fb.AdaptivePCCI(0.01),
    units={"phase": "m", "stiffness": "<b>N/m"})
'''


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("report")
    (folder / "swing.py").write_text(STUDY, encoding="utf-8")
    for words in (
        ["run", str(folder / "swing.py"), "--output", str(folder / "out")],
        ["check", str(folder / "out"), "--below", "y_Y=2100"],
        ["report", str(folder / "out"), "--p-boxes", "2"],
    ):
        result = CliRunner().invoke(app, words)
        assert result.exit_code == 0, result.output
    return folder / "out"


SMALL = """
import numpy as np
import xarray as xr
import flexband as fb

t = np.linspace(0.0, 1.0, 51)

def move(p, q, r):
    p, q, r = (1e-4 * v[:, None] for v in (p, q, r))
    x, y = (4 + 0 * t + p * 1e4 + q * 1e4 + r * 1e4) * 1e-4, p + 5e-4 * r + 4e-4 * t
    return xr.DataArray(np.stack([x, y], axis=1), dims=("sample", "output", "time"), coords={
        "output": ["P_X", "P_Y"], "unit": ("output", ["m", "m"]), "time": t})

inputs = {"p": fb.Interval(-1.0, 1.0), "q": fb.Interval(-1.0, 1.0), "r": fb.Normal(0.0, 1.0)}
study = fb.Study(move, inputs, fb.AdaptivePCCI(0.01),
                 requirements=fb.Requirement("P_Y", below=2e-3))
"""


@pytest.fixture(scope="module")
def small(tmp_path_factory):
    folder = tmp_path_factory.mktemp("small")
    (folder / "small.py").write_text(SMALL, encoding="utf-8")
    for words in (
        ["run", str(folder / "small.py"), "--output", str(folder), "--verify", "0"],
        ["distribution", str(folder)],
        ["report", str(folder)],
    ):
        result = CliRunner().invoke(app, words)
        assert result.exit_code == 0, result.output
    return folder


def numbers(text):
    return [float(v) for v in re.findall(r"-?\d+\.?\d*(?:e[-+]?\d+)?", text.replace("−", "-"))]


def test_charts_have_the_numbers_of_the_bands(folder, shared_page):
    page = shared_page(folder / "report.html")
    with xr.open_dataset(folder / "bands.nc") as bands:
        bands.load()
    width = (bands["error_bar"][1] - bands["error_bar"][0]).max("time").values
    slider = page.get_by_role("slider", name="Cursor")
    assert slider.get_attribute("aria-valuetext") != "time = 0 s"  # where a bar is the widest
    slider.press("Home")
    for _ in range(7):
        page.keyboard.press("ArrowRight")
    assert slider.get_attribute("aria-valuetext") == f"time = {7 * 0.005:g} s"
    for k, reading in enumerate(page.locator("#charts .reading").all()):
        values = numbers(reading.inner_text().partition("mean")[2])
        at_time = bands.isel(output=k, time=7)
        expected = [*at_time["mean"].values, *at_time["error_bar"].values]
        np.testing.assert_allclose(values[:4], expected, rtol=0, atol=(1e-3 + DIGITS) * width[k])
    chart = page.locator(".plot").first
    chart.scroll_into_view_if_needed()
    chart.locator("svg.main-svg").first.wait_for()
    traces = chart.evaluate("plot => plot.data.map((trace) => [trace.name, Array.from(trace.y)])")
    assert page.locator(".reading").count() == 4 + 2  # of charts, the path and distributions
    assert {name for name, _ in traces} >= {"interval mean", "stiffness", "amplitude", "phase"}


def test_hovering_and_views_change_what_is_shown(folder, shared_page):
    page = shared_page(folder / "report.html")
    figure = page.locator("figure.chart").first
    figure.scroll_into_view_if_needed()
    chart = figure.locator(".plot")
    chart.locator("svg.main-svg").first.wait_for()
    text = figure.locator(".reading").inner_text()
    box = chart.bounding_box()
    page.mouse.move(box["x"] + 0.3 * box["width"], box["y"] + 0.35 * box["height"])
    page.wait_for_function(
        "([own, text]) => own.innerText !== text",
        arg=[figure.locator(".reading").element_handle(), text],
    )
    ranges = []
    for view in figure.locator(".tools button:not([hidden])").all():
        view.click()
        assert view.get_attribute("aria-pressed") == "true"
        ranges.append(chart.evaluate("plot => plot.data.map((t) => Math.max(...t.y))"))
    assert len(ranges) >= 2
    assert ranges[0] != ranges[1]


def test_the_path_follows_the_cursor(folder, shared_page):
    page = shared_page(folder / "report.html")
    assert "path of P_X and P_Y" in page.locator("#path .reading").inner_text()
    plot = page.locator("#path .plot")
    script = "plot => [Math.max(...plot.data[2].x), Math.max(...plot.data[2].y)]"
    slider = page.get_by_role("slider", name="Cursor")
    for key, t in (("Home", 0.0), ("End", 2.0)):
        slider.press(key)
        slider.press("ArrowRight" if key == "Home" else "ArrowLeft")
        page.wait_for_timeout(100)
        x, y = plot.evaluate(script)
        # the highest μ + σ of cos(a t) + 0.1 ξ and sin(a t), a = 0.9 … 1.1
        angle = t * np.linspace(0.9, 1.1, 101)
        assert x == pytest.approx(np.cos(angle).max() + 0.1, abs=0.01)
        assert y == pytest.approx(np.sin(angle).max(), abs=0.01)


def test_distributions_at_times(folder, shared_page):
    page = shared_page(folder / "report.html")
    output, place = page.locator("#p-boxes select").all()
    output.select_option("P_X [m]")
    place.select_option(label="2 s")
    values = numbers(page.locator("#p-boxes .reading").inner_text().partition("between")[2])
    medians = np.cos(2 * np.array([1.1, 0.9]))
    np.testing.assert_allclose(values[:2], medians, atol=0.01)


def test_what_a_study_says_is_text(folder, shared_page):
    page = shared_page(folder / "report.html")
    assert page.get_by_text("How far does <b>it</b> swing?").count() == 1
    assert page.locator("img[src=x]").count() == 0
    assert page.locator("h3", has_text="x</script><img").count() >= 1


def test_the_first_screen_answers(folder, shared_page):
    page = shared_page(folder / "report.html")
    page.evaluate("scrollTo(0, 0)")
    assert "y_Y below 2100: met" in page.locator(".requirements .pass").inner_text()
    verdict = page.locator(".verdict").inner_text()
    for text in ("Estimated accuracy: ±", "What matters most: "):
        assert text in verdict
    assert page.locator(".verdict").bounding_box()["y"] < 200
    table = page.locator(".first table").inner_text()
    assert "380 … 420 (400 ± 20)" in table
    assert "mean 0, standard deviation 0.1" in table


def test_phones_need_no_scrolling_sideways(folder, shared_page):
    page = shared_page(folder / "report.html", 360, 740)
    page.locator(".plot").first.scroll_into_view_if_needed()
    page.locator("svg.main-svg").first.wait_for()
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
    inks = {"light": ["#1a1d21", "#ffffff"], "dark": ["#e8eaed", "#14171b"]}
    for scheme, expected in inks.items():
        page.emulate_media(color_scheme=scheme)
        assert page.evaluate("['ink', 'paper'].map(flexband.color)") == expected


def test_phones_show_all_cells_of_tables_and_pictures_that_can_be_read(small, open_page):
    page = open_page(small / "report.html", viewport={"width": 390, "height": 844})
    page.locator(".what-if-limits td").first.wait_for()
    cells = page.locator("table:not(.long) td, table:not(.long) caption")
    boxes = [cell.bounding_box() for cell in cells.all() if cell.is_visible()]
    assert len(boxes) > 20
    assert max(area["x"] + area["width"] for area in boxes) <= 390
    row = page.locator("#bands table").last.locator("td").all()[1:4]
    heads = [cell.evaluate("cell => getComputedStyle(cell, '::before').content") for cell in row]
    assert heads[:2] == ['"worst case"', '"least margin"']
    at = page.locator(".what-if-limits td").last
    assert at.inner_text() == "time = 1 s"  # before a slider moves, too
    picture = page.locator("figure:not(.sheet) img").first
    box = picture.bounding_box()
    assert box["width"] > 340
    assert box["x"] + box["width"] <= 390  # all of it is seen
    # letters are 10/72 of an inch of 150 dots in the picture
    assert 10 / 72 * 150 * box["width"] / picture.evaluate("image => image.naturalWidth") > 8
    assert page.evaluate("document.documentElement.scrollWidth") <= 390


def test_the_report_is_small_and_says_how_it_was_made(folder):
    text = (folder / "report.html").read_text(encoding="utf-8")
    assert len(text.encode()) < 6e6
    for part in ("AdaptivePCCI(tolerance=0.01", "interval error bar", "fitted", "numpy"):
        assert part in text


@pytest.mark.parametrize(
    ("response", "inputs", "method"),
    [
        ("np.exp(-np.outer(a, t)) + e[:, None]", "", "LHSScanning(20, 3)"),
        ("a + e", "", "AdaptivePCCI()"),
        ("np.exp(-np.outer(a * np.where(k == 'x', 1, 2), t)) + e[:, None]",
         ', "k": fb.Choice("x", "y")', "ImprovedPCCI(2, 2)"),
        ("a[:, None, None] * np.ones((3, 4)) + e[:, None, None]", "", "PCCI(1, 1)"),
    ],
    ids=["no surrogate", "a number", "choices", "two dims"],
)  # fmt: skip
def test_other_studies_have_a_report(tmp_path, open_page, response, inputs, method):
    (tmp_path / "study.py").write_text(
        f"""
import numpy as np
import flexband as fb
t = np.linspace(0, 1, 30)
def response(a, e{", k" if inputs else ""}):
    return {response}
study = fb.Study(response, {{"a": fb.Normal(1, 0.1), "e": fb.Interval(0, 1){inputs}}},
                 fb.{method}, requirements=fb.Requirement("response", below=9.0))
""",
        encoding="utf-8",
    )
    words = ["run", str(tmp_path / "study.py"), "--output", str(tmp_path), "--verify", "4"]
    is_scan = method.startswith("LHS")
    result = CliRunner().invoke(app, words[:-2] if is_scan else words)
    assert result.exit_code == (3 if is_scan else 0), result.output  # limits need a surrogate
    page = open_page(tmp_path / "report.html")
    assert page.locator("#bands td").count() >= 6
    for plot in page.locator("#charts .plot").all():
        plot.scroll_into_view_if_needed()
        plot.locator("svg.main-svg").first.wait_for()


MANY = """
import numpy as np
import xarray as xr
import flexband as fb

t = np.linspace(0.0, 1.0, 51)

def move(**p):
    s = sum((k + 1) * v for k, v in enumerate(p.values()))[:, None]
    x, y = 0.2 * np.cos(6 * t) + 1e-5 * s, 0.2 * np.sin(6 * t) + 1e-5 * s * t
    return xr.DataArray(np.stack([x, y], axis=1), dims=("sample", "output", "time"), coords={
        "output": ["P_X", "P_Y"], "unit": ("output", ["m", "m"]), "time": t})

inputs = {f"p{k}": fb.Interval(-1.0, 1.0) for k in range(9)} | {
    "q": fb.LogNormal(1.0, cv=0.1), "r": fb.Normal(0.0, 0.5)}
study = fb.Study(move, inputs, fb.AdaptivePCCI(0.01), sigmas=1,
                 requirements=fb.Requirement("P_X", below=0.2008))
"""


@pytest.fixture(scope="module")
def many(tmp_path_factory):
    folder = tmp_path_factory.mktemp("many")
    (folder / "many.py").write_text(MANY, encoding="utf-8")
    words = ["run", str(folder / "many.py"), "--output", str(folder), "--verify", "0"]
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 0, result.output
    return folder


@pytest.mark.parametrize("width", [1280, 390])
def test_all_contributions_are_lines_with_a_legend_outside_the_chart(many, shared_page, width):
    page = shared_page(many / "report.html", width)
    figure = page.locator("figure.chart").first
    chart = figure.locator(".plot")
    chart.scroll_into_view_if_needed()
    chart.locator("svg.main-svg").first.wait_for()
    curves = chart.evaluate(
        "plot => plot.data.filter((own) => own.yaxis === 'y2').map((own) => [own.name, own.y[9]])"
    )
    assert len(curves) == 8 + 1
    assert curves[-2][0] == "4 others"
    assert sum(v for _, v in curves[:-1]) == pytest.approx(curves[-1][1], rel=0.02)
    assert chart.evaluate("plot => plot.data.every((own) => !own.stackgroup)")
    assert chart.locator(".legend").count() == 0  # which the cursor would cross
    above, below = figure.locator(".keys").all()
    assert "interval mean" in above.inner_text()
    assert "4 others" in below.inner_text()
    looks = [
        button.evaluate("key => getComputedStyle(key, '::before').borderTopStyle")
        for button in above.locator("button", has_text=re.compile("nominal|P_X below")).all()
    ]
    assert looks == ["dotted", "dashed"]
    key = above.get_by_role("button", name="nominal")
    script = "plot => plot.data.map((own) => own.visible)"
    before = chart.evaluate(script)
    key.focus()
    page.keyboard.press("Enter")  # the legend switches curves off and on
    assert key.get_attribute("aria-pressed") == "false"
    assert chart.evaluate(script).count(False) == before.count(False) + 1
    key.click()
    assert chart.evaluate(script) == before
    assert "need not add up" in figure.inner_text()
    if width > 1000:  # the bands, the contributions and their numbers are one screen
        assert figure.bounding_box()["height"] < 850


def test_numbers_of_axes_have_no_prefixes_of_units(small, shared_page):
    page = shared_page(small / "report.html")
    chart = page.locator(".plot").first
    chart.scroll_into_view_if_needed()
    chart.locator("svg.main-svg").first.wait_for()
    ticks = chart.locator(".ytick text, .y2tick text").all_text_contents()
    assert ticks
    assert all(re.fullmatch(r"[−-]?\d+(\.\d+)?", tick) for tick in ticks), ticks
    plot = page.locator("#path .plot")
    plot.scroll_into_view_if_needed()
    plot.locator("svg.main-svg").first.wait_for()
    title = plot.locator(".ytitle").bounding_box()
    for label in plot.locator(".ytick text").all():
        assert label.bounding_box()["x"] >= title["x"] + title["width"] - 1


def test_what_an_output_does_not_depend_on_is_not_among_its_worst_inputs(small, shared_page):
    page = shared_page(small / "report.html")
    page.locator("#charts figure summary").first.wait_for()
    for summary in page.locator("#charts figure summary").all():
        summary.click()
    x, y = (caption.inner_text() for caption in page.locator("#charts figcaption").all())
    assert "Lowest with p = −1, q = −1; highest with p = 1, q = 1." in x
    assert "Lowest with p = −1; highest with p = 1; others matter by less than 0.5 %" in y
    assert "only 0.05 % wider" in y  # μ ± σ is ± (1 + 5e-4)
    assert "% wider" not in x


def test_narrow_tubes_are_magnified_and_numbers_are_true(many, shared_page):
    page = shared_page(many / "report.html")
    text = page.locator("#path .reading")
    factor = float(page.locator("#path select").input_value())
    assert f"deviations drawn {factor:g} times as large" in text.inner_text()
    with xr.open_dataset(many / "path.nc") as path:
        true = np.abs(path["x"] - path["x_nominal"]).max().values
        radius = float(path["radius"].max())
    assert 0.02 < factor * radius / 0.4 <= 0.05
    plot = page.locator("#path .plot")
    script = "plot => Math.max(...plot.data[2].x) - plot.data[1].x[0]"
    page.get_by_role("slider", name="Cursor").press("Home")
    page.get_by_role("slider", name="Cursor").press("ArrowRight")
    page.get_by_role("slider", name="Cursor").press("ArrowLeft")
    page.wait_for_timeout(100)
    magnified = plot.evaluate(script)
    page.locator("#path select").select_option("1")
    assert "times as large" not in text.inner_text()
    assert plot.evaluate(script) == pytest.approx(magnified / factor, rel=1e-6)
    assert plot.evaluate(script) == pytest.approx(float(true), rel=0.01)
    radii = plot.evaluate("plot => plot.data[1].customdata.map(Number)")
    assert max(radii) == pytest.approx(radius, rel=1e-4)


def leading_number(text):
    return float(text.split()[0].replace("−", "-"))


def test_sliders_move_the_margins_of_limits(many, shared_page):
    page = shared_page(many / "report.html")
    table = page.locator(".what-if-limits")
    table.locator("tr").nth(1).wait_for()
    cells = table.locator("tr").nth(1).locator("td")
    study, now = map(leading_number, cells.all_inner_texts()[:2])
    assert study == now
    page.get_by_role("slider", name="upper end of p8").press("Home")
    page.wait_for_function("document.querySelector('.what-if-table').ariaBusy === 'false'")
    now = leading_number(cells.nth(1).inner_text())
    narrower = fb.load_surrogate(many / "surrogate.npz").narrowed(p8=0.0)
    limit = fb.Requirement("P_X", below=0.2008)
    margins = fb.analysis.check_requirements(narrower, limit)
    assert now == pytest.approx(float(margins["least_margin"][0]), rel=1e-3)
    assert now > study
    heads = page.locator(".what-if-table").first.locator("thead").inner_text()
    assert "largest expected error" in heads
    python = page.locator(".what-if-python").inner_text()
    assert "p8=0" in python or "p8=fb.Interval(0, 0)" in python
    scatter = page.locator(".what-if-input", has_text="coefficient of variation")
    assert "coefficient of variation 0.1, 100 %" in scatter.inner_text()


GUIDED = """
import numpy as np
import xarray as xr
import flexband as fb

t = np.linspace(0.0, 1.0, 51)

def response(e, x):
    y = (e + 0.1 * x)[:, None] * np.sin(6 * t)
    coords = {"output": ["P_X", "P_Y"], "unit": ("output", ["m", "m"]), "time": t}
    return xr.DataArray(np.stack([0 * y, y], axis=1), coords, ("sample", "output", "time"))

study = fb.Study(response, {"e": fb.Interval(0.03, 0.04), "x": fb.Normal(0, 0.01)}, fb.PCCI(1, 1))
"""


def test_the_path_of_a_guided_point_fills_its_chart(open_page, tmp_path):
    (tmp_path / "guided.py").write_text(GUIDED, encoding="utf-8")
    result = CliRunner().invoke(
        app, ["run", str(tmp_path / "guided.py"), "-o", str(tmp_path / "out")]
    )
    assert result.exit_code == 0, result.output
    page = open_page(tmp_path / "out" / "report.html")
    page.locator("#path .plot").scroll_into_view_if_needed()
    page.wait_for_selector("#path .main-svg")
    ranges = "p => ['xaxis', 'yaxis'].map(a => p._fullLayout[a].range)"
    (low, high), (bottom, top) = page.locator("#path .plot").evaluate(ranges)
    assert low < 0 < high
    assert 0.06 < top - bottom < 0.2


def test_inputs_have_their_units(folder, shared_page):
    page = shared_page(folder / "report.html")
    rows = page.locator("table", has_text="what is known of it").first.locator("tbody tr")
    cells = {
        row[0]: row for row in (line.locator("th, td").all_inner_texts() for line in rows.all())
    }
    assert [cells[name][3] for name in ("amplitude", "phase", "stiffness")] == ["", "m", "<b>N/m"]
    page.locator(".what-if-input").first.wait_for()
    for name, text in {"stiffness": "± 20) <b>N/m", "phase": "std 0.1 m, 100 %"}.items():
        assert text in page.locator(".what-if-input", has_text=name).inner_text()


def test_a_browser_may_pause_between_the_scripts_of_a_page(many, open_page, tmp_path):
    page = (many / "report.html").read_text(encoding="utf-8")
    pause = '</script><script src="pause.js"></script>'
    (tmp_path / "paused.html").write_text(page.replace("</script>", pause), encoding="utf-8")
    busy = "{ const from = performance.now(); while (performance.now() - from < 50); }"
    (tmp_path / "pause.js").write_text(busy, encoding="utf-8")
    open_page(tmp_path / "paused.html").locator(".what-if-limits").wait_for(timeout=10_000)


def test_pictures_have_the_colours_of_the_page(many, shared_page):
    page = shared_page(many / "report.html")
    picture = page.locator("figure img").first
    sheet = []
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        sheet.append(picture.evaluate("image => getComputedStyle(image).filter"))
    assert sheet[0] == "none"
    assert "invert(1)" in sheet[1]
