"""Loads, joints and sensors at points of flexible members that are stretched, sheared and bent."""

import numpy as np
import pytest

import flexband as fb
from flexband.mechanics.kernels.forms import Form
from flexband.mechanics.loads.load import Entries
from tests.mechanics.models import FINE

pytestmark = pytest.mark.filterwarnings("ignore::flexband.errors.StrainWarning")

SOFT_CABLE = fb.Cable(
    length=1.0, mass_per_length=1.0, axial_stiffness=500.0, bending_stiffness=1.0, elements=4
)
SOFT_BEAM = fb.Beam(
    length=1.0, height=0.1, width=0.1, density=100.0, youngs_modulus=2e4, poissons_ratio=0.3,
    elements=4,
)  # fmt: skip
TIP = fb.Force("b.end", x=30.0, y=1.0)
SENSORS = {"F": fb.Reaction("clamp"), "M": fb.ReactionMoment("clamp"), "angle": fb.Angle("b.end"),
           "tip": fb.Position("b.end")}  # fmt: skip


def values(result, *outputs):
    """The outputs as numbers, or as series."""
    return [result.sel(output=output).values for output in outputs]


def cantilever(body, load, axis=False, **sensors):
    """A member that is clamped to the ground at the origin, stretched by 6 to 15 %, and a load."""
    return fb.Mechanism(
        bodies={"b": body},
        joints={"clamp": fb.Weld("b.start", (0.0, 0.0), axis=axis)},
        loads={"tip": TIP, "load": load},
        sensors=SENSORS | sensors,
    )


@pytest.mark.parametrize("axis", [False, True])
@pytest.mark.parametrize("body", [SOFT_CABLE, SOFT_BEAM])
def test_a_moment_on_a_stretched_member_is_held_by_the_clamp(body, axis):
    """Statics of the whole: the moments about the clamp vanish."""
    rest = fb.equilibrium(cantilever(body, fb.Moment("b.end", 0.4), axis))
    x, y, M = values(rest, "tip_X", "tip_Y", "M")
    assert x > 1.04
    assert M + 0.4 + x * 1.0 - y * 30.0 == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("point", ["b.end", "b.0.7"])
@pytest.mark.parametrize("body", [SOFT_CABLE, SOFT_BEAM])
def test_a_following_force_keeps_its_size(body, point):
    """The clamp holds a force of 2 N along the section's normal and 0.5 N across."""
    load = fb.Force(point, x=2.0, y=0.5, following=True)
    rest = fb.equilibrium(cantilever(body, load, at=fb.Angle(point)))
    x, y, angle = values(rest, "F_X", "F_Y", "at")
    c = np.cos(angle)
    s = np.sin(angle)
    assert abs(angle) > 0.02
    assert [x, y] == pytest.approx([-30 - 2 * c + 0.5 * s, -1 - 2 * s - 0.5 * c], abs=1e-9)


def test_a_soft_cable_under_a_following_force_has_the_strain_of_the_force():
    """F/EA = 0.2, and half that under half the force."""
    soft = fb.Cable(length=1.0, mass_per_length=1.0, axial_stiffness=10.0, bending_stiffness=1.0,
                    elements=2)  # fmt: skip
    model = fb.Mechanism(
        bodies={"b": soft},
        joints={"clamp": fb.Weld("b.start", (0.0, 0.0))},
        loads={"f": fb.Force("b.end", x=np.array([2.0, 1.0]), following=True)},
        sensors={"tip": fb.Position("b.end")},
    )
    assert fb.equilibrium(model).sel(output="tip_X").values == pytest.approx([1.2, 1.1], abs=1e-9)


