"""Bands that a page computes for narrower inputs, against those of the surrogate."""

import dataclasses
import json

import numpy as np
import pytest

import flexband as fb
from flexband.report.page.template import ASSETS
from flexband.report.page.what_if.panel import SCRIPTS, what_if
from flexband.uncertainty.expansions.families import HERMITE, LEGENDRE
from tests.polynomials import drawn_polynomial

T = np.linspace(0.0, 1.0, 41)
WAVE_TIMES = np.linspace(0.0, 1.0, 200)

INPUTS = {
    "a": fb.Normal(1.0, 0.1),
    "b": fb.Uniform(0.5, 1.5),
    "c": fb.LogNormal(2.0, 0.2),
    "d": fb.Triangular(0.0, 1.0, 2.0),
    "e": fb.Interval(1.0, 2.0),
    "f": fb.Interval(-1.0, 1.0),
    "g": fb.RandomField(2.0, 0.2, 0.5, domain=(0.0, 1.0), terms=2),
}


def smooth(a, b, c, d, e, f, g):
    line = (a**2 * e)[:, None] * T + (b * e * np.log(c))[:, None] * np.sin(3 * T)
    return line + (f**2 + f * d)[:, None] * T**2 + 0.1 * g(T) * f[:, None]


def wave(w, g, k):
    envelope = np.exp(-g[:, None] * WAVE_TIMES)
    return k[:, None] * np.sin((w * k)[:, None] * WAVE_TIMES) * envelope


@pytest.fixture(scope="module")
def page_of():
    """Return the text of a page with the panel of a surrogate."""

    def write(surrogate, file):
        data, _ = what_if(surrogate, surrogate.bands())
        names = ("arrays.js", "element.js", "numbers.js", *SCRIPTS, "start.js")
        scripts = "".join(f"<script>{ASSETS.joinpath(n).read_text()}</script>" for n in names)
        tree = json.dumps({"what_if": data}).replace("<", "\\u003c")
        file.write_text(
            '<!doctype html><meta charset="utf-8"><section id="what-if"><div class="panel"></div>'
            f'</section><script type="application/json" id="data">{tree}</script>{scripts}'
            "<script>window.told = []; document.addEventListener('flexband:what-if',"
            " (event) => told.push(event.detail));</script>",
            encoding="utf-8",
        )
        return file

    return write


BOUNDS = """(parts) => {
  const all = new flexband.WhatIf(flexband.data.what_if);
  all.take(parts);
  const found = all.bounds([...Array(flexband.data.what_if.times).keys()]);
  return [...found.mean, ...found.error_bar].map((values) => Array.from(values));
}"""


def difference(page, surrogate, subset, **parts):
    """Return how far the page's bands are from those of Python, in parts of the study's width."""
    bands = subset.bands()
    actual = np.array(page.evaluate(BOUNDS, parts))
    expected = np.concatenate([bands[name].values.reshape(2, -1) for name in ("mean", "error_bar")])
    study = surrogate.bands()["error_bar"]
    return np.abs(actual - expected).max() / float((study[1] - study[0]).max())


@pytest.fixture(scope="module")
def polynomial():
    return fb.expand(smooth, INPUTS, fb.PCCI(2, 2))


@pytest.fixture(scope="module")
def polynomial_page(shared_page, page_of, polynomial, tmp_path_factory):
    page = shared_page(page_of(polynomial, tmp_path_factory.mktemp("polynomial") / "page.html"))
    page.wait_for_function("flexband.data")
    return page


@pytest.mark.parametrize("scale", [1.0, 0.4])
@pytest.mark.parametrize("ends", [(1.0, 2.0), (1.2, 1.7), (1.25, 1.25)])
def test_bands_of_narrower_inputs(polynomial_page, polynomial, ends, scale):
    mean, std = INPUTS["c"].logarithm
    changes = {"e": fb.Interval(*ends)}
    if scale < 1:
        changes |= {
            "a": fb.Normal(1.0, 0.1 * scale),
            "b": fb.Uniform(1 - 0.5 * scale, 1 + 0.5 * scale),
            "c": fb.LogNormal.of_logarithm(mean, std * scale),
            "g": dataclasses.replace(INPUTS["g"], std=0.2 * scale),
        }
    low, high = (2 * end - 3.0 for end in ends)
    parts = {
        "centers": [(low + high) / 2, 0.0],
        "radii": [(high - low) / 2, 1.0],
        "scales": [scale, scale, scale, 1.0, scale, scale],
    }
    narrower = polynomial.narrowed(**changes)
    assert difference(polynomial_page, polynomial, narrower, **parts) < 2e-7


@pytest.mark.parametrize("family", [HERMITE, LEGENDRE])
def test_polynomials_of_less_scatter(polynomial_page, family):
    call = "([name, s]) => flexband.scaledPolynomials(name, 7, s).map((row) => Array.from(row))"
    x = np.linspace(-2.0, 2.0, 9)
    for s in (0.0, 0.3, 1.0):
        matrix = np.array(polynomial_page.evaluate(call, [family.name, s]))
        np.testing.assert_allclose(
            family.values(7, x) @ matrix.T, family.values(7, s * x), atol=1e-10
        )


