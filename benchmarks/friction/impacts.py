"""Mechanisms with friction that are struck, drawn at random, against their impulse problems.

Wagons on rough rails, chains with rough pins, sliders that cranks drive in rough guides, and wheels
with rough axles and brakes: at the start a joint becomes active (a distance, a pin, a gear, a
drive), or a one-way clutch locks. The velocities after that are compared with those of an
independent solution in x, y and φ of each body, which tries all combinations of what sticks and
slides; speeds may be off by 1e-6 of the largest. So may the kinetic energy from the one before less
`SwitchingLoss` and plus `Work`. Where an impulse problem has no solution, or several, the engine
must refuse it or have one of them.

    python -m benchmarks.friction.impacts --seed 1 --samples 300

With `--new-joint 1` a motion goes on with the new joint in place of one that switches, and balances
`lost_energy`; where the new joint would not be met, or is a clutch, nothing is compared.
"""

from __future__ import annotations

import itertools
import math
import sys
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import xarray as xr

import flexband as fb
from benchmarks.friction.draws import Brake, Coulomb, Draw, Link, joint
from benchmarks.friction.reference import bordered
from benchmarks.friction.rows import (
    normal_force,
    point_at,
    rows_of,
    separation_row,
    sliding_row,
    spin,
)
from benchmarks.harness import options, report
from benchmarks.numerics.contact_draws import GROUND, Part, Place, PointNames, rigid_bodies
from benchmarks.numerics.contacts import bars, chain

MECHANISMS = 300
BEFORE = 1e-3
"""Duration of a motion before the one that goes on [s]."""
SPEED = ENERGY = 1e-6
"""Allowed errors, relative to the largest speed and to the kinetic energy before."""


class Strike(NamedTuple):
    """What becomes active: "distance", "pin", "gear", "drive" or "clutch", between two points.

    `number` is the ratio of a gear, or the rate of a drive or of a slider [rad/s], [m/s].
    """

    kind: str
    first: Place
    second: Place
    number: float = 0.0


@dataclass(frozen=True)
class Impact:
    """A mechanism that is struck at the start."""

    draw: Draw
    strikes: list[Strike]


def ground(x: float = 0.0, y: float = 0.0) -> Place:
    """Return a point of the ground."""
    return Place(GROUND, x, y)


def law(rng: np.random.Generator) -> Coulomb:
    """Return a coefficient of friction."""
    mu = float(rng.uniform(0.01, 0.6))
    return Coulomb(mu, mu, 0.0, float(rng.choice([0.0, rng.uniform(0.1, 2.0)])))


def body(rng: np.random.Generator, x: float, y: float, angle: float = 0.0) -> Part:
    """Return a body with a velocity that joints may change."""
    m = float(rng.uniform(0.5, 3.0))
    velocity = tuple(float(rng.normal()) for _ in range(3))
    return Part(m, m * float(rng.uniform(1e-3, 1e-2)), (x, y, angle), velocity)


def wagons(rng: np.random.Generator) -> Impact:
    """Return blocks in rough guides and slots of any direction, two of which are linked."""
    parts = []
    links = []
    count = int(rng.integers(2, 4))
    for k in range(count):
        x = 0.5 * k
        y = float(rng.uniform(-0.3, 0.3))
        slope = float(rng.uniform(-0.7, 0.7))
        parts.append(body(rng, x, y))
        axis = math.cos(slope), math.sin(slope)
        friction = law(rng) if rng.random() < 0.8 else None
        kind = str(rng.choice(["guide", "slot"]))
        length = float(rng.uniform(0.05, 0.3))
        links.append(Link(kind, Place(k, 0.0, 0.0), ground(x, y), axis, friction, length))
    ends = [Place(k, *(float(z) for z in rng.uniform(-0.05, 0.05, 2))) for k in range(count)]
    kind = str(rng.choice(["distance", "pin"], p=[0.8, 0.2]))
    strikes = [Strike(kind, ends[0], ends[1])]
    if count > 2 and rng.random() < 0.5:
        strikes.append(Strike("distance", ends[1], ends[2]))
    return Impact(Draw("wagons", parts, links), strikes)


