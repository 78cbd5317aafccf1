"""Linkages of pylinkage's own examples, imported: the motion is the same to 1e-9."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import flexband as fb

pytest.importorskip("pylinkage")
from pylinkage.actuators import Crank
from pylinkage.components import Ground
from pylinkage.dyads import FixedDyad, RRRDyad
from pylinkage.simulation import Linkage

EXAMPLE = runpy.run_path(
    str(Path(__file__).parents[2] / "examples" / "models" / "pylinkage_linkage.py")
)


def four_bar(crank=1.0, coupler=3.0, rocker=1.0, ground=3.0):
    """That of `fourbar_linkage.py`, a parallelogram; `fourbar_from_lengths_demo.py` has others."""
    first = Ground(0.0, 0.0, name="A")
    second = Ground(ground, 0.0, name="D")
    driver = Crank(first, radius=crank, angular_velocity=0.31, initial_angle=0.31, name="B")
    pin = RRRDyad(driver.output, second, distance1=coupler, distance2=rocker, name="C")
    return Linkage([first, second, driver, pin])


def strider():
    """The walking mechanism of `strider.py`: its feet H and I hang on two dyads each."""
    a = Ground(0.0, 0.0, name="A")
    y = Ground(0.0, 1.0, name="Y")
    right = FixedDyad(a, y, distance=2.0, angle=-np.pi / 4, name="B")
    left = FixedDyad(a, y, distance=2.0, angle=np.pi / 4, name="Bp")
    crank = Crank(a, radius=1.0, angular_velocity=-np.pi / 5, name="C")
    d = RRRDyad(left, crank.output, distance1=1.8, distance2=2.6, name="D")
    e = RRRDyad(right, crank.output, distance1=1.8, distance2=2.6, name="E")
    f = FixedDyad(crank.output, e, distance=1.4, angle=-np.pi - 0.2, name="F")
    g = FixedDyad(crank.output, d, distance=1.4, angle=np.pi + 0.2, name="G")
    h = RRRDyad(d, f, distance1=2.5, distance2=1.8, name="H")
    i = RRRDyad(e, g, distance1=2.5, distance2=1.8, name="I")
    linkage = Linkage([a, y, right, left, crank, d, e, f, g, h, i])
    places = [(0, 0), (0, 1), (1.41, 1.41), (-1.41, 1.41), (0, -1), (-2.25, 0), (2.25, 0),
              (-1.4, -1.2), (1.4, -1.2), (-2.7, -2.7), (2.7, -2.7)]  # fmt: skip
    linkage.set_coords(places)
    return linkage


@pytest.mark.parametrize(
    ("linkage", "steps"),
    [
        (EXAMPLE["stroke_engine"](), 63),
        (four_bar(), 8),  # this one and the drag link, until all bars lie on a line
        (four_bar(1.0, 3.5, 3.0, 4.0), 21),
        (four_bar(2.0, 4.0, 3.0, 1.0), 18),
        (strider(), 30),
    ],
    ids=["stroke engine", "parallelogram", "crank-rocker", "drag link", "strider"],
)
def test_the_motion_is_the_same(linkage, steps):
    """With fiftieths of its steps; with whole ones, pylinkage jumps between ways of assembly."""
    list(linkage.step(iterations=1, dt=0.0))
    model = EXAMPLE["mechanism"](linkage)
    expected = np.array(list(linkage.step(iterations=50 * steps, dt=0.02)))[49::50]
    assert np.ptp(expected[:, -1], axis=0).max() > 0.4
    motion = fb.simulate(model, duration=float(steps), step=0.02)
    for k, part in enumerate(linkage.components):
        if part.name in model.bodies:
            names = [f"{part.name}_X", f"{part.name}_Y"]
            positions = motion.sel(output=names).values[:, 50::50]
            np.testing.assert_allclose(positions, expected[:, k].T, rtol=0, atol=1e-9)
