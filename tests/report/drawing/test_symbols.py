"""Symbols of gears, racks, torsion springs, friction and force laws, read back from figures."""

import numpy as np
import pytest

import flexband as fb
from tests.report.drawing.test_drawing import part, texts, turn

SPUR = {"width": 0.02, "density": 7800.0}
SUN = 0.1
PLANET = 0.05
CENTRE = (SUN + PLANET) * np.array([0.6, 0.8])


def distances(line, place):
    """Return the distances [m] of the points of a line from a place, without its gaps."""
    return np.linalg.norm(line[np.isfinite(line).all(axis=1)] - place, axis=1)


def planet():
    arm = fb.RigidBody.bar(length=SUN + PLANET, height=0.01, angle=np.arctan2(0.8, 0.6), **SPUR)
    return fb.Mechanism(
        bodies={
            "sun": fb.RigidBody.disc(radius=SUN, **SPUR),
            "planet": fb.RigidBody.disc(radius=PLANET, position=tuple(CENTRE), **SPUR),
            "arm": arm,
        },
        joints={
            "O": fb.Revolute("sun", (0.0, 0.0)),
            "A": fb.Revolute("arm.start", (0.0, 0.0)),
            "B": fb.Revolute("planet", "arm.end"),
            "inner": fb.Gear("sun", "planet", SUN, PLANET),
            "outer": fb.Gear("planet", (0.0, 0.0), PLANET, -(SUN + 2 * PLANET)),
        },
    )


def test_pitch_circles_of_gears_touch():
    figure = fb.draw(planet())
    for joint, touch in (("inner", SUN), ("outer", SUN + 2 * PLANET)):
        line = part(figure, f"joint {joint!r}")
        assert distances(line, touch * CENTRE / (SUN + PLANET)).min() < 0.003
        np.testing.assert_allclose(distances(line, CENTRE).min(), PLANET, rtol=0.2)  # minus a tooth
    inner, outer = (part(figure, f"joint {joint!r}") for joint in ("inner", "outer"))
    np.testing.assert_allclose(distances(inner[:181], (0.0, 0.0)), SUN)
    ring = SUN + 2 * PLANET
    radii = distances(outer, (0.0, 0.0))
    assert ring * 1.001 < radii.max() < 1.2 * ring  # the teeth of a ring are outside
    low, high = np.sort(
        np.transpose([figure.axes[0].get_xlim(), figure.axes[0].get_ylim()]), axis=0
    )
    assert np.all(low < -ring)
    assert np.all(high > ring)
    assert {"inner", "outer"} <= set(texts(figure))
    with pytest.raises(ValueError, match="not enough values"):
        part(figure, "body 'sun'")  # the gear shows its size


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_rack_touches_its_pinion_and_is_as_long_as_its_body(side):
    rack = fb.RigidBody.bar(length=0.8, height=0.02, start=(-0.3, 0.0), **SPUR)
    pinion = fb.RigidBody.disc(radius=0.1, position=(0.0, side * 0.1), **SPUR)
    figure = fb.draw(
        fb.Mechanism(
            bodies={"pinion": pinion, "rack": rack},
            joints={"mesh": fb.Rack("pinion", "rack", side * 0.1)},
        )
    )
    line = part(figure, "joint 'mesh'")
    np.testing.assert_allclose(line[:2], [(-0.3, 0.0), (0.5, 0.0)], atol=1e-9)
    heights = line[np.isfinite(line).all(axis=1), 1] * side
    assert heights.max() < 1e-12  # teeth on the far side
    assert heights.min() < -1e-3
    pinion = part(figure, "pinion of joint 'mesh'")[:181]
    np.testing.assert_allclose(distances(pinion, (0, side * 0.1)), 0.1)


@pytest.mark.parametrize(
    ("kind", "turns"),
    [({"stiffness": 2.0}, 2.25), ({"damping": 1.0}, None), ({"torque": -3.0}, -0.75)],
)
def test_torsion_springs_surround_their_pin(kind, turns):
    bar = fb.RigidBody.bar(length=1.0, height=0.01, start=(0.2, 0.3), **SPUR)
    spring = fb.TorsionSpring("bar.start", (0.2, 0.3), **kind)
    figure = fb.draw(fb.Mechanism(bodies={"bar": bar}, loads={"twist": spring}))
    line = part(figure, "load 'twist'")
    distance = distances(line, (0.2, 0.3))
    assert 0.0 < distance.min() < distance.max() < 0.1
    if turns is None:  # a dashpot on an arc
        assert np.isnan(line).any()
    else:
        revolutions = turn(line[np.isfinite(line).all(axis=1)], (0.2, 0.3)) / (2 * np.pi)
        np.testing.assert_allclose(revolutions, turns, rtol=0.1)
    assert "twist" in texts(figure)


def test_friction_is_a_dashpot_between_its_points():
    mass = fb.PointMass(mass=1.0, position=(1.0, 0.5))
    friction = fb.ViscousFriction("m", (0.0, 0.0), 3.0)
    line = part(fb.draw(fb.Mechanism(bodies={"m": mass}, loads={"f": friction})), "load 'f'")
    np.testing.assert_allclose(line[[0, -1]], [(1.0, 0.5), (0.0, 0.0)], atol=1e-9)
    assert np.ptp((line @ (-0.5, 1.0))[np.isfinite(line).all(axis=1)]) > 0.01  # its cylinder


def pull(t, x, v, p, force):
    force[0, 0] = p[0] * (x[1, 0] - x[0, 0])


def test_a_force_law_is_a_symbol_at_or_between_its_points():
    mass = fb.PointMass(mass=1.0, position=(1.0, 0.5))

    def sign(points):
        law = fb.ForceLaw(points, pull, [1.0])
        figure = fb.draw(fb.Mechanism(bodies={"m": mass}, loads={"magnet": law}))
        assert "magnet" in texts(figure)
        assert not any(text.startswith("without a place") for text in texts(figure))
        return part(figure, "load 'magnet'")

    np.testing.assert_allclose(sign(["m", (0.0, 0.0)]), [(0.5, 0.25)], atol=1e-9)
    assert 0.0 < distances(sign(["m", (1.0, 0.5)]), (1.0, 0.5))[0] < 1.0
