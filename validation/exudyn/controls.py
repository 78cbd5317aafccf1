"""Nets of springs, bushings, hydraulics and control."""

from __future__ import annotations

import numpy as np
from pendulums import GRAVITY, bar, chain, crank_pins
from rebuilt import at_end, register_script

import flexband as fb


def bushing(first, second, stiffness, damping):
    """Return a spring and damper with the same numbers in both directions."""
    return fb.loads.Bushing(
        first, second, stiffness=(stiffness, stiffness, 0.0), damping=(damping, damping, 0.0)
    )


@register_script(
    "TestModels/rigidBody2Dtest.py",
    "angle after 0.4 s [rad]",
    exudyn=-1.12557332,
    tolerance=1e-6,
    value=9.81,
)
def pendulum_on_springs(gravity):
    model = fb.Mechanism(
        bodies={"b": bar(1.0, 12.0, position=(-0.5, 1.0))},
        loads={
            "gravity": fb.Gravity(y=-gravity),
            "pin": bushing("b.a", (-1.0, 1.0), 5e5, 5e3),
        },
        sensors={"angle": fb.Angle("b")},
    )
    return at_end(model, 0.4, 1e-4)


@register_script(
    "Examples/lavalRotor2Dtest.py",
    "displacement x after 2 s [m]",
    exudyn=2.146309e-3,
    tolerance=2e-7,
    value=0.5,
)
def laval_rotor(radius_of_gyration):
    critical, eccentricity = np.sqrt(4000.0 / 1.6), 0.01
    rotor = fb.RigidBody(
        mass=1.6,
        inertia=1.6 * radius_of_gyration**2,
        rate=critical / 2,
        position=(0.0, eccentricity),
        points={"axis": (0.0, -eccentricity)},
    )
    damping = 2 * critical * 0.005 * 1.6
    model = fb.Mechanism(
        bodies={"rotor": rotor},
        loads={"shaft": bushing("rotor.axis", (0.0, 0.0), 4000.0, damping)},
        sensors={"x": fb.Position("rotor")},
    )
    return at_end(model, 2.0, 5e-5)[..., 0]


def scissors(length, pin):
    """Return three pairs of crossed bars; `pin` joins two points."""
    size = 3
    bodies = {"D": fb.RigidBody(mass=1.0, inertia=1.0, angle=np.pi / 4)}
    loads = {
        "gravity": fb.Gravity(y=-0.981),
        "D": bushing("D", (0.0, 0.0), 1e4, 1e2),
        "V0": fb.TorsionSpring("V0", stiffness=1e4, rest_angle=np.pi / 4, damping=1e4),
    }
    joints = {"H0": fb.PrescribedRotation("H0", lambda t: 0.0 * t)}
    pins = [("H0", (0.0, 0.0)), ("V0", (0.0, 0.0))]
    for k in range(size):
        for name, angle in ((f"H{k}", 0.0), (f"V{k}", np.pi / 2)):
            place = (k * length, k * length)
            bodies[name] = bar(2 * length, 1.0, 1.0, position=place, angle=angle)
        if k:
            joints[f"D{k}"] = fb.Slot(f"V{k}", "D")
            pins += [(f"H{k}", f"V{k}"), (f"H{k}.a", f"V{k - 1}.b"), (f"V{k}.a", f"H{k - 1}.b")]
    for k, (first, second) in enumerate(pins):
        part = pin(first, second)
        (loads if isinstance(part, fb.loads.Bushing) else joints)[f"pin {k}"] = part
    return fb.Mechanism(bodies=bodies, joints=joints, loads=loads, sensors={"r": fb.Position("V2")})


@register_script(
    "TestModels/scissorPrismaticRevolute2D.py",
    "y of the last bar after 10 s, on pins [m]",
    exudyn=1.13103412,
    tolerance=1e-6,
    value=0.8,
)
def scissors_on_pins(length):
    return at_end(scissors(length, fb.Revolute), 10.0, 2e-3)[..., 1]


@register_script(
    "TestModels/scissorPrismaticRevolute2D.py",
    "y of the last bar after 10 s, on springs [m]",
    exudyn=1.12465890,
    tolerance=1e-6,
    value=0.8,
)
def scissors_on_springs(length):
    def pin(first, second):
        return bushing(first, second, 1e4, 1e2)

    return at_end(scissors(length, pin), 10.0, 2e-3)[..., 1]


