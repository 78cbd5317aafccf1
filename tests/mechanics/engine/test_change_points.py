"""Plates on more parallel cranks than needed, through the position with all pivots in line."""

import numpy as np
import pytest

import flexband as fb

PIVOTS = (0.0, 0.7, 2.0)
MIDDLE = 0.8
MASS = 5.0
RATE = 4.0
CRANK = {"length": 1.0, "height": 0.02, "width": 0.02, "rate": RATE}


def plate_on_cranks(angle, density):
    """A plate on three cranks from this angle at constant rate; all are in line at 0."""
    points = {f"p{k}": (x - MIDDLE, 0.0) for k, x in enumerate(PIVOTS)}
    place = MIDDLE + np.cos(angle), np.sin(angle)
    bodies = {"plate": fb.RigidBody(mass=MASS, inertia=2.0, position=place, points=points)}
    joints = {"motor": fb.PrescribedRotation("c0", lambda t: angle + RATE * t)}
    for k, x in enumerate(PIVOTS):
        bodies[f"c{k}"] = fb.RigidBody.bar(start=(x, 0.0), angle=angle, density=density, **CRANK)
        joints[f"foot{k}"] = fb.Revolute(f"c{k}.start", (x, 0.0))
        joints[f"top{k}"] = fb.Revolute(f"plate.p{k}", f"c{k}.end")
    sensors = {f"R{k}": fb.Reaction(f"top{k}") for k in range(3)} | {"plate": fb.Angle("plate")}
    return fb.Mechanism(bodies=bodies, joints=joints, loads={"g": fb.Gravity()}, sensors=sensors)


@pytest.mark.parametrize("density", [10.0, 100.0, 3000.0])
@pytest.mark.parametrize("nearest", [1.8e-3, 2e-3])
def test_reactions_next_to_the_change_point_move_the_plate(density, nearest):
    """They add up to m (r̈ − g), without a moment: the plate moves on a circle and does not turn."""
    start = nearest - 0.3  # 4e-3 rad per step
    motion = fb.simulate(plate_on_cranks(start, density), duration=0.15, step=1e-3)
    angle = start + RATE * motion.time.values
    forces = np.array([[motion.sel(output=f"R{k}_{axis}") for axis in "XY"] for k in range(3)])
    accelerations = [-(RATE**2) * np.cos(angle), 9.81 - RATE**2 * np.sin(angle)]
    size = 9.81 * MASS
    np.testing.assert_allclose(
        np.abs(forces.sum(axis=0)), MASS * np.abs(accelerations), atol=1e-3 * size
    )
    moment = np.sum(
        [(x - MIDDLE) * force[1] for x, force in zip(PIVOTS, forces, strict=True)], axis=0
    )
    np.testing.assert_allclose(moment, 0.0, atol=1e-3 * size)
    np.testing.assert_allclose(motion.sel(output="plate"), 0.0, atol=1e-7)


def test_reactions_at_the_change_point_are_warned_of():
    """A step ends 1e-8 rad from it, where the cranks would have to carry 1e9 N."""
    model = plate_on_cranks(1e-8 - 0.3, 30.0)
    with pytest.warns(
        fb.errors.ResolutionWarning, match="at t = 0.075 s .* more of its constraints"
    ):
        fb.simulate(model, duration=0.1, step=1e-3)