def test_bands_without_scatter_and_with_fixed_intervals(polynomial_page, polynomial):
    narrower = polynomial.narrowed(a=1.0, b=1.0, e=1.5, f=0.5)
    parts = {"centers": [0.0, 0.5], "radii": [0.0, 0.0], "scales": [0.0, 0.0, 1.0, 1.0, 1.0, 1.0]}
    assert difference(polynomial_page, polynomial, narrower, **parts) < 2e-7


def test_bands_of_a_vibration(open_page, tmp_path, page_of):
    inputs = {"w": fb.Interval(60.0, 66.0), "g": fb.Normal(1.0, 0.1), "k": fb.Normal(1.0, 0.02)}
    surrogate = fb.expand(wave, inputs, fb.AdaptivePCCI(0.01))
    assert surrogate.diagnostics["carriers"].max() > 0
    page = open_page(page_of(surrogate, tmp_path / "page.html"))
    page.wait_for_function("flexband.data")
    for (low, high), scale in (((60.0, 66.0), 1.0), ((61.0, 63.0), 1.0), ((60.0, 66.0), 0.5)):
        narrower = surrogate.narrowed(w=fb.Interval(low, high), k=fb.Normal(1.0, 0.02 * scale))
        parts = {
            "centers": [((low + high) / 2 - 63.0) / 3.0],
            "radii": [(high - low) / 6.0],
            "scales": [1.0, scale],
        }
        # rules of expectations have other points: 7e-8
        assert difference(page, surrogate, narrower, **parts) < 3e-7


def test_bands_of_a_vibration_with_many_random_inputs(open_page, tmp_path, page_of):
    def vibration(w, a, b, c):
        angle = ((60.0 + 2 * w + a + 0.5 * b * w)[:, None] + 0.3 * c[:, None]) * WAVE_TIMES
        return (1 + 0.1 * b)[:, None] * np.cos(angle) + (0.1 * c + 0.05 * a)[:, None] * WAVE_TIMES

    inputs = {"w": fb.Interval(-1.0, 1.0)} | {name: fb.Normal(0.0, 1.0) for name in "abc"}
    surrogate = fb.expand(vibration, inputs, fb.AdaptivePCCI(0.02))
    data, _ = what_if(surrogate, surrogate.bands())
    assert [size["name"] for size in data["sizes"]] == ["a", "b", "c"]
    assert any(model["points"]["shape"][0] > 200 for model in data["models"])
    page = open_page(page_of(surrogate, tmp_path / "page.html"))
    page.wait_for_function("flexband.data")
    narrower = surrogate.narrowed(a=fb.Normal(0.0, 0.7), b=fb.Normal(0.0, 0.7))
    parts = {"centers": [0.0], "radii": [1.0], "scales": [0.7, 0.7, 1.0]}
    assert difference(page, surrogate, narrower, **parts) < 3e-7


def test_bands_over_options(open_page, tmp_path, page_of):
    def one_kind(x, y, kind):
        return (x * y)[:, None] * (T if kind[0] == "one" else 1 - 2 * T)

    inputs = {"x": fb.Interval(1.0, 2.0), "y": fb.Normal(1.0, 0.1), "kind": fb.Choice("one", "two")}
    surrogate = fb.expand(one_kind, inputs, fb.PCCI(1, 1))
    page = open_page(page_of(surrogate, tmp_path / "page.html"))
    page.wait_for_function("flexband.data")
    narrower = surrogate.narrowed(x=fb.Interval(1.25, 1.75), y=fb.Normal(1.0, 0.05))
    parts = {"centers": [0.0], "radii": [0.5], "scales": [0.5]}
    assert difference(page, surrogate, narrower, **parts) < 1e-7


PLAYS = {
    "crank": fb.GuidePlay(clearance=0.2, length=1.0),
    "length": fb.Interval(-1.0, 1.0),
    "load": fb.Normal(0.0, 0.3),
    "pin": fb.Play(fb.Interval(0.05, 0.1), within="rim"),
}


@pytest.mark.parametrize("seed", range(2))
def test_bands_of_smaller_plays_are_over_their_discs(open_page, tmp_path, page_of, seed):
    surrogate = fb.expand(drawn_polynomial(seed), PLAYS, fb.PCCI(2, 2))
    page = open_page(page_of(surrogate, tmp_path / "page.html"))
    page.wait_for_function("flexband.data")
    for pin, crank in ((1.0, 1.0), (0.4, 0.5)):
        narrower = surrogate.narrowed(
            pin=fb.Play(0.1 * pin, within="rim"),
            crank=fb.GuidePlay(0.2 * crank, length=1.0),
            length=fb.Interval(-0.6, 0.8),
        )
        parts = {
            "centers": [0.0, 0.0, 0.1, 0.0, 0.0],
            "radii": [crank, crank, 0.7, pin, pin],
            "scales": [1.0],
        }
        assert difference(page, surrogate, narrower, **parts) < 1e-7


