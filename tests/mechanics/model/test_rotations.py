"""Turns in the plane and in space, against NumPy and SciPy."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from flexband.mechanics.model.rotations import PLANES, rotation, spin, turn_between, wedge


def test_a_wedge_is_the_cross_product():
    a, b = np.random.default_rng(0).normal(size=(2, 3, 5))
    np.testing.assert_allclose(wedge(a, b), np.cross(a, b, axis=0), atol=1e-15)
    np.testing.assert_allclose(wedge(a[:2], b[:2])[0], a[0] * b[1] - a[1] * b[0], atol=1e-15)


@pytest.mark.parametrize("components", [2, 3])
def test_turns_axes_and_spins_belong_together(components):
    """A small turn by δ moves g by δ × g; axes that turned by φ tell φ, whatever their lengths."""
    rng = np.random.default_rng(components)
    turn = rng.normal(size=(len(PLANES[components]), 4))
    axes = rotation(turn).transpose(1, 0, 2)[: 1 if components == 2 else 3]
    size = np.linalg.norm(turn, axis=0)
    unit_axes = np.broadcast_to(np.eye(components)[: len(axes), :, None], axes.shape)
    np.testing.assert_allclose(
        turn_between(unit_axes, axes), np.pi - np.abs(size % (2 * np.pi) - np.pi), rtol=1e-12
    )
    small = rotation(1e-7 * turn)
    rates = (np.einsum("ijs,ajs->ais", small, axes) - axes) / 1e-7
    np.testing.assert_allclose(spin(axes, rates), turn, rtol=1e-5, atol=1e-6)


def test_a_rotation_of_space_is_that_of_its_vector():
    turn = np.array([[0.3], [-1.2], [0.7]])
    np.testing.assert_allclose(
        rotation(turn)[:, :, 0], Rotation.from_rotvec(turn[:, 0]).as_matrix()
    )
