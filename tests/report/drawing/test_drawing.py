"""Drawings of mechanisms, read back from the artists of the figures."""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon

import flexband as fb
from flexband.mechanics.joints.joint import PairJoint
from flexband.mechanics.kernels.forms import subtract
from flexband.mechanics.loads.load import Entries
from flexband.report.shapes.scene import hull
from tests.mechanics.models import slider_crank

BAR = {"height": 0.02, "width": 0.02, "density": 1000.0}
MATERIAL = {"density": 2700.0, "youngs_modulus": 70e9, "poissons_ratio": 0.3}


def texts(figure):
    return [text.get_text() for text in figure.axes[0].texts]


def names(figure):
    return {name for text in texts(figure) for name in text.split(", ")}


def part(figure, gid):
    """Return the points [m] of the artist of a part, shape (points, 2)."""
    (artist,) = [a for a in figure.axes[0].get_children() if a.get_gid() == gid]
    return artist.get_xydata() if isinstance(artist, Line2D) else polygon(artist)


def polygon(artist):
    assert isinstance(artist, Polygon)
    return artist.get_xy()[:-1]


def four_bar(crank=1.0, angle=0.8, guess=0.15):
    """A parallelogram whose bodies have to be moved by assembly."""
    return fb.Mechanism(
        bodies={
            "crank": fb.RigidBody.bar(length=crank, angle=angle + guess, **BAR),
            "coupler": fb.RigidBody.bar(length=2.0, start=(0.6, 0.8), angle=0.1, **BAR),
            "rocker": fb.RigidBody.bar(length=crank, start=(2.1, 0.0), angle=angle - guess, **BAR),
        },
        joints={
            "A": fb.Revolute("crank.start", (0.0, 0.0)),
            "B": fb.Revolute("coupler.start", "crank.end"),
            "C": fb.Revolute("coupler.end", "rocker.end"),
            "D": fb.Revolute("rocker.start", (2.0, 0.0)),
            "motor": fb.PrescribedRotation("crank", lambda t: angle - 3.0 * t),
        },
    )


def test_pins_and_links_are_drawn_as_assembled():
    figure = fb.draw(four_bar())
    tip = np.array([np.cos(0.8), np.sin(0.8)])
    exact = {"A": (0.0, 0.0), "B": tip, "C": np.add(tip, (2.0, 0.0)), "D": (2.0, 0.0)}
    for name, place in exact.items():
        np.testing.assert_allclose(part(figure, f"joint {name!r}"), [place], atol=1e-9)
    np.testing.assert_allclose(part(figure, "body 'coupler'"), [exact["B"], exact["C"]], atol=1e-9)
    np.testing.assert_allclose(part(figure, "center of body 'crank'"), [tip / 2], atol=1e-9)
    assert figure.axes[0].get_aspect() == 1.0


def test_every_part_is_named():
    model = slider_crank()
    assert names(fb.draw(model)) >= {*model.bodies, *model.joints, *model.loads}
    assert not names(fb.draw(model, names=False)) & {*model.bodies, *model.joints, *model.loads}
    assert names(fb.draw(model, names=False)) == {"0.2 m", "0.45 m"}


def test_names_do_not_overlap():
    for model in (slider_crank(), four_bar()):
        figure = fb.draw(model)
        boxes = [text.get_window_extent() for text in figure.axes[0].texts]
        assert not any(a.overlaps(b) for a, b in combinations(boxes, 2))
        axes = figure.axes[0].get_window_extent()
        assert all(axes.contains(*corner) for box in boxes for corner in box.get_points())


def test_lengths_are_those_of_the_sample():
    model = four_bar(crank=np.array([0.75, 1.25]))
    for sample, length in enumerate((0.75, 1.25)):
        figure = fb.draw(model, sample=sample)
        lengths = sorted(text for text in texts(figure) if text.endswith(" m"))
        assert lengths == [f"{length} m", f"{length} m", "2 m"]
        tip = length * np.array([np.cos(0.8), np.sin(0.8)])
        np.testing.assert_allclose(part(figure, "joint 'B'"), [tip], atol=1e-9)
    assert not [text for text in texts(fb.draw(model, dimensions=False)) if text.endswith(" m")]


