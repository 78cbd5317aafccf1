"""The animated mechanism in a browser."""

import json
import re
from dataclasses import replace
from importlib import resources

import numpy as np
import pytest

import flexband as fb
from flexband.report.page.motion.motion import motion_data
from flexband.uncertainty.inputs.space import Space

ASSETS = resources.files("flexband.report.page").joinpath("assets")
SCRIPTS = (
    "arrays",
    "element",
    "colors",
    "numbers",
    "motion_pen",
    "motion_scene",
    "motion",
)
COLORS = "--ink: #222; --paper: #fff; --muted: #667; --line: #ccc; --accent: #26b; --second: #d60"
BAR = {"height": 0.02, "width": 0.02, "density": 1000.0}


def crank(length):
    """A crank that turns once per second and pushes a beam in a guide, with a name to escape."""
    rod = fb.Beam(length=0.5, youngs_modulus=1e9, poissons_ratio=0.3, elements=2, start=(0.2, 0.0),
                  **BAR)  # fmt: skip
    return fb.Mechanism(
        bodies={
            "<b>crank</b>": fb.RigidBody.bar(length=length, **BAR),
            "rod": rod,
            "slider": fb.PointMass(mass=0.1, position=(0.7, 0.0)),
        },
        joints={
            "A": fb.Revolute("<b>crank</b>.start", (0.0, 0.0)),
            "B": fb.Revolute("rod.start", "<b>crank</b>.end"),
            "C": fb.Revolute("slider", "rod.end"),
            "slot": fb.Slot("slider", (0.0, 0.0)),
            "motor": fb.PrescribedRotation("<b>crank</b>", lambda t: 2 * np.pi * t),
        },
        loads={"spring": fb.Spring("slider", (1.2, 0.0), 5.0)},
        sensors={"slider": fb.Position("slider")},
    )


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    response = fb.dynamic_response(crank, duration=1.0, step=5e-3)
    tree, reason = motion_data(response, Space({"length": fb.Interval(0.199, 0.201)}))
    assert tree is not None, reason
    scripts = "\n".join(ASSETS.joinpath(f"{name}.js").read_text() for name in SCRIPTS)
    style = ASSETS.joinpath("motion.css").read_text()
    page = tmp_path_factory.mktemp("motion") / "page.html"
    text = json.dumps(tree).replace("<", "\\u003c")
    page.write_text(f"""<!doctype html><meta charset="utf-8">
        <style>:root {{ {COLORS} }} {style}</style>
        <section id="motion"><div class="panel"></div></section>
        <script>{scripts}
        const heard = [];
        document.addEventListener("flexband:time", (event) => heard.push(event.detail));
        flexband.unpackedTree({{ motion: {text} }}).then((data) => {{
          flexband.starters.forEach((start) => start(data));
        }});</script>""", encoding="utf-8")  # fmt: skip
    return page


@pytest.fixture
def page(open_page, file):
    page = open_page(file)
    page.wait_for_function("window.flexband.motion")
    return page


@pytest.fixture(scope="module")
def still_page(shared_page, file):
    """A page in which nothing is changed."""
    page = shared_page(file)
    page.wait_for_function("window.flexband.motion")
    return page


def time_shown(page):
    return page.locator("input[type=range]").get_attribute("aria-valuetext")


def ink_of(page):
    """Return how many pixels of the drawing have ink, and a checksum of all."""
    return page.evaluate("""() => { const { canvas, pen } = flexband.motion;
        flexband.motion.paint();
        const { data } = pen.context.getImageData(0, 0, canvas.width, canvas.height);
        let [ink, sum] = [0, 0];
        data.forEach((value, k) => {
          ink += k % 4 === 3 && value > 0;
          sum = (31 * sum + value) % 1e9;
        });
        return [ink, sum]; }""")


