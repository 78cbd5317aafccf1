"""What a description counts and names."""

import flexband as fb
from tests.mechanics.models import gears, parallelogram, spring_and_moment


def test_description_counts_degrees_of_freedom_and_names_what_is_redundant():
    text = fb.describe(parallelogram(3))
    assert "1 degrees of freedom" in text
    assert "redundant constraints: 1; forces are not unique at joint 'ground0'" in text
    assert any(line.split() == ["coupler", "RigidBody", "0.8", "4"] for line in text.splitlines())
    assert "crank1.start – (1, 0)" in text
    assert "F0_X [N], F0_Y [N]" in text
    text = fb.describe(parallelogram(2))
    assert "1 degrees of freedom" in text
    assert "redundant" not in text
    beam = fb.Beam(
        length=2.0, height=0.1, width=0.1, density=1000.0, youngs_modulus=1e9, poissons_ratio=0.3,
        elements=2,
    )  # fmt: skip
    cantilever = fb.Mechanism(bodies={"b": beam}, joints={"clamp": fb.Weld("b.start", (0.0, 0.0))})
    assert "18 coordinates, 3 constraints (including those of rigidity), 15 degrees" in fb.describe(
        cantilever
    )
    assert any(
        line.split() == ["b", "Beam", "20", "18"] for line in fb.describe(cantilever).splitlines()
    )


def test_descriptions_name_the_points_of_laws_and_gears():
    bodies, joints = gears((0.1, 0.2), (0.4, 0.3))
    law = fb.ForceLaw(["1", (0.3, 0.2)], spring_and_moment, (4.0, 0.01))
    text = fb.describe(fb.Mechanism(bodies=bodies, joints=joints, loads={"l": law}))
    assert "1 – 2" in text
    assert "1 – (0.3, 0.2)" in text
    assert "1 degrees of freedom" in text