def test_a_play_is_narrowed_by_its_slider(open_page, tmp_path, page_of):
    surrogate = fb.expand(
        lambda pin, x: (x + 3 * pin[0] + 4 * pin[1])[:, None] * T,
        {"pin": fb.Play(0.1), "x": fb.Interval(1.0, 2.0)},
        fb.PCCI(0, 1),
    )
    page = open_page(page_of(surrogate, tmp_path / "page.html"))
    thumb = page.get_by_label("radius of pin")
    thumb.press("Home")
    thumb.press("PageUp")
    page.wait_for_function("told.some((one) => one && one.label === 'radius of pin × 0.11')")
    label = page.get_by_role("group", name="pin").locator("output").inner_text()
    assert label == "radius 0.011, 11 % of the study's radius"
    lower, upper = page.evaluate("told[told.length - 1].error_bar.map((v) => Array.from(v))")
    np.testing.assert_allclose([lower, upper], [(1 - 0.055) * T, (2 + 0.055) * T], atol=1e-9)
    python = page.locator(".what-if-python code").inner_text()
    names = {"fb": fb, "dataclasses": dataclasses, "surrogate": surrogate}
    np.testing.assert_allclose(eval(python, names)["error_bar"], [lower, upper], atol=1e-9)


def test_a_slider_is_moved_by_keyboard(open_page, tmp_path, page_of, polynomial):
    page = open_page(page_of(polynomial, tmp_path / "page.html"))
    lower = page.get_by_label("lower end of e")
    lower.focus()
    for _ in range(4):
        page.keyboard.press("ArrowRight")
    page.wait_for_function("told.some((one) => one.label === 'e 1.02 … 1.98')")
    assert page.workers
    python = "surrogate.narrowed(e=fb.Interval(1.02, 1.98)).bands()"
    assert page.locator(".what-if-python code").inner_text() == python
    bands = eval(python, {"fb": fb, "surrogate": polynomial})
    curves = page.evaluate(
        "(({ times, mean, error_bar }) => [times, ...mean, ...error_bar].map((v) => [...v]))"
        "(told[told.length - 1])"
    )
    expected = np.concatenate([bands[name].values for name in ("mean", "error_bar")])
    np.testing.assert_allclose(curves, [np.arange(41), *expected], atol=1e-6)
    width = float((bands["error_bar"][1] - bands["error_bar"][0]).max())
    cells = page.locator(".what-if-table tbody td").all_inner_texts()
    assert float(cells[1]) == pytest.approx(width, rel=1e-3)
    page.get_by_label("scatter of a").focus()
    page.keyboard.press("Home")
    assert "e=fb.Interval(1.02, 1.98), a=1" in page.locator(".what-if-python code").inner_text()
    page.get_by_role("button", name="Reset").click()
    assert page.evaluate("told[told.length - 1]") is None
    assert page.locator(".what-if-python code").inner_text() == "surrogate.bands()"


def test_parameters_of_distributions_have_sliders(open_page, tmp_path, page_of):
    def line(x, y):
        return (x * y)[:, None] * T

    inputs = {"x": fb.Normal(fb.Interval(1.0, 3.0), 0.1), "y": fb.Uniform(1.0, 2.0)}  # pyright: ignore
    surrogate = fb.expand(line, inputs, fb.PCCI(1, 1))
    page = open_page(page_of(surrogate, tmp_path / "page.html"))
    page.get_by_label("keep the middle").uncheck()
    page.get_by_label("upper end of x.mean").press("PageDown")
    page.get_by_label("scatter of y").press("PageDown")
    python = page.locator(".what-if-python code").inner_text()
    assert python.startswith('surrogate.narrowed(y=fb.Uniform(1.05, 1.95), **{"x.mean": fb.Int')
    page.wait_for_function("told.some((one) => one && one.label.includes('scatter of y'))")
    bands = eval(python, {"fb": fb, "surrogate": surrogate})["error_bar"]
    curves = page.evaluate("told[told.length - 1].error_bar.map((values) => Array.from(values))")
    np.testing.assert_allclose(curves, bands, atol=1e-6)


@pytest.mark.parametrize(
    "inputs",
    [
        {"x": fb.Normal(1.0, 0.1), "y": fb.Uniform(1.0, 2.0)},
        {"x": fb.Interval(-1.0, 1.0), "y": fb.Interval(1.0, 2.0)},
    ],
)
def test_inputs_of_one_kind_and_an_output_that_is_constant(open_page, tmp_path, page_of, inputs):
    def outputs(x, y):
        return np.stack([(x**2 * y)[:, None] * T, np.ones((len(x), 1)) * T], axis=1)

    surrogate = fb.expand(outputs, inputs, fb.PCCI(2, 2))
    page = open_page(page_of(surrogate, tmp_path / "page.html"))
    page.wait_for_function("flexband.data")
    space = surrogate.space
    full = {
        "centers": [0.0] * space.interval_dimension,
        "radii": [1.0] * space.interval_dimension,
        "scales": [1.0] * space.random_dimension,
    }
    assert difference(page, surrogate, surrogate, **full) < 1e-7
    assert page.locator(".what-if-table tbody td").all_inner_texts()[4:7] == ["0", "0", "0 %"]