def linkage(rng: np.random.Generator) -> Impact:
    """Return a chain with rough pins that is caught, driven or locked."""
    lengths, angles = bars(rng)
    parts, pins, end = chain(rng, lengths, angles)
    links = [
        Link(
            "pin", first, second, friction=law(rng) if rng.random() < 0.8 else None,
            length=float(rng.uniform(0.005, 0.05)),
        )
        for _, first, second in pins
    ]  # fmt: skip
    last = len(parts) - 1
    inner = Place(last, float(rng.uniform(-0.1, 0.1)), 0.0)
    choice = int(rng.integers(4))
    match choice if len(parts) > 1 else choice % 3:  # a single bar is locked by two pins
        case 0:
            strike = Strike("distance", end, ground(*(float(z) for z in rng.uniform(-1, 1, 2))))
        case 1:
            strike = Strike("drive", Place(0, 0.0, 0.0), ground(), float(rng.normal(scale=5)))
        case 2:
            strike = Strike("clutch", inner, Place(0, 0.0, 0.0) if last else ground())
        case _:
            strike = Strike("pin", end, ground(*(float(z.real) for z in point_at(
                np.array([p.place for p in parts], dtype=complex).ravel(), end
            ))))  # fmt: skip
    return Impact(Draw("linkages", parts, links), [strike])


def slider_crank(rng: np.random.Generator) -> Impact:
    """Return a slider–crank with rough pins and guide, whose slider or crank is caught."""
    r = float(rng.uniform(0.1, 0.2))
    angle = float(rng.uniform(0.3, 2.8))
    length = r * float(rng.uniform(2, 4))
    tilt = -math.asin(r * math.sin(angle) / length)
    parts, pins, end = chain(rng, [r, length], [angle, tilt])
    x = r * math.cos(angle) + length * math.cos(tilt)
    parts.append(body(rng, x, 0.0))
    slider = Place(2, 0.0, 0.0)
    links = [
        Link("pin", first, second, friction=law(rng), length=float(rng.uniform(0.002, 0.02)))
        for _, first, second in pins
    ]
    links.append(Link("pin", slider, end))
    guide = float(rng.uniform(0.05, 0.2))
    links.append(Link("guide", slider, ground(x, 0.0), (1.0, 0.0), law(rng), guide))
    parts.append(body(rng, x + 0.4, 0.1))
    links.append(Link("slot", Place(3, 0.0, 0.0), ground(x + 0.4, 0.1), (1.0, 0.0), law(rng)))
    catch = Strike("distance", slider, Place(3, 0.02, 0.0))
    drive = Strike("drive", Place(0, 0.0, 0.0), ground(), float(rng.normal(scale=10)))
    return Impact(Draw("slider-cranks", parts, links), [catch if rng.random() < 0.6 else drive])


def wheels(rng: np.random.Generator) -> Impact:
    """Return wheels with rough axles and a brake that a gear, a clutch or a drive couples."""
    parts = []
    links = []
    for k in range(2):
        parts.append(body(rng, 0.3 * k, 0.0, float(rng.uniform(-1, 1))))
        radius = float(rng.uniform(0.005, 0.03))
        friction = law(rng) if rng.random() < 0.8 else None
        links.append(Link("pin", Place(k, 0.0, 0.0), ground(0.3 * k), (1.0, 0.0), friction, radius))
    force = float(rng.uniform(0.0, 50.0))
    brake = Brake(Place(1, 0.0, 0.0), ground(0.3), law(rng), 0.1, lambda t: force)
    centres = Place(0, 0.0, 0.0), Place(1, 0.0, 0.0)
    match int(rng.integers(4)):
        case 0:
            strike = Strike("gear", *centres, float(rng.uniform(0.3, 3.0)))
        case 1:
            strike = Strike("clutch", *centres)
        case 2:
            rim_points = Place(0, 0.05, 0.02), Place(1, 0.0, 0.08)
            strike = Strike("distance", *rim_points)
        case _:
            strike = Strike("drive", centres[0], ground(), float(rng.normal(scale=10)))
    return Impact(Draw("wheels", parts, links, brakes=[brake]), [strike])