@register_script(
    "TestModels/sliderCrankFloatingTest.py",
    "x of the sliders after 0.3 s, on a fixed and a sprung frame [m]",
    exudyn=0.591649158,
    tolerance=1e-6,
    value=0.1,
)
def slider_crank_on_a_frame(torque):
    def x(frame, bodies, loads):
        slider = fb.RigidBody(mass=0.4, inertia=4e-4, position=(0.4, 0.0))
        model = fb.Mechanism(
            bodies={
                "crank": bar(0.1, 0.2, position=(0.05, 0.0)),
                "rod": bar(0.3, 0.2, position=(0.25, 0.0)),
                "slider": slider,
            }
            | bodies,
            joints=crank_pins(frame) | {"guide": fb.Prismatic("slider", frame)},
            loads={"torque": fb.Moment("crank", torque)} | loads,
            sensors={"x": fb.Position("slider")},
        )
        return at_end(model, 0.3, 2e-5)[..., 0]

    mounts = {
        "mounts": bushing("frame", (0.0, 0.0), 5e3, 50.0),
        "turn": fb.TorsionSpring("frame", stiffness=5e3, damping=50.0),
    }
    return x((0.0, 0.0), {}, {}) + x(
        "frame", {"frame": fb.RigidBody(mass=2.0, inertia=1.0)}, mounts
    )


def lattice(columns, rows, stiffness, joints):
    """Return the height of the lowest right point of a hanging net of springs."""

    def name(i, j):
        return f"{i} {j}" if i else (0.0, float(j))

    bodies = {
        name(i, j): fb.PointMass(mass=10.0, position=(float(i), float(j)))
        for j in range(rows)
        for i in range(1, columns)
    }
    loads = {f"F {point}": fb.Force(point, y=-0.025) for point in bodies}
    for j in range(rows):
        for i in range(columns):
            for column, row, length in ((i + 1, j, 1.0), (i, j + 1, 1.0), (i + 1, j + 1, 2**0.5)):
                if column < columns and row < rows and column:
                    spring = fb.Spring(
                        name(i, j), name(column, row), stiffness, length, damping=10.0
                    )
                    loads[f"{i} {j} {column} {row}"] = spring
    sensors = {"r": fb.Position(name(columns - 1, 0))}
    model = fb.Mechanism(bodies=bodies, joints=joints, loads=loads, sensors=sensors)
    return fb.equilibrium(model, steps=1).sel(output="r_Y").values


@register_script(
    "Examples/SpringDamperMassUserFunction.py",
    "y of the lowest right point at rest [m]",
    exudyn=-0.35097115,
    tolerance=1e-7,
    value=4000.0,
)
def net_of_springs(stiffness):
    return lattice(24, 3, stiffness, {})


def valve(t, x, v, s, p, force, rate):
    """Push two points apart by the pressures s of a cylinder that follows a target length."""
    area, stiffness, flow, supply, damping = p[0], p[1], p[2], p[3], p[4]
    target = p[5] + p[6] * (max(0.5, min(1.5, 1.0 - np.cos(p[7] * t))) - 0.5)
    opening = 2.0 * (target - x[2, 0])
    for side in range(2):
        drop = supply - s[side] if opening >= 0.0 else s[side]
        sense = 1.0 - 2.0 * side
        through = opening * flow * np.sign(drop) * np.sqrt(abs(drop))
        rate[side] = stiffness * (through - sense * area * v[2, 0])
        opening = -opening
    force[2, 0] = area * (s[0] - s[1]) - damping * v[2, 0]


def cylinder(points, length, travel, bulk=1e11, frequency=np.pi, pressures=(2e6, 2e6), area=0.01):
    parameters = (area, bulk, 2e-5, 2e7, 2e5, length, travel, frequency)
    return fb.ForceLaw(
        list(points),
        valve,
        parameters,
        between=[(0, 1)],
        states=dict(zip("ab", pressures, strict=True)),
    )


def raised_arm(**parts):
    """Return an arm of 1 m and 120 kg, held in front of its pin by what is given."""
    points = {"pin": (-0.5, 0.0), "eye": (-0.25, 0.0)}
    arm = fb.RigidBody(mass=120.0, inertia=10.0, position=(0.5, 0.0), points=points)
    pin = {"pin": fb.Revolute("arm.pin", (0.0, 0.0))}
    base_parts = {
        "bodies": {"arm": arm},
        "joints": pin,
        "loads": GRAVITY,
        "sensors": {"turn": fb.Angle("arm")},
    }
    return fb.Mechanism(**{name: base_parts[name] | parts.get(name, {}) for name in base_parts})