def test_the_length_of_a_short_body_is_written_beside_it():
    bodies = {
        "long": fb.RigidBody.bar(length=3.0, **BAR),
        "short": fb.RigidBody.bar(length=0.01, start=(3.0, 0.0), **BAR),
    }
    assert {"3 m", "0.01 m"} <= set(texts(fb.draw(fb.Mechanism(bodies=bodies))))


@pytest.mark.parametrize("sample", [-1, 2, 0.5])
def test_a_sample_that_does_not_exist_is_refused(sample):
    with pytest.raises(fb.errors.InputError, match="sample must be"):
        fb.draw(four_bar(crank=np.array([0.75, 1.25])), sample=sample)


def test_a_sample_that_cannot_be_assembled_is_drawn_as_it_is_given():
    model = four_bar(crank=np.array([1.0, 0.1]))
    rod = fb.Distance("crank.end", (0.0, 3.0), 1.0)
    mechanism = fb.Mechanism(bodies=model.bodies, joints={**model.joints, "far": rod})
    with pytest.warns(fb.errors.FlexbandWarning, match=r"drawn as they are given.*\n.*sample 1"):
        figure = fb.draw(mechanism, sample=1)
    assert {"body 'crank'", "joint 'far'"} <= {a.get_gid() for a in figure.findobj()}


def test_a_curved_cable_is_drawn_along_its_arc():
    cable = fb.Cable(
        length=1.2, elements=6, curvature=1.5, angle=0.3, start=(0.2, 0.1), mass_per_length=1.0,
        axial_stiffness=1e5, bending_stiffness=1.0,
    )  # fmt: skip
    clamp = fb.Weld("c.start", (0.2, 0.1), 0.3)
    figure = fb.draw(fb.Mechanism(bodies={"c": cable}, joints={"clamp": clamp}))
    line = part(figure, "body 'c'")
    centre = np.array([0.2, 0.1]) + np.array([-np.sin(0.3), np.cos(0.3)]) / 1.5
    np.testing.assert_allclose(np.linalg.norm(line - centre, axis=1), 1 / 1.5, atol=3e-5)
    np.testing.assert_allclose(line[0], [0.2, 0.1], atol=1e-9)
    assert np.linalg.norm(np.diff(line, axis=0), axis=1).sum() == pytest.approx(1.2, rel=1e-3)
    assert "1.2 m" in texts(figure)


def test_a_beam_has_its_true_height():
    height = np.array([0.1, 0.3])
    beam = fb.Beam(length=1.5, height=height, width=0.1, elements=2, angle=0.5, **MATERIAL)
    sides = np.split(part(fb.draw(fb.Mechanism(bodies={"b": beam}), sample=1), "body 'b'"), 2)
    np.testing.assert_allclose(np.linalg.norm(sides[0] - sides[1][::-1], axis=1), 0.3)
    axis = (sides[0] + sides[1][::-1]) / 2
    np.testing.assert_allclose(axis[-1], 1.5 * np.array([np.cos(0.5), np.sin(0.5)]))


@pytest.mark.parametrize(
    ("section", "ends"),
    [
        ({"section": fb.sections.Circle(np.array([0.1, 0.3]), 0.05)}, (0.3, 0.3)),
        ({"section": fb.sections.GeneralSection(0.03, 0.03 * 0.3**2 / 12)}, (0.3, 0.3)),
        ({"height": lambda x: 0.3 - 0.1 * x, "width": 0.1}, (0.3, 0.15)),
    ],
)
def test_a_beam_has_the_height_of_its_sections(section, ends):
    beam = fb.Beam(length=np.array([1.0, 1.5]), elements=2, **section, **MATERIAL)
    load = fb.DistributedLoad("b", y=-1.0)
    figure = fb.draw(fb.Mechanism(bodies={"b": beam}, loads={"q": load}), sample=1)
    upper, lower = np.split(part(figure, "body 'b'"), 2)
    np.testing.assert_allclose((upper - lower[::-1])[[0, -1], 1], ends)
    rise = part(figure, "load 'q'")[[0, -1], 1] - np.divide(ends, 2)
    np.testing.assert_allclose(rise, rise[0])  # the arrows end on the upper side