@pytest.mark.parametrize("kind", ["drive", "guide"])
def test_reaction_moments_of_drives_and_guides_on_a_stretched_member(kind):
    """A pin holds the force; the moment of a drive or of a guide without friction is the rest."""
    joints = {
        "drive": {"pin": fb.Revolute("b.start", (0.0, 0.0)),
                  "clamp": fb.PrescribedRotation("b.start", lambda t: 0.3)},
        "guide": {"pin": fb.Distance("b.start", (-1.0, 0.0), 1.0),
                  "clamp": fb.Prismatic("b.start", (0.0, 0.0), angle=0.3)},
    }[kind]  # fmt: skip
    cable = fb.Cable(length=1.0, mass_per_length=1.0, axial_stiffness=500.0, bending_stiffness=1.0,
                     elements=4, angle=0.3)  # fmt: skip
    model = fb.Mechanism(
        bodies={"b": cable},
        joints=joints,
        loads={"tip": fb.Force("b.end", x=20.0, y=9.0)},
        sensors={"M": fb.ReactionMoment("clamp"), "tip": fb.Position("b.end")},
    )
    x, y, M = values(fb.equilibrium(model), "tip_X", "tip_Y", "M")
    assert np.hypot(x, y) > 1.03
    assert M + x * 9.0 - y * 20.0 == pytest.approx(0.0, abs=1e-9)


def motion_along(duration=0.3, step=2.5e-4):
    """A mass that is driven along a cable, which swings and is stretched by 20 % and vibrates."""
    return fb.simulate(
        fb.Mechanism(
            bodies={"b": SOFT_CABLE, "m": fb.PointMass(mass=0.5, position=(0.5, 0.0))},
            joints={"pin": fb.Revolute("b.start", (0.0, 0.0)),
                    "drive": fb.PrescribedTravel("m", "b.start", lambda t: 0.5 + t**2)},
            loads={"tip": fb.Force("b.end", x=100.0, y=lambda t: 40.0 * t),
                   "m": fb.Force("m", y=1.0)},
            sensors={"m": fb.Position("m"), "a": fb.Angle("b.start"), "T": fb.KineticEnergy(),
                     "U": fb.ElasticEnergy(), "end": fb.Position("b.end"), "W": fb.Work("drive"),
                     "tip": fb.Work("tip"), "f": fb.Work("m")},
        ),
        duration=duration, step=step, integrator=FINE,
    )  # fmt: skip


def test_travel_along_a_stretched_member_is_measured_in_metres():
    motion = motion_along()
    x, y, a, end = values(motion, "m_X", "m_Y", "a", "end_X")
    np.testing.assert_allclose(
        x * np.cos(a) + y * np.sin(a), 0.5 + motion.time.values**2, atol=1e-10
    )
    assert end.max() > 1.3
    energy = sum(values(motion, "T", "U"))
    np.testing.assert_allclose(
        sum(values(motion, "W", "tip", "f")), energy - energy[0], atol=2e-4 * energy.max()
    )


def push(t, x, v, p, force):
    """A drag, a spring to the first point and a moment that depends on both angles."""
    for axis in range(2):
        force[1, axis] = -p[0] * v[1, axis] - p[1] * (x[1, axis] - x[0, axis])
        force[0, axis] = p[1] * (x[1, axis] - x[0, axis])
    force[1, 2] = p[0] * (1.0 + x[0, 2] - x[1, 2])
    force[0, 2] = -0.1 * v[0, 2]


def test_work_of_laws_friction_moments_and_following_forces_is_what_the_energy_gains():
    loads = {
        "law": fb.ForceLaw(["b.middle", "m"], push, (0.3, 5.0)),
        "drag": fb.ViscousFriction("b.end", (2.0, 0.0), 0.4),
        "M": fb.Moment("b.0.3", lambda t: 2.0 * np.sin(20 * t)),
        "jet": fb.Force("b.end", x=20.0, y=lambda t: 5.0 * t, following=True),
        "wind": fb.Force("m", x=3.0),
    }
    motion = fb.simulate(
        fb.Mechanism(
            bodies={"b": SOFT_CABLE, "m": fb.RigidBody(mass=1.0, inertia=0.1, position=(0.5, 0.3))},
            joints={"pin": fb.Revolute("b.start", (0.0, 0.0))},
            loads=loads,
            sensors={"T": fb.KineticEnergy(), "U": fb.ElasticEnergy()}
            | {name: fb.Work(name) for name in loads},
        ),
        duration=0.5,
        step=5e-4,
        integrator=fb.GeneralizedAlpha(spectral_radius=1.0, tolerance=1e-12),
    )
    energy = sum(values(motion, "T", "U"))
    works = values(motion, *loads)
    assert min(np.abs(work).max() for work in works) > 0.01
    np.testing.assert_allclose(sum(works), energy - energy[0], atol=2e-5 * energy.max())