def test_play_moves_the_drawing_the_slider_and_the_page(page):
    first = ink_of(page)
    assert first[0] > 1000
    assert time_shown(page) == "t = 0.000 s" or time_shown(page) == "t = 0.00 s"
    page.get_by_role("button", name="Play").click()
    page.wait_for_function("heard.length > 3")
    page.get_by_role("button", name="Pause").click()
    number = int(page.locator("input[type=range]").input_value())
    assert number > 0
    events = page.evaluate("heard")
    assert events[-1] == {"time": pytest.approx(number * 5e-3), "from": "motion"}
    assert ink_of(page) != first
    page.wait_for_timeout(100)
    assert page.evaluate("heard.length") == len(events)


def test_the_legend_says_which_arrow_is_the_longest(still_page):
    joints = ("A", "B", "C", "slot")
    sensors = {name: fb.Reaction(name) for name in joints}
    reactions = fb.simulate(replace(crank(0.2), sensors=sensors), duration=1.0, step=5e-3)
    sizes = np.hypot(
        *(reactions.sel(output=[f"{k}_{axis}" for k in joints]).values for axis in "XY")
    )
    joint = int(np.argmax(sizes.max(axis=1)))
    legend = still_page.locator(".motion-key-reaction").inner_text()
    pattern = r"reactions; the longest arrow is (\S+) N, at (\S+), t = (\S+) s"
    size, name, time = re.fullmatch(pattern, legend).groups()
    assert name == joints[joint]
    size = float(size)
    time = float(time)
    assert size == pytest.approx(sizes.max(), rel=5e-3)
    assert size == pytest.approx(sizes[joint, round(time / 5e-3)], rel=5e-3)


def test_lengths_are_in_metres_as_elsewhere_on_the_page(still_page):
    lengths = still_page.evaluate("[2.5e-7, 2.104e-4, 0.05, 3].map(flexband.shownLength)")
    assert lengths == ["2.5e−7 m", "0.00021 m", "0.05 m", "3 m"]
    assert still_page.locator(".motion-now").inner_text().endswith(" m.")
    trace = still_page.locator(".motion-key-trace")
    style = trace.evaluate("key => getComputedStyle(key, '::before').borderTopStyle")
    assert style == "solid"  # as it is drawn


def test_it_ends_and_begins_again(page):
    page.get_by_label("Duration").select_option("0")
    page.evaluate("flexband.motion.show(195, true)")
    page.get_by_role("button", name="Play").click()
    page.get_by_role("button", name="Play").wait_for()
    assert time_shown(page).startswith("t = 1.00")
    page.get_by_role("button", name="Play").click()
    page.wait_for_function("flexband.motion.frame < 100")


def test_keys(page):
    page.locator("canvas").focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("PageDown")
    assert page.evaluate("flexband.motion.frame") in (0, 1)
    page.keyboard.press("End")
    assert page.evaluate("flexband.motion.frame") == 200
    page.keyboard.press("Home")
    page.keyboard.press("Space")
    page.wait_for_function("flexband.motion.frame > 2")
    page.keyboard.press("Space")
    assert not page.evaluate("flexband.motion.playing")
    page.locator("input[type=range]").focus()
    page.keyboard.press("End")
    page.wait_for_function("heard.at(-1).time > 0.999")


def test_it_shows_the_time_that_the_charts_tell(page):
    page.evaluate("""document.dispatchEvent(new CustomEvent("flexband:time",
        { detail: { time: 0.5021, from: "charts" } }))""")
    assert page.evaluate("flexband.motion.frame") == 100
    assert page.evaluate("heard.length") == 1  # the charts' own


def test_words_tell_what_is_shown(page):
    label = page.locator("canvas").get_attribute("aria-label")
    assert "Bodies: <b>crank</b>, rod, slider" in label
    assert "deviate" in label
    legend = page.locator("figcaption")
    assert "samples of the inputs, deviations drawn" in legend.text_content()
    page.get_by_role("checkbox", name="samples").uncheck()
    assert "samples of the inputs" not in legend.text_content()
    page.get_by_role("checkbox", name="names").check()
    assert page.locator("#motion b").count() == 0


