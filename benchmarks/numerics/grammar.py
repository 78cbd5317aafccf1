"""Mechanisms drawn from a grammar of all parts, of which every call must return or refuse.

Each seed draws up to four bodies (rigid, point masses, beams, cables) with joints, drives, loads,
contacts, friction, clutches, switches and states between random points, sensible or not. They are
simulated for a few steps, with given and with chosen steps, and statics and modes are asked for.
What is raised must be an error of flexband, and what is returned must be finite numbers.

    python -m benchmarks.numerics.grammar --seed 1 --samples 3000

goes on where it was stopped.
"""

from __future__ import annotations

import signal
import traceback
import warnings
from collections import Counter
from collections.abc import Callable
from typing import Any

import numpy as np

import flexband as fb
from benchmarks.harness import options, report
from benchmarks.honesty.contact_claims import judge_cases

STEEL = {"density": 7800.0, "youngs_modulus": 2e11, "poissons_ratio": 0.3}
LAW = fb.contact.KeepsRestitution(stiffness=1e6, restitution=0.5)
SECONDS = 20
"""After which a call is given up, and counted as slow."""


def relaxation(t, x, v, s, p, force, rate):
    """Fill in a force along x that follows the place with a time constant."""
    rate[0] = (x[0, 0] - s[0]) / p[0]
    force[0, 0] = -p[1] * s[0]


def attraction(t, x, v, p, force):
    """Fill in a force towards the second point."""
    force[0, 0] = p[0] * (x[1, 0] - x[0, 0])
    force[0, 1] = p[0] * (x[1, 1] - x[0, 1])
    force[1, 0], force[1, 1] = -force[0, 0], -force[0, 1]