def test_a_plate_is_the_hull_of_its_points():
    square = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    inside = [(0.5, 0.5), (0.5, 0.0)]
    assert {tuple(p) for p in hull(np.array(inside + square))} == set(square)
    np.testing.assert_allclose(hull(np.array([(0, 0), (2, 2), (1, 1)])), [(0, 0), (2, 2)])
    assert len(hull(np.zeros((3, 2)))) == 1


def test_a_body_with_one_point_is_a_circle_of_its_radius_of_gyration():
    disc = fb.RigidBody.disc(radius=0.2, width=0.1, density=1000.0, position=(1.0, 2.0))
    circle = part(fb.draw(fb.Mechanism(bodies={"d": disc})), "body 'd'")
    np.testing.assert_allclose(np.linalg.norm(circle - (1.0, 2.0), axis=1), 0.2 / np.sqrt(2))


def direction(figure, gid):
    """Return the direction of an arrow."""
    line = part(figure, gid)
    return (line[-1] - line[0]) / np.linalg.norm(line[-1] - line[0])


def test_arrows_point_in_the_direction_of_forces():
    bar = fb.RigidBody.bar(length=1.0, angle=0.5, **BAR)
    q = fb.DistributedLoad("b", y=lambda x: -1.0 - x)
    model = fb.Mechanism(
        bodies={"b": fb.Beam(length=1.0, elements=2, **(BAR | MATERIAL)), "bar": bar},
        loads={
            "F": fb.Force("bar.end", 3.0, lambda t: -4.0 + t),
            "follows": fb.Force("bar.start", y=2.0, following=True),
            "later": fb.Force("bar", x=np.sin),
            "M": fb.Moment("bar", -2.0),
            "q": q,
            "g": fb.Gravity(),
        },
    )
    figure = fb.draw(model)
    np.testing.assert_allclose(direction(figure, "load 'F'"), (0.6, -0.8), atol=1e-9)
    follows = (-np.sin(0.5), np.cos(0.5))
    np.testing.assert_allclose(direction(figure, "load 'follows'"), follows, atol=1e-9)
    np.testing.assert_allclose(direction(figure, "load 'later'"), (1.0, 0.0), atol=1e-9)
    np.testing.assert_allclose(direction(figure, "load 'g'"), (0.0, -1.0), atol=1e-9)
    assert turn(part(figure, "load 'M'"), part(figure, "center of body 'bar'")) < 0
    tails = part(figure, "load 'q'")
    np.testing.assert_allclose(tails[:, 0], np.linspace(0.0, 1.0, len(tails)), atol=1e-9)
    lengths = tails[:, 1] - 0.01  # above the beam's upper side
    np.testing.assert_allclose(lengths / lengths[0], 1.0 + tails[:, 0])


def turn(line, centre):
    """Return the angle by which a curve turns about a point [rad]."""
    x, y = (line - centre).T
    return np.diff(np.unwrap(np.arctan2(y, x))).sum()


def test_arrows_point_in_the_direction_of_drives():
    assert turn(part(fb.draw(four_bar()), "joint 'motor'"), (0.0, 0.0)) < 0
    fast = fb.Mechanism(
        bodies={"m": fb.PointMass(mass=1.0, position=(0.1, 0.0)), "n": fb.PointMass(mass=1.0)},
        joints={
            "path": fb.PrescribedPath(
                "m", lambda t: 0.1 * np.cos(150 * t), lambda t: 0.1 * np.sin(150 * t)
            ),
            "line": fb.Slot("n", (0.0, 0.0)),
            "push": fb.PrescribedTravel("n", (0.0, 0.0), lambda t: -2.0 * t),
        },
    )
    figure = fb.draw(fast)
    np.testing.assert_allclose(direction(figure, "joint 'path'"), (0.0, 1.0), atol=1e-6)
    np.testing.assert_allclose(direction(figure, "joint 'push'"), (-1.0, 0.0), atol=1e-9)