def test_deviations_are_drawn_true_to_scale_or_magnified(page):
    """The orange of samples spreads with the factor."""
    page.get_by_role("checkbox", name="forces").uncheck()
    page.evaluate("flexband.motion.show(50, false)")

    def spread(factor):
        """Return in how many rows of the drawing there is orange."""
        page.get_by_label("Deviations").select_option(str(factor))
        return page.evaluate("""() => { const { canvas, pen } = flexband.motion;
            flexband.motion.paint();
            let rows = 0;
            for (let y = 0; y < canvas.height; y++) {
              const { data } = pen.context.getImageData(0, y, canvas.width, 1);
              for (let k = 0; k < data.length; k += 4) {
                const [red, , blue, alpha] = data.subarray(k, k + 4);
                if (red > 150 && blue < 0.7 * red && alpha > 50) { rows++; break; }
              }
            }
            return rows; }""")

    assert spread(1) < spread(20) < spread(50)


def test_on_a_phone_it_fits(open_page, file):
    page = open_page(file, viewport={"width": 360, "height": 740}, device_scale_factor=2)
    page.wait_for_function("window.flexband.motion")
    assert page.evaluate("document.documentElement.scrollWidth") <= 360
    page.evaluate("flexband.motion.paint()")
    assert page.evaluate("flexband.motion.canvas.width / flexband.motion.canvas.clientWidth") == (
        pytest.approx(2.0, 0.02)
    )


def test_without_motion_nothing_is_built(open_page, file):
    page = open_page(file)
    page.wait_for_function("window.flexband.motion")
    page.evaluate("""document.querySelector("#motion .panel").replaceChildren();
        flexband.starters.forEach((start) => start({ motion: null }))""")
    assert page.locator("canvas").count() == 0


def test_names_never_overlap(file, open_page):
    page = open_page(file, viewport={"width": 360, "height": 740})
    boxes = """() => {
      const { scene, pen, frame } = flexband.motion;
      pen.names = [];
      scene.drawNames(pen, frame);
      return pen.names.map(({ at, half }) => [...at, ...half]);
    }"""
    page.wait_for_function("flexband.motion")
    page.wait_for_timeout(200)
    name_boxes = np.array(page.evaluate(boxes))
    assert len(name_boxes) >= 5
    for k, (*at, across, up) in enumerate(name_boxes):
        separation = np.abs(name_boxes[:k, :2] - at) >= name_boxes[:k, 2:] + [across, up]
        assert separation.any(axis=1).all()


@pytest.mark.parametrize("kind", ["beam", "cable"])
def test_marks_at_nodes_are_drawn_if_they_are_apart(still_page, kind):
    """A beam of 300 pixels: 4 elements have marks, 128 would be a hatching."""
    script = """([kind, elements]) => {
        const { pen, scene } = flexband.motion, far = 300 / pen.scale;
        const nodes = Array.from({ length: elements + 1 }, (_, k) => [(far * k) / elements, 0]);
        const { spacing } = scene.data.shapes.find((own) => own.spacing); // of the rod's nodes
        const shape = kind === "beam"
          ? { kind: "line", spacing, strokes: nodes.map((node) => [node, node]) }
          : { kind: "mark", spacing, strokes: [nodes] };
        let marks = 0;
        const count = () => { marks += 1; };
        const fake = { length: (points) => pen.length(points), line: count, mark: count };
        const placed = Object.assign(Object.create(scene), { places: (_, places) => places });
        placed.drawShape(fake, shape, 0, false);
        return marks; }"""
    assert still_page.evaluate(script, [kind, 4]) == 5
    assert still_page.evaluate(script, [kind, 128]) == 0


def test_gravity_is_drawn_in_a_free_corner(still_page):
    corner = """(places) => { const { pen } = flexband.motion;
        const [x, y] = pen.freeCorner(places.map(([x, y]) => pen.place([x * pen.width, y * pen.height])));
        return [x > pen.width / 2, y > pen.height / 2]; }"""  # noqa: E501
    assert still_page.evaluate(corner, [[0.5, 0.5]]) == [True, False]
    assert still_page.evaluate(corner, [[0.97, 0.05]]) == [False, False]
    assert still_page.evaluate(corner, [[0.97, 0.05], [0.03, 0.05]]) == [True, True]