FAMILIES: list[Callable[[np.random.Generator], Impact]] = [wagons, linkage, slider_crank, wheels]


class Problem:
    """The impulse problem of a mechanism in x, y and φ of its bodies."""

    def __init__(self, impact: Impact):
        draw = self.draw = impact.draw
        self.mass = np.array([[p.mass, p.mass, p.inertia] for p in draw.parts]).ravel()
        q = np.array([part.place for part in draw.parts], dtype=complex).ravel()
        joints = [np.array(rows_of(q, link)).real for link in draw.links]
        self.first = np.cumsum([0, *map(len, joints)])
        self.joints = np.concatenate(joints)
        # Velocities before, as far as joints allow them.
        part_velocities = np.array([part.velocity for part in draw.parts]).ravel()
        n = len(part_velocities)
        right = np.concatenate([self.mass * part_velocities, np.zeros(len(self.joints))])
        self.before = bordered(self.mass, self.joints, right)[:n]
        # Rows of what becomes active.
        hard = []
        speeds = []
        self.one_way = []
        for strike in impact.strikes:
            rows, targets = rows_of_strike(q, strike)
            hard += rows
            speeds += targets
            self.one_way += [strike.kind == "clutch"] * len(rows)
        self.hard = np.array(hard)
        self.speeds = np.array(speeds)
        # Rows and coefficients of friction.
        self.rough_links = [k for k, link in enumerate(draw.links) if link.friction]
        rows = [sliding_row(q, draw.links[k]) for k in self.rough_links]
        self.sliding = np.array(rows).real.reshape(-1, n)
        mu = np.array([draw.links[k].friction.kinetic for k in self.rough_links], dtype=float)
        pins = np.array([draw.links[k].kind == "pin" for k in self.rough_links], dtype=bool)
        self.mu = np.where(pins, np.sin(np.arctan(mu)), mu)

    def normal(self, reactions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the normal impulses and their derivatives by those of the joints."""
        value = np.zeros(len(self.rough_links))
        gradient = np.zeros((len(self.rough_links), len(reactions)))
        for row, k in enumerate(self.rough_links):
            first = self.first[k]
            link = self.draw.links[k]
            count = 1 if link.kind == "slot" else 2
            part = slice(first, first + count)
            value[row], gradient[row, part] = normal_force(link, reactions[part])
        return value, gradient

    def solutions(self) -> list[np.ndarray]:
        """Return the velocities after the impact of all solutions."""
        velocities: list[np.ndarray] = []
        locks = [(True, False) if one_way else (True,) for one_way in self.one_way]
        for lock in itertools.product(*locks):
            for modes in itertools.product((0, 1, -1), repeat=len(self.rough_links)):
                for v in self.of_modes(np.array(lock, dtype=bool), np.array(modes)):
                    if all(np.abs(v - other).max() > 1e-7 * self.scale for other in velocities):
                        velocities.append(v)
        return velocities

    @property
    def scale(self) -> float:
        """The largest speed before, in a metre."""
        return max(float(np.abs(self.before).max()), float(np.abs(self.speeds).max(initial=0.0)))

    def of_modes(self, lock: np.ndarray, modes: np.ndarray) -> list[np.ndarray]:
        """Return the velocities with which friction sticks (0) or slides (±1) consistently."""
        n = len(self.mass)
        joints = len(self.joints)
        sticks = modes == 0
        slides = np.flatnonzero(modes)
        G = np.concatenate([self.joints, self.hard[lock], self.sliding[sticks]])
        if len(G) > n or np.linalg.matrix_rank(G / np.sqrt(self.mass)) < len(G):
            return []
        columns = np.zeros((n + len(G), 1 + len(slides)))
        columns[:n, 0] = self.mass * self.before
        columns[n + joints : n + joints + lock.sum(), 0] = self.speeds[lock]
        columns[:n, 1:] = -self.sliding[slides].T
        solution = bordered(self.mass, G, columns)
        results = []
        for start in itertools.product((0.0, 1.0, -1.0), repeat=len(slides)):
            f = self.impulses(solution[n : n + joints], modes, slides, np.array(start))
            if f is None:
                continue
            x = solution @ np.concatenate([[1.0], f])
            if self.consistent(x, lock, sticks, modes, slides):
                results.append(x[:n])
        return results

    def impulses(self, reactions, modes, slides, start) -> np.ndarray | None:
        """Return the impulses of what slides by Newton's method, or None."""
        f = start * self.mu[slides] * self.normal(reactions[:, 0])[0][slides]
        for _ in range(60):
            normal, gradient = self.normal(reactions[:, 0] + reactions[:, 1:] @ f)
            sense = (modes * self.mu)[slides]
            error = f - sense * normal[slides]
            if np.abs(error).max(initial=0.0) <= 1e-13 * (1e-3 + np.abs(f).max(initial=0.0)):
                return f
            change = np.eye(len(f)) - sense[:, None] * (gradient[slides] @ reactions[:, 1:])
            if abs(np.linalg.det(change)) < 1e-12:
                return None
            f = f - np.linalg.solve(change, error)
        return None

    def consistent(self, x, lock, sticks, modes, slides) -> bool:
        """Return whether Moreau's law holds, and one-way clutches push one way only."""
        n = len(self.mass)
        joints = len(self.joints)
        v = x[:n]
        p = x[n:]
        largest = np.abs(p).max(initial=0.0)
        normal, _ = self.normal(p[:joints])
        sticking_impulses = p[joints + int(lock.sum()) :]
        if np.any(np.abs(sticking_impulses) > (self.mu * normal)[sticks] + 1e-9 * largest):
            return False
        speed_tolerance = 1e-9 * self.scale
        if np.any((modes * (self.sliding @ v))[slides] < -speed_tolerance):
            return False
        clutch_impulses = p[joints : joints + int(lock.sum())]
        one_way = np.array(self.one_way, dtype=bool)
        if np.any(clutch_impulses[one_way[lock]] > 1e-9 * largest):  # it may push the first body on
            return False
        open_ = one_way & ~lock
        return not np.any((self.hard[open_] @ v) < -speed_tolerance)

    def energy(self, v: np.ndarray) -> float:
        """Return the kinetic energy [J]."""
        return 0.5 * float(self.mass @ v**2)


def rows_of_strike(q: np.ndarray, strike: Strike) -> tuple[list[np.ndarray], list[float]]:
    """Return the rows of what becomes active, and the speeds that it prescribes."""
    i = strike.first.body
    j = strike.second.body
    p = point_at(q, strike.first)
    r = point_at(q, strike.second)
    if strike.kind in ("drive", "clutch"):
        return [spin(q, i, j).real], [strike.number]
    if strike.kind == "gear":
        first = 0.3 * strike.number / (1.0 + strike.number)
        centres = separation_row(q, (j, r), (i, p), (0.0, 1.0))  # the line of centres is along X
        turns = spin(q, i, GROUND, first) + spin(q, j, GROUND, 0.3 - first)
        return [(turns - centres).real], [0.0]
    if strike.kind == "pin":
        axes = (1.0, 0.0), (0.0, 1.0)
        return [separation_row(q, (i, p), (j, p), axis).real for axis in axes], [0.0, 0.0]
    x = (p[0] - r[0]).real
    y = (p[1] - r[1]).real
    d = math.hypot(x, y)
    return [separation_row(q, (i, p), (j, r), (x / d, y / d)).real], [0.0]


def new_joint(strike: Strike, q: np.ndarray, a, b) -> object:
    """Return the joint with which a motion goes on from the places q."""
    if strike.kind == "distance":
        offset = np.subtract(point_at(q, strike.first), point_at(q, strike.second)).real
        return fb.Distance(a, b, float(np.hypot(*offset)))
    if strike.kind == "drive":
        angle = float(q[3 * strike.first.body + 2].real)
        return fb.PrescribedRotation(a, lambda t: angle + strike.number * (t - BEFORE))
    return strike_joint(strike, a, b)


def model_of(impact: Impact, velocities: np.ndarray, *, kind: str = "switched") -> fb.Mechanism:
    """Return the mechanism, with sensors of all velocities and energies.

    What becomes active is "switched", a "new" joint, or "none".
    """
    draw = impact.draw
    at = PointNames(len(impact.draw.parts))
    joints = {f"J{k}": joint(link, at) for k, link in enumerate(draw.links)}
    loads: dict = {"gravity": fb.Gravity()}
    for k, brake in enumerate(draw.brakes):
        loads[f"B{k}"] = fb.contact.Brake(
            at(brake.first), at(brake.second), friction=brake.friction.make_law(),
            radius=brake.radius, force=brake.force(0.0),
        )  # fmt: skip
    # Add what becomes active.
    for k, strike in enumerate(impact.strikes):
        a = at(strike.first)
        b = at(strike.second)
        if strike.kind == "clutch":
            loads[f"S{k}"] = fb.contact.OneWayClutch(a, b)
        elif kind == "new":
            q = np.array([part.place for part in draw.parts], dtype=complex).ravel()
            joints[f"S{k}"] = new_joint(strike, q, a, b)
        elif kind == "switched":
            joints[f"S{k}"] = fb.contact.Switched(strike_joint(strike, a, b), lambda t: t > -1.0)
    # Add sensors of all motions, work and losses.
    bodies = rigid_bodies(draw.parts, velocities, at)
    model = fb.Mechanism(bodies=bodies, joints=joints, loads=loads)
    sensors: dict = {"T": fb.KineticEnergy()}
    for name in model.bodies:
        sensors[f"v {name}"] = fb.Velocity(name)
        sensors[f"w {name}"] = fb.AngularVelocity(name)
        sensors[f"p {name}"] = fb.Position(name)
        sensors[f"a {name}"] = fb.Angle(name)
    for name in [*joints, *(name for name in loads if name[0] in "SB")]:
        sensors[f"work {name}"] = fb.Work(name)
    for name, part in joints.items():
        if isinstance(part, fb.contact.Switched):
            sensors[f"lost {name}"] = fb.sensors.SwitchingLoss(name)
    return replace(model, sensors=sensors)


def strike_joint(strike: Strike, a, b) -> object:
    """Return the joint that becomes active."""
    if strike.kind == "distance":
        return fb.Distance(a, b, 1.0)
    if strike.kind == "pin":
        return fb.Revolute(a, b)
    if strike.kind == "gear":
        first = 0.3 * strike.number / (1.0 + strike.number)  # with centres 0.3 m apart
        return fb.Gear(a, b, first, 0.3 - first)
    return fb.PrescribedRotation(a, lambda t: strike.number * t)


def continue_motion(impact: Impact) -> tuple[Impact, xr.DataArray]:
    """Return the mechanism as it is after a short motion, and that motion."""
    model = model_of(impact, Problem(impact).before.reshape(-1, 3), kind="none")
    first_motion = fb.simulate(model, duration=BEFORE, step=BEFORE, keep_state=True)
    end = first_motion.isel(time=-1)
    parts = []
    for k, part in enumerate(impact.draw.parts):
        numbers = [
            float(end.sel(output=n))
            for n in (f"p b{k}_X", f"p b{k}_Y", f"a b{k}", f"v b{k}_X", f"v b{k}_Y", f"w b{k}")
        ]
        parts.append(replace(part, place=tuple(numbers[:3]), velocity=tuple(numbers[3:])))
    return replace(impact, draw=replace(impact.draw, parts=parts)), first_motion


def energy_taken(motion: xr.DataArray) -> float:
    """Return the energy that has left a motion, less the work that was done on it [J]."""
    names = motion["output"].values.tolist()
    signs = {"work": -1.0, "lost": 1.0}
    return sum(signs[n[:4]] * float(motion.sel(output=n)) for n in names if n[:4] in signs)


def judge_impact(seed: int, *, new_joint: bool = False) -> tuple[str, str, str]:
    """Return the family of a mechanism, what became of it, and why.

    A motion goes on with a `new_joint`, or else a joint switches.
    """
    rng = np.random.default_rng(seed)
    impact = FAMILIES[seed % len(FAMILIES)](rng)
    kind = impact.draw.kind
    first_motion = None
    if new_joint:
        if any(strike.kind in ("clutch", "pin") for strike in impact.strikes):
            return kind, "left out", "a new joint must be met"
        impact, first_motion = continue_motion(impact)
    # Find all solutions of the impulse problem.
    problem = Problem(impact)
    solutions = problem.solutions()
    solution_count = {0: "none", 1: "one"}.get(len(solutions), "several")
    model = model_of(impact, problem.before.reshape(-1, 3), kind="new" if new_joint else "switched")
    # Simulate, unless the engine refuses.
    try:
        motion = fb.simulate(
            model,
            duration=1e-3,
            step=1e-3,
            start="assembled" if first_motion is None else first_motion,
        )
    except fb.errors.RunError as error:
        outcome = "refused" if solution_count != "one" else "refused wrongly"
        return kind, outcome, f"{solution_count} {error}"
    lost = motion.attrs["lost_energy"][0] if new_joint else energy_taken(motion.isel(time=0))
    motion = motion.isel(time=0)
    names = [
        n for k in range(len(impact.draw.parts)) for n in (f"v b{k}_X", f"v b{k}_Y", f"w b{k}")
    ]
    # Compare velocities and energies.
    v = motion.sel(output=names).values
    speed_error = min((np.abs(v - s).max() for s in solutions), default=math.inf) / problem.scale
    before = problem.energy(problem.before)
    after = float(motion.sel(output="T"))
    balance = abs(before - lost - after) / before
    text = f"{solution_count} solution, speeds {speed_error:.1e}, balance {balance:.1e}"
    right = speed_error < SPEED and balance < ENERGY
    return kind, "right" if right else "wrong", text


def main() -> None:
    """Judge mechanisms of successive seeds and report how many of each family are right."""
    arguments = options(
        __doc__,
        MECHANISMS,
        seed=(1, "first of the seeds"),
        new_joint=(0, "1 for motions that go on with a new joint, in place of one that switches"),
    )
    counts: dict[str, Counter] = {}
    for seed in range(arguments.seed, arguments.seed + arguments.samples):
        kind, outcome, why = judge_impact(seed, new_joint=bool(arguments.new_joint))
        counts.setdefault(kind, Counter())[outcome] += 1
        if outcome not in ("right", "left out"):
            print(seed, kind, outcome, why, file=sys.stderr, flush=True)
    columns = ["right", "wrong", "refused", "refused wrongly", "left out"]
    rows = [[kind, *(str(of_kind[c]) for c in columns)] for kind, of_kind in counts.items()]
    report(arguments.output, "impacts", ["mechanism", *columns], rows,
           {kind: dict(of_kind) for kind, of_kind in counts.items()})  # fmt: skip


if __name__ == "__main__":
    main()