class Motor:
    """A user's load: a moment on the first angle of the state, that of the torsion spring."""

    points = ("w",)

    def __init__(self, row):
        self.row = row

    def enters(self, model):
        return Entries(forces={self.row: Form.constant(3.0)})


def wheel_with(row):
    """A wheel with a torsion spring; its angle is in row 6 of the state."""
    return fb.Mechanism(
        bodies={"w": fb.RigidBody(mass=1.0, inertia=0.5)},
        loads={"s": fb.TorsionSpring("w", (0.0, 0.0), damping=0.0), "motor": Motor(row)},
        sensors={"angle": fb.Angle("w"), "W": fb.Work("motor")},
    )


def test_a_load_may_act_on_an_angle():
    motion = fb.simulate(wheel_with(6), duration=0.2, step=1e-3)
    angle, work = values(motion, "angle", "W")
    np.testing.assert_allclose(angle, 3.0 * motion.time.values**2, atol=1e-6)
    np.testing.assert_allclose(work, 3.0 * angle, atol=1e-12)


@pytest.mark.parametrize("row", [-1, 0, 5, 8, 99])
def test_a_load_that_acts_on_no_coordinate_is_refused(row):
    with pytest.raises(
        fb.errors.InputError, match=rf"load 'motor': forces must act .* on row {row}$"
    ):
        wheel_with(row)


@pytest.mark.parametrize("member", [SOFT_CABLE, SOFT_BEAM])
@pytest.mark.parametrize(
    "joint",
    [fb.Slot("m", "b.0.4"), fb.Prismatic("m", "b.end"), fb.Rack("m", "b", 0.1)],
)
def test_a_straight_line_on_a_bent_member_is_refused(joint, member):
    bodies = {"b": member, "m": fb.RigidBody(mass=1.0, inertia=1.0)}
    with pytest.raises(
        fb.errors.InputError, match=r"joint 'j': the line of a .* weld a rigid body"
    ):
        fb.Mechanism(bodies=bodies, joints={"j": joint})


@pytest.mark.parametrize("elements", [1, 2, 8])
@pytest.mark.parametrize("kind", ["beam", "cable"])
def test_the_axial_force_of_a_member_that_rotates(kind, elements):
    """½ µ ω² (L² − x²) at the root, in the elements and at the end, within 2e-4 of the largest."""
    mu = 3.12
    modulus = 2e11
    speed = 20.0
    height = 0.02
    options = {"length": 1.0, "elements": elements, "retardation_time": 1e-3}
    bar = (
        fb.Beam(
            height=height, width=height, density=mu / height**2, youngs_modulus=modulus,
            poissons_ratio=0.3, **options,
        )
        if kind == "beam"
        else fb.Cable(
            mass_per_length=mu, axial_stiffness=modulus * height**2,
            bending_stiffness=modulus * height**4 / 12, **options,
        )
    )  # fmt: skip
    places = {"start": 0.0, "0.1": 0.1, "0.3": 0.3, "middle": 0.5, "0.99": 0.99, "end": 1.0}
    way = fb.ramp(to=speed, duration=1.0).integral
    motion = fb.simulate(
        fb.Mechanism(
            bodies={"b": bar},
            joints={
                "o": fb.Revolute("b.start", (0.0, 0.0)),
                "d": fb.PrescribedRotation("b.start", way),
            },
            sensors={place: fb.SectionForces("b", place) for place in places},
        ),
        duration=1.1,
        step=5e-4,
    )
    largest = 0.5 * mu * speed**2
    force = motion.sel(output=[f"{place}_N" for place in places])[:, -1]
    exact = largest * (1 - np.array([*places.values()]) ** 2)
    np.testing.assert_allclose(force, exact, atol=2e-4 * largest)