class Grammar:
    """Draws the parts of one mechanism."""

    def __init__(self, seed: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.bodies: dict[str, Any] = {}
        self.joints: dict[str, Any] = {}
        self.loads: dict[str, Any] = {}
        self.points: list[str] = []

    def chance(self, share: float) -> bool:
        return bool(self.rng.random() < share)

    def pick(self, choices: list) -> Any:
        return choices[self.rng.integers(len(choices))]

    def grid_place(self) -> tuple[float, float]:
        """Return a place on a coarse grid, so that some coincide."""
        x, y = self.rng.integers(-2, 3, 2) * 0.25
        return float(x), float(y)

    def angle(self) -> float:
        return self.pick([0.0, np.pi / 2, np.pi, -np.pi, float(self.rng.uniform(-7, 7))])

    def body(self, name: str) -> None:
        kind = self.pick(["rigid", "rigid", "point", "beam", "cable"])
        size = float(self.rng.choice([0.25, 0.5, 1.0]))
        place = self.grid_place()
        angle = self.angle()
        match kind:
            case "rigid":
                ends = {"start": (-size / 2, 0.0), "end": (size / 2, 0.0)}
                mass = self.pick([1.0, 1.0, 1.0, 0.0])
                self.bodies[name] = fb.RigidBody(
                    mass=mass, inertia=0.1 * mass * size, points=ends, position=place,
                    angle=angle, rate=self.pick([0.0, 3.0]),
                )  # fmt: skip
                self.points += [name, f"{name}.start", f"{name}.end"]
            case "point":
                velocity = self.pick([(0.0, 0.0), (1.0, -0.5)])
                mass = self.pick([1.0, 1.0, 0.0])
                self.bodies[name] = fb.PointMass(mass=mass, position=place, velocity=velocity)
                self.points += [name]
            case "beam":
                self.bodies[name] = fb.Beam(
                    length=size, height=0.02, width=0.02, elements=self.pick([1, 2]), start=place,
                    angle=angle, curvature=self.pick([0.0, 0.0, 1.5]), **STEEL,
                )  # fmt: skip
                self.points += [f"{name}.start", f"{name}.0.5", f"{name}.end"]
            case _:
                self.bodies[name] = fb.Cable(
                    length=size, mass_per_length=0.5, axial_stiffness=1e4, bending_stiffness=0.1,
                    elements=self.pick([1, 2, 3]), start=place, angle=angle,
                )  # fmt: skip
                self.points += [f"{name}.start", f"{name}.middle", f"{name}.end"]

    def pair(self) -> tuple[Any, Any]:
        first = self.pick(self.points)
        return first, self.grid_place() if self.chance(0.5) else self.pick(self.points)

    def function(self, scale: float = 1.0) -> Callable:
        return self.pick([
            lambda t: scale * np.sin(5.0 * t),
            fb.ramp(to=scale, duration=0.05).integral,
            fb.table([0.0, 0.02, 1.0], [0.0, 0.01 * scale, 0.2 * scale]),
        ])  # fmt: skip

    def joint(self) -> Any:
        first, second = self.pair()
        friction_options = {
            "friction": self.pick([0.0, 0.2, fb.contact.Coulomb(kinetic=0.2, static=0.3)])
        }
        friction_options = friction_options if self.chance(0.3) else {}
        axis = self.pick([(1.0, 0.0), (0.0, 1.0), (1.0, 1.0)])
        angle = self.angle()
        length = self.pick([0.5, 0.7, lambda t: 0.5 + 0.01 * np.sin(9.0 * t)])
        clearance_options = {"clearance": self.pick([1e-4, 0.3]), "law": LAW, "radius": 0.02}
        kinds = [
            lambda: fb.Revolute(
                first, second, radius=0.01 if friction_options else 0.0, **friction_options
            ),
            lambda: fb.Revolute(first, second),
            lambda: fb.Revolute(first, second, **clearance_options, **friction_options),
            lambda: fb.Prismatic(first, second, axis=axis, angle=angle, **friction_options),
            lambda: fb.Slot(first, second, axis=axis, **friction_options),
            lambda: fb.Weld(first, second, angle=angle, axis=self.chance(0.2)),
            lambda: fb.Distance(first, second, length),
            lambda: fb.Gear(
                first, second, 0.25, self.pick([0.25, -0.1]), 0.9 if friction_options else 1.0
            ),
            lambda: fb.PrescribedRotation(first, second, self.function()),
            lambda: fb.PrescribedTravel(first, second, self.function(0.1), axis=axis),
            lambda: fb.Rack(first, second, 0.25, axis=axis),
            lambda: fb.PrescribedPath(first, self.function(0.1), self.function(0.1)),
        ]
        return self.pick(kinds)()

    def load(self) -> Any:
        (first, second), contact = self.pair(), fb.contact
        friction_options = {"friction": self.pick([None, 0.0, 0.3])}
        closed = self.chance(0.3)
        floor = contact.CircleOnLine(radius=self.pick([0.0, 0.05]))
        circles = contact.CircleOnCircle(radii=(0.05, 0.1))
        upper = self.pick([None, 0.3])
        time = self.function()
        kinds = [
            lambda: fb.Spring(first, second, 100.0, self.pick([None, 0.0, 0.4]), damping=0.5),
            lambda: fb.TorsionSpring(first, second, 5.0, self.pick([None, 0.3])),
            lambda: fb.Force(first, self.pick([2.0, time]), 1.0, following=self.chance(0.3)),
            lambda: fb.Moment(first, self.pick([0.2, time])),
            lambda: contact.Contact(first, second, floor, LAW, closed, **friction_options),
            lambda: contact.Contact(first, second, circles, LAW, closed, **friction_options),
            lambda: contact.Stop(
                first, second, LAW, -0.3, upper, closed_at_start=closed, **friction_options
            ),
            lambda: contact.AngularStop(first, second, LAW, lower=-1.0, upper=1.0),
            lambda: contact.Brake(first, second, 0.3, 0.1, self.pick([0.0, 5.0, abs_sine])),
            lambda: contact.Clutch(first, second, 0.3, 0.1, self.pick([0.0, 5.0])),
            lambda: contact.OneWayClutch(first, second, self.pick([1, -1])),
            lambda: contact.LuGre(first, second, 1.0, 1.5, 1e4, 100.0),
            lambda: fb.ForceLaw([first], relaxation, [0.01, 50.0], states={"s": 0.0}),
            lambda: fb.ForceLaw([first, second], attraction, [20.0]),
            lambda: fb.loads.Bushing(first, second, (1e3, 1e3, 5.0), (1.0, 1.0, 0.01)),
            lambda: fb.ViscousFriction(first, second, 1.0),
        ]
        return self.pick(kinds)()

    def sensor(self) -> Any:
        point = self.pick(self.points)
        loads = list(self.loads) or ["none"]
        joints = list(self.joints) or ["none"]
        kinds = [
            fb.Position(point), fb.Angle(point), fb.AngularVelocity(point), fb.KineticEnergy(),
            fb.Acceleration(point), fb.Work(self.pick(loads)), fb.sensors.Power(self.pick(joints)),
            fb.Reaction(self.pick(joints)), fb.ReactionMoment(self.pick(joints)),
            fb.contact.Contacts(self.pick(loads), first=0),
            fb.contact.FrictionForce(self.pick(joints)),
            fb.sensors.Largest(fb.Angle(point)), fb.ElasticEnergy(),
            fb.sensors.Largest(fb.Reaction(self.pick(joints))),
        ]  # fmt: skip
        return self.pick(kinds)

    def mechanism(self) -> fb.Mechanism:
        for k in range(self.rng.integers(1, 5)):
            self.body(f"b{k}")
        kinds = {"joints": self.joint, "loads": self.load}
        for kind, draw in kinds.items():
            parts = getattr(self, kind)
            for k in range(self.rng.integers(0, 5)):
                with_errors(lambda draw=draw, parts=parts, k=k, kind=kind: self.add(
                    parts, f"{kind[0]}{k}", draw()))  # fmt: skip
        if self.chance(0.7):
            self.loads["gravity"] = fb.Gravity()
        if self.joints and self.chance(0.2):
            name = self.pick(list(self.joints))
            time = self.pick([0.0, 0.03])
            make_switched = lambda: fb.contact.Switched(self.joints[name], lambda t: t >= time)  # noqa: E731
            with_errors(lambda: self.add(self.joints, name, make_switched()))
        sensors: dict[str, Any] = {"p": fb.Position(self.pick(self.points))}
        for k in range(self.rng.integers(0, 3)):
            sensor = self.sensor()
            trial = {**sensors, f"s{k}": sensor}
            if with_errors(lambda trial=trial: self.build(trial)):
                sensors = trial
        return self.build(sensors)

    def build(self, sensors: dict[str, Any]) -> fb.Mechanism:
        return fb.Mechanism(
            bodies=self.bodies, joints=self.joints, loads=self.loads, sensors=sensors
        )

    def add(self, parts: dict[str, Any], name: str, part: Any) -> None:
        """Add a part, unless the mechanism refuses it."""
        previous_part = parts.get(name)
        parts[name] = part
        try:
            self.build({})
        except fb.errors.InputError:
            del parts[name]
            if previous_part is not None:
                parts[name] = previous_part


def abs_sine(t):
    """Return a force that changes."""
    return 5.0 * np.abs(np.sin(7.0 * t))


def with_errors(call: Callable[[], Any]) -> Any:
    """Return what a call returns, or None if flexband refuses it."""
    try:
        return call()
    except (fb.errors.InputError, fb.errors.RunError):
        return None


class SlowError(Exception):
    """A call takes too long."""


def _stop(*_: object) -> None:
    raise SlowError


def outcome(call: Callable[[], Any]) -> str:
    """Return what becomes of a call: "returned", "refused", or what is wrong."""
    signal.signal(signal.SIGALRM, _stop)
    signal.alarm(SECONDS)
    try:
        values = call()
    except (fb.errors.InputError, fb.errors.RunError) as error:
        return "refused: " + str(error).splitlines()[-1][:160]
    except SlowError:
        return "SLOW"
    except Exception as error:  # what is looked for
        at = traceback.extract_tb(error.__traceback__)[-1]
        place = f"{at.filename.rpartition('flexband/')[2]}:{at.lineno}"
        return f"RAW {type(error).__name__}: {error}"[:160] + f" at {place}"
    finally:
        signal.alarm(0)
    return "returned" if np.isfinite(values).all() else "NOT FINITE"


def judge_mechanism(seed: int) -> dict[str, Any]:
    """Return what becomes of a mechanism in each of the calls."""
    integrator = fb.GeneralizedAlpha(step_tolerance=1e-6)
    run_times = {"duration": 0.05, "step": 0.005}
    results: dict[str, Any] = {"seed": seed}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        models: list[fb.Mechanism] = []
        results["build"] = outcome(lambda: models.append(Grammar(seed).mechanism()) or 0.0)
        if not models:
            return results
        model = models[0]
        calls = {
            "simulate": lambda: fb.simulate(model, **run_times),
            "chosen steps": lambda: fb.simulate(model, integrator=integrator, **run_times),
            "static start": lambda: fb.simulate(model, start="static", **run_times),
            "equilibrium": lambda: fb.equilibrium(model),
            "modes": lambda: fb.modes(model, 3)["eigenvalue"].values,
            "describe": lambda: float(len(fb.describe(model))),
        }
        for name, call in calls.items():
            results[name] = outcome(call)
    return results


def main() -> None:
    arguments = options(
        __doc__,
        3000,
        seed=(1, "first seed; those of documented tables must not be looked at before"),
        file=("output/grammar.jsonl", "one line for each mechanism that was judged"),
    )
    seeds = range(arguments.seed, arguments.seed + arguments.samples)
    cases = judge_cases(arguments.file, seeds, judge_mechanism)
    rows = []
    notes = [f"seeds {seeds[0]} to {seeds[-1]}"]
    names = [
        "build",
        "simulate",
        "chosen steps",
        "static start",
        "equilibrium",
        "modes",
        "describe",
    ]
    for name in names:
        kinds = Counter(
            case[name].partition(":")[0].partition(" ")[0] for case in cases if name in case
        )
        rows.append(
            [name, *(str(kinds.get(k, 0)) for k in ("returned", "refused", "SLOW", "RAW", "NOT"))]
        )
        notes += [
            f"{name}, seed {case['seed']}: {case[name]}" for case in cases
            if name in case and case[name][:3] in ("RAW", "NOT", "SLO")
        ]  # fmt: skip
    header = ["call", "returned", "refused", "too slow", "raw errors", "not finite"]
    report(arguments.output, "grammar", header, rows, {"cases": cases}, notes)


if __name__ == "__main__":
    main()