EYES, RELAXED = ("arm.eye", (0.0, -0.25)), 0.25 * 2**0.5


@register_script(
    "TestModels/hydraulicActuatorSimpleTest.py",
    "angle after 0.4 s [rad]",
    exudyn=0.02458428,
    tolerance=1e-6,
    value=0.01,
)
def hydraulic_arm(area):
    oil = cylinder(EYES, RELAXED, 0.1, area=area)
    return at_end(raised_arm(loads={"oil": oil}), 0.4, 2e-4)


@register_script(
    "Examples/HydraulicsUserFunction.py",
    "pressure of the lower chamber after 0.4 s [Pa]",
    exudyn=6.416815e6,
    tolerance=1e3,
    value=0.01,
)
def hydraulics_as_user_functions(area):
    oil = cylinder(EYES, RELAXED, 0.1, area=area)
    model = raised_arm(loads={"oil": oil}, sensors={"a": fb.LawState("oil", "a", "Pa")})
    return at_end(model, 0.4, 4e-4)[..., 1]


@register_script(
    "Examples/HydraulicActuatorStaticInitialization.py",
    "angle after 1 s [rad]",
    exudyn=0.69902209,
    tolerance=1e-6,
    value=0.1,
)
def hydraulic_arm_from_rest(travel):
    rest = raised_arm(
        joints={"hold": fb.Distance(*EYES, RELAXED)}, sensors={"hold": fb.Reaction("hold")}
    )
    reaction = fb.equilibrium(rest, steps=1).sel(output=["hold_X", "hold_Y"]).values
    force = np.hypot(reaction[..., 0], reaction[..., 1])
    oil = cylinder(EYES, RELAXED, travel, pressures=(2e6 + force / 0.01, 2e6))
    return at_end(raised_arm(loads={"oil": oil}), 1.0, 5e-4)


@register_script(
    "Examples/HydraulicActuator2Arms.py",
    "angle of the second arm after 0.5 s, from its start [rad]",
    exudyn=1.20650876,
    tolerance=2e-5,
    value=0.15,
)
def two_hydraulic_arms(travel):
    points = {"a": (-0.5, 0.0), "b": (0.5, 0.0), "back": (-0.25, -0.05), "front": (0.25, -0.05)}
    body = {"mass": 120.0, "inertia": 10.0, "points": points}
    first = cylinder(("arm.back", (0.0, -0.3)), RELAXED, travel, bulk=1e12)
    second = cylinder(("hand.back", "arm.front"), 0.2 * 2**0.5, 0.2, bulk=1e12, frequency=2 * np.pi)
    model = fb.Mechanism(
        bodies={
            "arm": fb.RigidBody(**body, position=(0.5, 0.0)),
            "hand": fb.RigidBody(**body, position=(1.0, -0.5), angle=-np.pi / 2),
        },
        joints={"pin": fb.Revolute("arm.a", (0.0, 0.0)), "elbow": fb.Revolute("hand.a", "arm.b")},
        loads=GRAVITY | {"first": first, "second": second},
        sensors={"angle": fb.Angle("hand")},
    )
    return at_end(model, 0.5, 5e-4) + np.pi / 2


@register_script(
    "TestModels/doublePendulum2DControl.py",
    "sum of both angles after 5 s [rad]",
    exudyn=1.56877679,
    tolerance=1e-6,
    value=np.pi / 2,
)
def controlled_double_pendulum(amplitude):
    def motor(first, second, stiffness, sense):
        def torque(t):
            turn, speed = np.sin(np.pi * t / 2), 0.5 * np.cos(np.pi * t / 2)
            return sense * amplitude * stiffness * (turn + 0.02 * speed)

        return fb.TorsionSpring(
            first, second, stiffness, 0.0, damping=0.02 * stiffness, torque=torque
        )

    bodies, joints = chain(2, 1.0)
    model = fb.Mechanism(
        bodies=bodies,
        joints=joints,
        loads=GRAVITY | {"0": motor("0", (0.0, 0.0), 5e5, 1.0), "1": motor("1", "0", 5e3, -1.0)},
        sensors={"0": fb.Angle("0"), "1": fb.Angle("1")},
    )
    return at_end(model, 5.0, 5e-4).sum(-1)
