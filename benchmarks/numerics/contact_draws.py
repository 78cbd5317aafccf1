"""Mechanisms with contacts drawn at random, as data, and their motion between events by SciPy.

`mechanism` makes the model of flexband of a `Draw`; `Reference` integrates x, y and φ of each body
from event to event, so that it shares neither coordinates nor methods with the engine.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import flexband as fb

GRAVITY = 9.81
GROUND = -1
ZERO = 1e-15
"""Distance [m] or [rad] by which a contact that has just opened is open."""

MOST = 300_000
"""Most evaluations of the equations of motion for one mechanism."""

LONGEST = 1e-3
"""Longest step of the reference [s], in which no gap closes and opens again."""

LAW = {"least_speed": 1e-6}


@dataclass(frozen=True)
class Part:
    """A rigid body, its place, and its velocity before joints are considered."""

    mass: float
    inertia: float
    place: tuple[float, float, float]
    velocity: tuple[float, float, float]


class Place(NamedTuple):
    """A point of a body by its number, or of the ground."""

    body: int
    x: float
    y: float


class Touch(NamedTuple):
    """A contact: its kind, two places, the numbers of its geometry, and K, e and n of its law."""

    kind: str
    first: Place
    second: Place
    numbers: tuple[float, ...]
    law: tuple[float, float, float]


@dataclass(frozen=True)
class Draw:
    """A mechanism as data; joints are "pin", "slot" (axis) or "motor" (rate), and two places."""

    kind: str
    parts: list[Part]
    joints: list[tuple[Any, ...]]
    touches: list[Touch]
    springs: list[tuple[Place, Place, float, float]] = field(default_factory=list)

    @property
    def size(self) -> float:
        """The largest distance between two bodies [m]."""
        return size_of(self.parts)


def size_of(parts: list[Part]) -> float:
    """Return the largest distance between two bodies [m]."""
    places = np.array([part.place[:2] for part in parts])
    return max(float(np.hypot(*np.ptp(places, axis=0))), 0.1)


class PointNames:
    """Names of the points of bodies, given as they are asked for."""

    def __init__(self, count: int):
        self.points: list[dict[str, tuple[float, float]]] = [{} for _ in range(count)]

    def __call__(self, place: Place) -> Any:
        """Return the name of a point, or the coordinates of one of the ground."""
        if place.body == GROUND:
            return place.x, place.y
        body_points = self.points[place.body]
        body_points.setdefault(f"p{len(body_points)}", (place.x, place.y))
        name = next(name for name, xy in body_points.items() if xy == (place.x, place.y))
        return f"b{place.body}.{name}"


def rigid_bodies(
    parts: list[Part], velocities: np.ndarray, at: PointNames
) -> dict[str, fb.RigidBody]:
    """Return the bodies with these velocities, rows of (v_X, v_Y, ω), and the named points."""
    return {
        f"b{k}": fb.RigidBody(
            mass=part.mass, inertia=part.inertia, position=part.place[:2], angle=part.place[2],
            velocity=tuple(velocities[k, :2]), rate=velocities[k, 2], points=at.points[k],
        )
        for k, part in enumerate(parts)
    }  # fmt: skip


def contact(touch: Touch, at: PointNames, options: dict[str, Any]) -> Any:
    """Return a contact as a load, with further options."""
    kind, first, second, numbers, (K, e, n) = touch
    law = fb.contact.KeepsRestitution(stiffness=K, restitution=e, exponent=n, **LAW)
    a = at(first)
    b = at(second)
    if kind == "stop":
        return fb.contact.Stop(a, b, law, lower=numbers[0], upper=numbers[1], **options)
    if kind == "turn":
        return fb.contact.AngularStop(a, b, law, lower=numbers[0], upper=numbers[1], **options)
    if kind == "line":
        radius, angle = numbers
        normal = math.cos(angle), math.sin(angle)
        shape = fb.contact.CircleOnLine(radius=radius, normal=normal)
    elif kind == "hole":
        shape = fb.contact.CircleInCircle(radii=numbers)
    else:
        shape = fb.contact.CircleOnCircle(radii=numbers)
    return fb.contact.Contact(a, b, shape, law, **options)


def mechanism(draw: Draw, velocities: np.ndarray) -> fb.Mechanism:
    """Return the model with these velocities of all bodies, rows of (v_X, v_Y, ω)."""
    at = PointNames(len(draw.parts))
    joints = {}
    loads = {"gravity": fb.Gravity(y=-GRAVITY)}
    sensors = {}
    # Joints and drives.
    for k, (kind, first, second, *numbers) in enumerate(draw.joints):
        if kind == "motor":
            angle = draw.parts[first.body].place[2]
            rate = numbers[0]
            joints[f"J{k}"] = fb.PrescribedRotation(
                f"b{first.body}", lambda t, a=angle, w=rate: a + w * np.asarray(t)
            )
        else:
            make = {"pin": fb.Revolute, "slot": fb.Slot}[kind]
            joints[f"J{k}"] = make(at(first), at(second), *numbers)
    for k, (first, second, stiffness, rest) in enumerate(draw.springs):
        loads[f"spring {k}"] = fb.Spring(at(first), at(second), stiffness, rest)
    # Contacts; those of pins and guides are joints.
    for k, touch in enumerate(draw.touches):
        kind, first, second, numbers, (K, e, n) = touch
        name = f"T{k}"
        if kind in ("pin", "guide"):
            law = fb.contact.KeepsRestitution(stiffness=K, restitution=e, exponent=n, **LAW)
            make = fb.Revolute if kind == "pin" else fb.Prismatic
            sizes = dict(zip(("clearance", "length", "height"), numbers, strict=False))
            joints[name] = make(at(first), at(second), law=law, **sizes)
        else:
            loads[name] = contact(touch, at, {})
        sensors[name] = fb.contact.Contacts(name, first=EVENTS + 1, angular=kind == "turn")
    bodies = rigid_bodies(draw.parts, velocities, at)
    for name in bodies:
        sensors[f"place {name}"] = fb.Position(name)
        sensors[f"angle {name}"] = fb.Angle(name)
    return fb.Mechanism(bodies=bodies, joints=joints, loads=loads, sensors=sensors)


EVENTS = 10
"""Contacts that are compared in each mechanism."""

HOLE, LINE, CIRCLES, TURN = range(4)


def damping(e: float) -> float:
    """Return a of F = K δⁿ (1 + a δ̇/δ̇₀) that keeps e: a (1 + e) = ln((1 + a)/(1 − a e))."""
    if e == 1.0:
        return 0.0
    return brentq(
        lambda a: math.log1p(a) - math.log1p(-a * e) - a * (1 + e), 1e-9, (1 - 1e-12) / e,
        xtol=1e-15,
    )  # fmt: skip


def damping_ratio(e: float) -> float:
    """Return ζ of a linear vibration whose amplitude falls by e in half a period."""
    return -math.log(e) / math.hypot(math.pi, math.log(e))


def push(depth, speed, law, impact, over, mass):
    """Return the force of a contact that is pressed in with a speed.

    `law` is K, n, a and ζ. The damping is that of the speed of the impact; once the contact has
    been pressed in again, which is `over`, it is at most that of a small vibration with ζ and the
    effective mass; and it falls to that where other forces press deeper than an impact of twice
    the speed does.
    """
    K, n, a, ratio = law
    elastic = K * depth**n
    damps = a * elastic / impact
    vibration = 2.0 * ratio * math.sqrt(n * elastic / depth * mass)
    reach = elastic * depth / (0.5 * (n + 1.0) * mass * (2.0 * impact) ** 2)
    if over:
        damps = min(damps, vibration)
    elif reach > 1.0:
        damps = min(damps, max(damps / reach, vibration))
    return max(elastic + damps * speed, 0.0)


def position(q, i, x, y):
    """Return a point and its derivatives by the angle of its body."""
    if i < 0:
        return x, y, 0.0, 0.0
    c = math.cos(q[3 * i + 2])
    s = math.sin(q[3 * i + 2])
    return q[3 * i] + c * x - s * y, q[3 * i + 1] + s * x + c * y, -s * x - c * y, c * x - s * y


def add_gradient(row, i, nx, ny, dx, dy, sign):
    """Add ± the derivative of n · r of a point to a row."""
    if i >= 0:
        row[3 * i] += sign * nx
        row[3 * i + 1] += sign * ny
        row[3 * i + 2] += sign * (nx * dx + ny * dy)


def gap(q, kind, i, j, p, row):
    """Return a gap and fill its derivative by q."""
    row[:] = 0.0
    # Between angles.
    if kind == TURN:
        a = (q[3 * i + 2] if i >= 0 else 0.0) - (q[3 * j + 2] if j >= 0 else 0.0)
        if i >= 0:
            row[3 * i + 2] = -p[4]
        if j >= 0:
            row[3 * j + 2] = p[4]
        return p[5] - p[4] * a
    # Between a point and a line or a circle.
    x1, y1, dx1, dy1 = position(q, i, p[0], p[1])
    x2, y2, dx2, dy2 = position(q, j, p[2], p[3])
    x = x1 - x2
    y = y1 - y2
    if kind == LINE:
        angle = p[4] + (q[3 * j + 2] if j >= 0 else 0.0)
        nx = math.cos(angle)
        ny = math.sin(angle)
        if j >= 0:
            row[3 * j + 2] += -ny * x + nx * y
        value = nx * x + ny * y - p[5]
    else:
        d = max(math.hypot(x, y), 1e-300)
        sign = -1.0 if kind == HOLE else 1.0
        nx = sign * x / d
        ny = sign * y / d
        value = p[4] + sign * d
    add_gradient(row, i, nx, ny, dx1, dy1, 1.0)
    add_gradient(row, j, nx, ny, dx2, dy2, -1.0)
    return value


def constraints(q, v, joints, numbers):
    """Return Φ_q, −(Φ_q v)_q v and Φ_q v of all joints."""
    J = np.zeros((len(joints), len(q)))
    right = np.zeros(len(joints))
    rates = np.zeros(len(joints))
    for r in range(len(joints)):
        i, j = joints[r]
        p = numbers[r]
        if p[6] != 0.0:  # a motor
            J[r, 3 * i + 2] = 1.0
            rates[r] = p[7]
            continue
        _, _, dx1, dy1 = position(q, i, p[0], p[1])
        _, _, dx2, dy2 = position(q, j, p[2], p[3])
        add_gradient(J[r], i, p[4], p[5], dx1, dy1, 1.0)
        add_gradient(J[r], j, p[4], p[5], dx2, dy2, -1.0)
        if i >= 0:  # the second derivative of a point is that of its angle turned by 90°
            right[r] -= v[3 * i + 2] ** 2 * (-p[4] * dy1 + p[5] * dx1)
        if j >= 0:
            right[r] += v[3 * j + 2] ** 2 * (-p[4] * dy2 + p[5] * dx2)
    return J, right, rates


def solve_constrained(mass, J, forces, right):
    """Return x of M x + Jᵀλ = forces and J x = right."""
    n = len(mass)
    m = len(J)
    A = np.zeros((n + m, n + m))
    b = np.zeros(n + m)
    for i in range(n):
        A[i, i] = mass[i]
    A[n:, :n] = J
    A[:n, n:] = J.T
    b[:n] = forces
    b[n:] = right
    return np.linalg.solve(A, b)[:n]


def derivative(
    y, mass, joints, numbers, springs, of_springs, touches, of_touches, closed, impact_speeds, over
):
    """Return the derivative of [q, v]."""
    n = len(mass)
    q = y[:n]
    v = y[n:]
    forces = np.zeros(n)
    row = np.zeros(n)
    # Gravity and springs.
    for i in range(n // 3):
        forces[3 * i + 1] = -GRAVITY * mass[3 * i]
    for s in range(len(springs)):
        i, j = springs[s]
        p = of_springs[s]
        x1, y1, dx1, dy1 = position(q, i, p[0], p[1])
        x2, y2, dx2, dy2 = position(q, j, p[2], p[3])
        d = math.sqrt((x1 - x2) ** 2 + (y1 - y2) ** 2)
        row[:] = 0.0
        add_gradient(row, i, (x1 - x2) / d, (y1 - y2) / d, dx1, dy1, 1.0)
        add_gradient(row, j, (x1 - x2) / d, (y1 - y2) / d, dx2, dy2, -1.0)
        forces -= p[4] * (d - p[5]) * row
    # Contacts that are closed.
    J, right, _ = constraints(q, v, joints, numbers)
    for k in range(len(touches)):
        if closed[k]:
            kind, i, j = touches[k]
            p = of_touches[k]
            g = gap(q, kind, i, j, p, row)
            if g < 0.0:
                effective = 1.0 / (row @ solve_constrained(mass, J, row, np.zeros(len(J))))
                forces += push(-g, -(row @ v), p[6:], impact_speeds[k], over[k], effective) * row
    return np.concatenate((v, solve_constrained(mass, J, forces, right)))


class TooLongError(Exception):
    """The reference takes too many evaluations."""


class Event(NamedTuple):
    """A contact that closes: when, which one, how fast, and that over the largest speed."""

    time: float
    touch: int
    speed: float
    share: float


class Reference:
    """The equations of motion of a `Draw` in x, y and φ of its bodies."""

    def __init__(self, draw: Draw):
        self.draw = draw
        self.mass = np.array([[p.mass, p.mass, p.inertia] for p in draw.parts]).ravel()
        self.start = np.array([part.place for part in draw.parts], dtype=float).ravel()
        joints = []
        numbers = []
        for kind, a, b, *parameters in draw.joints:
            common = [a.x, a.y, b.x, b.y]
            rows = {"pin": [(1.0, 0.0), (0.0, 1.0)], "motor": [(0.0, 0.0)]}.get(kind)
            rows = rows or [(-parameters[0][1], parameters[0][0])]
            for n in rows:
                joints.append((a.body, b.body))
                motor = kind == "motor"
                numbers.append([*common, *n, float(motor), parameters[0] if motor else 0.0])
        self.joints = np.array(joints, dtype=np.int64).reshape(-1, 2)
        self.numbers = np.array(numbers, dtype=float).reshape(-1, 8)
        springs = [(a.body, b.body) for a, b, *_ in draw.springs]
        self.springs = np.array(springs, dtype=np.int64).reshape(-1, 2)
        of_springs = [[a.x, a.y, b.x, b.y, k, rest] for a, b, k, rest in draw.springs]
        self.of_springs = np.array(of_springs, dtype=float).reshape(-1, 6)
        gaps = [(k, *g) for k, touch in enumerate(draw.touches) for g in gaps_of(touch)]
        self.owner = [k for k, *_ in gaps]
        self.touches = np.array([g[1:4] for g in gaps], dtype=np.int64).reshape(-1, 3)
        self.of_touches = np.array([g[4] for g in gaps], dtype=float).reshape(-1, 10)

    def velocities(self) -> np.ndarray:
        """Return the velocities at the start, those of the parts as far as joints allow them."""
        part_velocities = np.array([part.velocity for part in self.draw.parts], dtype=float).ravel()
        J, _, rates = constraints(self.start, part_velocities, self.joints, self.numbers)
        return solve_constrained(self.mass, J, self.mass * part_velocities, rates)

    def gaps(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return all gaps and their rates."""
        row = np.zeros(len(q))
        g = []
        rates = []
        for (kind, i, j), p in zip(self.touches, self.of_touches, strict=True):
            g.append(gap(q, kind, i, j, p, row))
            rates.append(row @ v)
        return np.array(g), np.array(rates)

    def motion(self, times: np.ndarray, rtol: float = 1e-11) -> tuple[np.ndarray, list[Event]]:
        """Return q at these times and the contacts that close, until there are enough of them.

        Raises
        ------
        TooLongError
            If that takes more than `MOST` evaluations, as for a contact that stays closed.
        """
        n = len(self.mass)
        count = len(self.touches)
        y = np.concatenate([self.start, self.velocities()])
        t = float(times[0])
        closed = np.zeros(count, dtype=bool)
        impact_speeds = np.ones(count)
        evaluations = 0
        over = np.zeros(count, dtype=bool)
        places = np.full((len(times), n), np.nan)
        events = []
        fastest = 0.0
        row = np.zeros(n)
        arguments = (self.mass, self.joints, self.numbers, self.springs, self.of_springs,
                     self.touches, self.of_touches)  # fmt: skip
        # Integrate from event to event.
        while t < times[-1] and len(events) <= EVENTS:
            # Gaps that close or open, then contacts that are pressed in again.
            event_functions, (g, _) = [], self.gaps(y[:n], y[n:])
            for k, ((kind, i, j), p) in enumerate(zip(self.touches, self.of_touches, strict=True)):
                offset = 0.0 if closed[k] else max(0.0, ZERO - g[k])

                def zero(_, y, kind=kind, i=i, j=j, p=p, offset=offset):
                    return offset + gap(y[:n], kind, i, j, p, row)

                zero.terminal = True
                zero.direction = 1.0 if closed[k] else -1.0
                event_functions.append(zero)
            for k, ((kind, i, j), p) in enumerate(zip(self.touches, self.of_touches, strict=True)):
                impact = closed[k] and not over[k]

                def approach_rate(_, y, kind=kind, i=i, j=j, p=p, impact=impact):
                    gap(y[:n], kind, i, j, p, row)
                    return row @ y[n:] if impact else 1.0

                approach_rate.terminal = True
                approach_rate.direction = -1.0
                event_functions.append(approach_rate)
            # Integrate to the next event.
            state = closed.copy(), impact_speeds.copy(), over.copy()

            def rates_of(_, y, state=state):
                nonlocal evaluations
                evaluations += 1
                if evaluations > MOST:
                    raise TooLongError
                return derivative(y, *arguments, *state)

            part = solve_ivp(
                rates_of, (t, times[-1]), y,
                "DOP853", rtol=rtol, atol=0.01 * rtol, max_step=LONGEST, events=event_functions,
                dense_output=True,
            )  # fmt: skip
            inside = (times >= t) & (times <= part.t[-1])
            if inside.any():
                places[inside] = part.sol(times[inside])[:n].T
            y = part.y[:, -1]
            t = float(part.t[-1])
            # Change the state of what has closed, opened or been pressed in.
            g, rates = self.gaps(y[:n], y[n:])
            fastest = max(fastest, float(np.abs(rates).max()))
            event_mask = np.array([len(moments) > 0 for moments in part.t_events])
            repeat_mask = event_mask[count:]
            event_mask = event_mask[:count]
            closing_mask = ~closed & event_mask
            opening_mask = closed & event_mask
            impact_speeds = np.where(
                closing_mask, np.maximum(-rates, LAW["least_speed"]), impact_speeds
            )
            closed = (closed | closing_mask) & ~opening_mask
            over = (over | repeat_mask) & closed & ~closing_mask
            events += [
                Event(t, self.owner[k], -rates[k], -rates[k] / fastest)
                for k in np.flatnonzero(closing_mask)
            ]
        return places, events