@pytest.mark.parametrize("sense", [-1.0, 1.0])
def test_arrows_of_drives_that_start_from_rest_point_in_their_direction(sense):
    def angle(t):
        return 0.5 + sense * (t**2 / 2 + (np.cos(0.4 * t) - 1) / 0.16)  # of fourth order in t

    bar = fb.RigidBody.bar(length=1.0, angle=0.5, **BAR)
    figure = fb.draw(
        fb.Mechanism(
            bodies={"bar": bar, "n": fb.PointMass(mass=1.0)},
            joints={
                "A": fb.Revolute("bar.start", (0.0, 0.0)),
                "motor": fb.PrescribedRotation("bar", angle),
                "line": fb.Slot("n", (0.0, 0.0)),
                "push": fb.PrescribedTravel("n", (0.0, 0.0), lambda t: sense * t**3),
            },
        )
    )
    assert turn(part(figure, "joint 'motor'"), (0.0, 0.0)) * sense > 0
    np.testing.assert_allclose(direction(figure, "joint 'push'"), (sense, 0.0), atol=1e-9)


@pytest.mark.parametrize(
    "kind", [{"stiffness": 5.0}, {"damping": 1.0}, {"pull": 2.0}, {"stiffness": 5.0, "damping": 1}]
)
def test_a_spring_reaches_from_point_to_point(kind):
    mass = fb.PointMass(mass=1.0, position=(1.0, 0.5))
    figure = fb.draw(
        fb.Mechanism(bodies={"m": mass}, loads={"s": fb.Spring("m", (0.0, 0.0), **kind)})
    )
    line = part(figure, "load 's'")
    np.testing.assert_allclose(line[[0, -1]], [(1.0, 0.5), (0.0, 0.0)], atol=1e-9)
    offsets = (line @ (-0.5, 1.0))[np.isfinite(line).all(axis=1)]
    signs = np.sign(np.diff(offsets)[np.abs(np.diff(offsets)) > 1e-9])
    assert (np.count_nonzero(np.diff(signs)) > 8) == ("stiffness" in kind)  # a zigzag


@dataclass(frozen=True)
class Level(PairJoint):
    """A user's joint: two points at one height."""

    first: str
    second: tuple[float, float]

    def constraints(self, frame):
        return [subtract(frame(self.first).position, frame(self.second).position)[1]]


class Tug:
    """A user's load: a push towards the origin."""

    def __init__(self, *points):
        self.points = points

    def enters(self, model):
        positions = [p for name in self.points for p in model.frame(name).position]
        return Entries(forces={next(iter(p.terms))[1]: -p for p in positions})


def test_parts_of_unknown_type_are_diamonds():
    figure = fb.draw(
        fb.Mechanism(
            bodies={"m": fb.PointMass(mass=1.0, position=(1.0, 0.4))},
            joints={"level": Level("m", (0.0, 0.5))},
            loads={"tug": Tug("m"), "nowhere": Tug()},
        )
    )
    np.testing.assert_allclose(part(figure, "joint 'level'"), [(1.0, 0.5)], atol=1e-9)
    np.testing.assert_allclose(part(figure, "load 'tug'"), [(1.0, 0.5)], atol=1e-9)
    assert {"m", "level", "tug", "without a place: nowhere"} <= set(texts(figure))


def test_given_axes_are_drawn_on():
    figure = Figure()
    left, right = figure.subplots(1, 2)
    assert fb.draw(four_bar(), axes=right) is figure
    assert right.texts
    assert not left.texts
    low, high = np.sort(right.transData.inverted().transform(right.get_window_extent()), axis=0)
    assert np.all(low < (0.0, 0.0))
    assert np.all(high > (2.0 + np.cos(0.8), np.sin(0.8)))


def test_names_keep_their_space_if_more_is_drawn():
    figure = Figure()
    axes = figure.add_subplot()
    fb.draw(four_bar(), axes=axes)
    figure.draw_without_rendering()
    limits = [*axes.get_xlim(), *axes.get_ylim()]
    axes.plot([0.5, 1.0], [0.2, 0.4])
    axes.locator_params(nbins=3)
    figure.draw_without_rendering()
    np.testing.assert_allclose([*axes.get_xlim(), *axes.get_ylim()], limits)


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_mechanisms_of_any_size_fit_the_figure(scale):
    bar = fb.RigidBody.bar(length=scale, height=scale / 50, width=scale, density=1.0, angle=0.3)
    figure = fb.draw(fb.Mechanism(bodies={"bar": bar}, loads={"g": fb.Gravity()}))
    assert figure.get_size_inches() == pytest.approx((8.0, 4.0), abs=0.3)
    assert f"{scale:g} m" in texts(figure)
