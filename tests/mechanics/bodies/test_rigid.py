"""Rigid bodies: their inertia, their points, and numbers that make no sense."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import flexband as fb
from tests.mechanics.models import block, motion_of


@given(st.floats(0.1, 2.0), st.floats(0.1, 2.0), st.floats(-3.0, 3.0), st.floats(-3.0, 3.0))
def test_polygon_is_a_block_wherever_its_axes_are(a, b, x, y):
    corners = [(x, y), (x + a, y), (x + a, y + b), (x, y + b)]
    block = fb.RigidBody.block(length=a, height=b, width=0.3, density=700.0)
    for vertices in (corners, corners[::-1]):
        plate = fb.RigidBody.polygon(vertices=vertices, width=0.3, density=700.0)
        assert plate.mass == pytest.approx(block.mass)
        assert plate.inertia == pytest.approx(block.inertia, rel=1e-6)
        np.testing.assert_allclose(plate.center, (x + a / 2, y + b / 2), atol=1e-9)


def test_points_are_where_the_axes_put_them_however_the_centre_lies():
    def motion(center, shift):
        points = {"p": (0.3 + shift[0], 0.1 + shift[1]), "pin": shift}
        body = fb.RigidBody(
            mass=1.0, inertia=0.2, center=(center[0] + shift[0], center[1] + shift[1]),
            points=points, angle=0.5,
            position=(-shift[0] * np.cos(0.5) + shift[1] * np.sin(0.5),
                      -shift[0] * np.sin(0.5) - shift[1] * np.cos(0.5)),
        )  # fmt: skip
        return motion_of(
            bodies={"b": body},
            joints={"pin": fb.Revolute("b.pin", (0.0, 0.0))},
            loads={"gravity": fb.Gravity()},
            sensors={"p": fb.Position("b.p")},
        )

    reference = motion((0.2, -0.1), (0.0, 0.0))
    shifted_motion = motion((0.2, -0.1), (0.7, -0.4))
    np.testing.assert_allclose(reference, shifted_motion, atol=1e-9)


@pytest.mark.parametrize(
    ("build", "text"),
    [
        (lambda: fb.PointMass(mass=-1.0), "PointMass mass"),
        (lambda: fb.RigidBody.polygon(vertices=[(0, 0), (1, 0)], width=1, density=1), "3 points"),
        (
            lambda: fb.RigidBody.polygon(vertices=[(0, 0), (1, 0), (2, 0)], width=1, density=1),
            "enclose",
        ),
        (lambda: block(length=0.0), r"block length \[m\] must be positive; got 0"),
        (lambda: block(density=-1.0), "block density"),
        (lambda: block(position=(0.0, np.nan)), "position Y"),
        (lambda: block(length=np.sin), "block length .* must be positive; got a function"),
        (lambda: block(position=1.0), "position must be a pair; got 1.0"),
    ],
)
def test_bad_numbers_are_refused(build, text):
    with pytest.raises(fb.errors.InputError, match=text):
        build()


def star(count, skip, scale=1.0, at=0.0):
    angles = 2 * np.pi * skip * np.arange(count) / count
    return [(at + scale * np.cos(a), at + scale * np.sin(a)) for a in angles]


SQUARE = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
TOUCHING = {
    "pentagram": star(5, 2),
    "small and far away": star(7, 3, scale=1e-6, at=1e3),
    "two squares at a corner": [*SQUARE, (0.0, 0.0), (-1.0, 0.0), (-1.0, -1.0), (0.0, -1.0)],
    "corner on an edge": [(0, 0), (2, 0), (2, 1), (1, 0), (0, 1)],
    "spike": [*SQUARE, (0.0, 1.5)],
    "spike back along its edge": [(0, 0), (2, 0), (1, 0), (1, 1)],
    "twice around": [*SQUARE, *SQUARE],
    "by one unit in the last place": [
        (0.1, 0.1), (0.7, 0.7), (0.7, 1.0), (0.3, np.nextafter(0.3, 0)), (0.1, 0.9)
    ],
    "in one sample of three": [
        (0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (np.array([0.0, 0.5, 0.8]), np.array([1.0, 0.5, -0.5]))
    ],
}  # fmt: skip


@pytest.mark.parametrize("vertices", TOUCHING.values(), ids=TOUCHING)
def test_outlines_that_touch_or_cross_themselves_are_refused(vertices):
    for corners in (vertices, vertices[::-1], vertices[2:] + vertices[:2]):
        with pytest.raises(
            fb.errors.InputError, match=r"must not cross: the edges from vertex|encl"
        ):
            fb.RigidBody.polygon(vertices=corners, width=1.0, density=1.0)


@pytest.mark.parametrize(
    "vertices",
    [
        [*SQUARE, SQUARE[0]],  # closed
        [(0, 0), (0.5, 0), (1, 0), (1, 1), (0.5, 1), (0, 1)],  # corners on straight edges
        [(0, 0), (3, 0), (3, 2), (2, 2), (2, 1), (1, 1), (1, 2), (0, 2)],
        [(1e-140 * x, 1e140 * y) for x, y in SQUARE],
        [(0.1, 0.1), (0.7, 0.7), (0.7, 1.0), (0.3, np.nextafter(0.3, 1)), (0.1, 0.9)],
        star(400, 1),
    ],
)
def test_outlines_that_do_not_touch_themselves_are_not_refused(vertices):
    plate = fb.RigidBody.polygon(vertices=vertices, width=1.0, density=1e-3)
    x, y = np.array(vertices, dtype=float).T
    area = abs(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y)) / 2
    assert plate.mass == pytest.approx(1e-3 * area)


@pytest.mark.filterwarnings("ignore::flexband.errors.FlexbandWarning")
def test_whole_numbers_of_any_size_are_numbers():
    body, float_body = (fb.RigidBody(mass=1, inertia=1, angle=a, rate=a) for a in (10**30, 1e30))
    np.testing.assert_array_equal(body.coordinates(), float_body.coordinates())
    np.testing.assert_array_equal(body.velocities(), float_body.velocities())


TWO = np.ones(2)
THREE = np.ones(3)
RIGID = {"mass": 1.0, "inertia": 1.0}
BLOCK = {"length": 1.0, "height": 1.0, "width": 1.0, "density": 1.0}
CABLE = {"mass_per_length": 1.0, "axial_stiffness": 1.0, "bending_stiffness": 1.0, "elements": 1}


@pytest.mark.parametrize(
    "build",
    [
        lambda: fb.RigidBody(**RIGID | {"mass": TWO, "inertia": THREE}),
        lambda: fb.RigidBody(**RIGID, center=(TWO, 0.0), rate=THREE),
        lambda: fb.RigidBody(**RIGID, points={"p": (TWO, THREE)}),
        lambda: fb.RigidBody.block(**BLOCK | {"length": TWO, "density": THREE}),
        lambda: fb.RigidBody.bar(**BLOCK | {"length": TWO}, angle=THREE),
        lambda: fb.RigidBody.disc(radius=TWO, width=THREE, density=1.0),
        lambda: fb.RigidBody.polygon(
            vertices=[(TWO, 0.0), (2.0, 0.0), (0.0, 1.0)], width=THREE, density=1.0
        ),
        lambda: fb.Cable(length=TWO, start=(THREE, 0.0), **CABLE),
        lambda: fb.Cable(length=TWO, curvature=THREE, **CABLE),
    ],
)
def test_numbers_of_samples_that_differ_are_refused(build):
    with pytest.raises(fb.errors.InputError, match=r"different numbers of samples: \[2, 3\]"):
        build()


def test_short_integers_count_like_others():
    elements = np.int8(60)  # 2 · 60 + … does not fit into eight bits
    assert fb.Cable(length=1.0, **CABLE | {"elements": elements}) == fb.Cable(
        length=1.0, **CABLE | {"elements": 60}
    )
    method = fb.LHSScanning(np.int8(100), np.int8(10))
    assert {type(n) for n in (method.samples, method.points, method.seed)} == {int}
    assert isinstance(fb.PCCI(np.int8(3), {"a": np.uint8(1)}).random_order, int)