def gaps_of(touch: Touch) -> list[tuple[int, int, int, list[float]]]:
    """Return the gaps of a touch: kind, two bodies and numbers."""
    kind, a, b, numbers, (K, e, n) = touch
    law = [K, n, damping(e), damping_ratio(e)]

    def entry(code: int, first: float, second: float, x: float = a.x, y: float = a.y):
        return code, a.body, b.body, [x, y, b.x, b.y, first, second, *law]

    if kind == "pin":
        return [entry(HOLE, numbers[0], 0.0)]
    if kind == "circles":
        return [entry(CIRCLES, -numbers[0] - numbers[1], 0.0)]
    if kind == "line":
        return [entry(LINE, numbers[1], numbers[0])]
    if kind == "stop":  # along X, from below with the normal X and from above with −X
        return [entry(LINE, 0.0, numbers[0]), entry(LINE, math.pi, -numbers[1])]
    if kind == "turn":
        return [entry(TURN, -1.0, -numbers[0]), entry(TURN, 1.0, numbers[1])]
    play, length, height = numbers
    return [
        entry(
            LINE, -wall * math.pi / 2, -height / 2 - play, a.x + end * length / 2,
            a.y + wall * height / 2,
        )
        for end in (-1, 1)
        for wall in (-1, 1)
    ]  # fmt: skip
