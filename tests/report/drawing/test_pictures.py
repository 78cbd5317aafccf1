"""Pictures in SVG: they show what Matplotlib's drawings show, and need no Matplotlib."""

import re
import subprocess
import sys
from base64 import b64decode
from xml.etree import ElementTree

import numpy as np
import pytest

import flexband as fb
from flexband.report.drawing.pictures import fields_picture, mechanism_picture
from flexband.report.drawing.svg import SvgAxes, tick_labels, ticks
from flexband.report.shapes.shapes import Line
from tests.mechanics.models import slider_crank
from tests.report.drawing.test_drawing import four_bar, texts

SVG = "{http://www.w3.org/2000/svg}"


def tree(address):
    head, content = address.split(",")
    assert head == "data:image/svg+xml;base64"
    return ElementTree.fromstring(b64decode(content))


def texts_in(address):
    return {element.text for element in tree(address).iter(f"{SVG}text")}


@pytest.mark.parametrize("model", [slider_crank(), four_bar()])
def test_the_same_names_and_lengths_are_written_as_by_matplotlib(model):
    assert set(texts(fb.draw(model))) <= texts_in(mechanism_picture(model))


@pytest.mark.parametrize("model", [slider_crank(), four_bar()])
def test_a_mechanism_fills_its_picture(model):
    picture = tree(mechanism_picture(model))
    size = [float(number) for number in picture.get("viewBox").split()[2:]]
    frame = 8.0, 60.0  # [pt]: symbols and names leave little more than the numbers of the axes
    texts = [text for text in picture.iter(f"{SVG}text") if text.get("font-size") == "9.0"]
    shapes = [path.get("d") for path in picture.iter(f"{SVG}path")]
    points = [re.findall(r"(-?[\d.]+) (-?[\d.]+)", d) for d in shapes if "v3.5" not in d]
    x = [float(a) for pairs in points for a, _ in pairs]
    places = [re.findall(r"-?[\d.]+", text.get("transform"))[0] for text in texts]
    x += [float(place) for place in places]
    assert max(x) - min(x) > 0.8 * (size[0] - sum(frame))
    assert size[0] == pytest.approx(870.0 if "slider" in model.bodies else 430.0)  # page, column


def test_lines_are_drawn_to_scale():
    axes = SvgAxes(np.array([[-1.0, 10.0], [3.0, 30.0]]), np.array([400.0, 100.0]), ("x", "<y>"))
    axes.line(np.array([(-1.0, 10.0), (0.0, 30.0), (np.nan, 0.0), (3.0, 20.0)]), Line(part=""))
    ((_, element),) = axes.elements
    assert 'd="M0 100 100 0M400 50"' in element
    assert "&lt;y&gt;" in axes.picture(0.0, 0.0)


def test_layers_cover_each_other():
    axes = SvgAxes(np.array([[0.0, 0.0], [1.0, 1.0]]), np.array([90.0, 90.0]), ("", ""))
    square = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)])
    axes.area(square, Line(layer=5.0, fill="load"))
    axes.area(square, Line(layer=3.0, fill="filled"))
    picture = axes.picture(0.0, 0.0)
    assert picture.index("#c6dbef") < picture.index("#d95f02")


@pytest.mark.parametrize(
    ("low", "high", "max_count", "exact"),
    [
        (-0.3, 0.31, 6, ["−0.2", "0", "0.2"]),
        (0.0, 1.0, 5, ["0", "0.2", "0.4", "0.6", "0.8", "1"]),
        (6.8e10, 6.96e10, 4, ["6.8e10", "6.85e10", "6.9e10", "6.95e10"]),
        (1.0, 1.00002, 2, ["1", "1.00001", "1.00002"]),
        (0.0, 12000.0, 3, ["0", "5000", "10000"]),
    ],
)
def test_numbers_of_axes_are_round(low, high, max_count, exact):
    assert tick_labels(ticks(low, high, max_count)) == exact


def test_fields_are_drawn_with_their_limits():
    limits = fb.IntervalField(1.0, 3.0, length=2.0, domain=(0.0, 2.0))
    spread = fb.RandomField(5.0, 0.5, correlation_length=2.0, domain=(0.0, 2.0))
    address = fields_picture({"a": limits, "b": spread}, {"a": "time"})
    assert {"a", "b", "limits", "μ ± σ", "time [s]", "position [m] or time [s]"} <= texts_in(
        address
    )
    curves = [
        e.attrib["d"] for e in tree(address).iter(f"{SVG}path") if e.get("stroke") == "#5b9bd0"
    ]
    assert len(curves) == 16
    assert all(len(re.findall(r"[\d.]+", line)) == 402 for line in curves)


def test_no_picture_needs_matplotlib():
    code = "import flexband.report.study_report, sys; assert 'matplotlib' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
