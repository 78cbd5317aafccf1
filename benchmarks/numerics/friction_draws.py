"""Mechanisms with friction drawn at random, as data, and their motion between events by SciPy.

`mechanism` makes the model of flexband of a `Draw`; `Reference` integrates x, y and φ of each body
from event to event. A row that sticks is a constraint at the level of accelerations; a row that
slides has the force of its law, with the reactions from the same linear equations. Derivatives of
rows are taken by complex steps, so that none are written down twice.
"""

from __future__ import annotations

import cmath
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

import flexband as fb
from benchmarks.numerics.contact_draws import (
    EVENTS,
    GRAVITY,
    GROUND,
    LAW,
    LONGEST,
    ZERO,
    Part,
    Place,
    PointNames,
    TooLongError,
    Touch,
    contact,
    damping,
    rigid_bodies,
    size_of,
)

MOST = 60_000
"""Most evaluations of the equations of motion for one mechanism."""

STEP = 1e-30
"""Of a derivative along the complex axis."""

REST = 1e-11
"""Sliding speed [m/s] of a row at rest."""


class Coulomb(NamedTuple):
    """Coefficients of friction; the speed of Stribeck is infinite where there is none."""

    kinetic: float
    static: float
    stribeck: float = 0.0
    viscous: float = 0.0

    def coefficient(self, speed: float) -> float:
        """Return µ of a sliding speed."""
        fall = math.exp(-((speed / self.stribeck) ** 2)) if self.stribeck else 0.0
        return self.kinetic + (self.static - self.kinetic) * fall

    def made(self) -> fb.contact.Coulomb:
        """Return the law of flexband."""
        return fb.contact.Coulomb(
            kinetic=self.kinetic, static=self.static, stribeck_speed=self.stribeck or None,
            viscous=self.viscous,
        )  # fmt: skip


Drive = Callable[[float], tuple[float, float, float]]
"""A function of time that returns a travel [m] or an angle [rad], its rate and its acceleration."""


class Link(NamedTuple):
    """A joint: "pin", "slot", "guide", "motor" or "travel", with its axis and its friction.

    `length` is the radius of a pin or the length of a guide [m].
    """

    kind: str
    first: Place
    second: Place
    axis: tuple[float, float] = (1.0, 0.0)
    friction: Coulomb | None = None
    length: float = 0.0
    drive: Drive | None = None


class RoughTouch(NamedTuple):
    """A contact with friction, which may be closed at the start."""

    touch: Touch
    friction: Coulomb
    closed: bool = False


class Brake(NamedTuple):
    """A brake between two bodies; `force` is a function of time."""

    first: Place
    second: Place
    friction: Coulomb
    radius: float
    force: Callable[[float], float]


@dataclass(frozen=True)
class Draw:
    """A mechanism as data."""

    kind: str
    parts: list[Part]
    links: list[Link] = field(default_factory=list)
    touches: list[RoughTouch] = field(default_factory=list)
    springs: list[tuple[Place, Place, float, float]] = field(default_factory=list)
    brakes: list[Brake] = field(default_factory=list)

    @property
    def size(self) -> float:
        """The largest distance between two bodies [m]."""
        return size_of(self.parts)


def mechanism(draw: Draw, velocities: np.ndarray) -> fb.Mechanism:
    """Return the model with these velocities of all bodies, rows of (v_X, v_Y, ω)."""
    at = PointNames(len(draw.parts))
    joints, loads, sensors = {}, {"gravity": fb.Gravity(y=-GRAVITY)}, {}
    for k, link in enumerate(draw.links):
        joints[f"J{k}"] = joint(link, at)
        if link.friction:
            sensors[f"friction J{k}"] = fb.sensors.Friction(f"J{k}")
    for k, (first, second, stiffness, rest) in enumerate(draw.springs):
        loads[f"spring {k}"] = fb.Spring(at(first), at(second), stiffness, rest)
    for k, (touch, friction, closed) in enumerate(draw.touches):
        name = f"T{k}"
        options = {"friction": friction.made(), "closed_at_start": closed}
        loads[name] = contact(touch, at, options)
        sensors[name] = fb.contact.Contacts(name, first=EVENTS + 1)
        sensors[f"friction {name}"] = fb.sensors.Friction(name)
    for k, brake in enumerate(draw.brakes):
        loads[f"B{k}"] = fb.contact.Brake(
            at(brake.first), at(brake.second), friction=brake.friction.made(),
            radius=brake.radius, force=np.vectorize(brake.force, otypes=[float]),
        )  # fmt: skip
        sensors[f"friction B{k}"] = fb.sensors.Friction(f"B{k}")
    bodies = rigid_bodies(draw.parts, velocities, at)
    for name in bodies:
        sensors[f"place {name}"], sensors[f"angle {name}"] = fb.Position(name), fb.Angle(name)
    return fb.Mechanism(bodies=bodies, joints=joints, loads=loads, sensors=sensors)


def joint(link: Link, at: PointNames):
    """Return the joint of flexband."""
    a, b = at(link.first), at(link.second)
    friction = link.friction.made() if link.friction else None
    if link.kind == "motor":
        angle = np.vectorize(lambda t: link.drive(t)[0], otypes=[float])
        return fb.PrescribedRotation(a, angle)
    if link.kind == "travel":
        travel = np.vectorize(lambda t: link.drive(t)[0], otypes=[float])
        return fb.PrescribedTravel(a, b, travel, axis=link.axis)
    rough = {} if friction is None else {"friction": friction}
    if link.kind == "slot":
        return fb.Slot(a, b, axis=link.axis, **rough)
    if link.kind == "pin":
        return fb.Revolute(a, b, **rough, **({"radius": link.length} if rough else {}))
    return fb.Prismatic(a, b, axis=link.axis, **rough, **({"length": link.length} if rough else {}))


# ---- the rows of joints, contacts and friction, all as functions of complex coordinates


def placed(q: np.ndarray, place: Place):
    """Return a point."""
    if place.body == GROUND:
        return place.x, place.y
    x, y, angle = q[3 * place.body : 3 * place.body + 3]
    c, s = cmath.cos(angle), cmath.sin(angle)
    return x + c * place.x - s * place.y, y + s * place.x + c * place.y


def turned(q: np.ndarray, body: int, axis: tuple[float, float]):
    """Return a direction that is given in the axes of a body, and the one to its left."""
    x, y = np.array(axis) / np.hypot(*axis)
    angle = 0.0 if body == GROUND else q[3 * body + 2]
    c, s = cmath.cos(angle), cmath.sin(angle)
    t = c * x - s * y, s * x + c * y
    return t, (-t[1], t[0])


def apart(q: np.ndarray, first: tuple, second: tuple, n: tuple) -> np.ndarray:
    """Return w of n · (v₁ − v₂) = w · v, for two points (body, (X, Y)) that bodies carry along."""
    row = np.zeros(len(q), dtype=complex)
    for (body, (x, y)), sign in ((first, 1.0), (second, -1.0)):
        if body != GROUND:
            k = 3 * body
            row[k : k + 2] += sign * n[0], sign * n[1]
            row[k + 2] += sign * (n[1] * (x - q[k]) - n[0] * (y - q[k + 1]))
    return row


def spin(q: np.ndarray, first: int, second: int, radius: float = 1.0) -> np.ndarray:
    """Return w of r (ω₁ − ω₂)."""
    row = np.zeros(len(q), dtype=complex)
    for body, sign in ((first, radius), (second, -radius)):
        if body != GROUND:
            row[3 * body + 2] += sign
    return row


def rows_of(q: np.ndarray, link: Link) -> list[np.ndarray]:
    """Return the rows of a joint."""
    i, j = link.first.body, link.second.body
    p = placed(q, link.first)
    t, n = turned(q, j, link.axis)
    if link.kind == "pin":
        r = placed(q, link.second)
        return [apart(q, (i, p), (j, r), axis) for axis in ((1.0, 0.0), (0.0, 1.0))]
    if link.kind == "motor":
        return [spin(q, i, GROUND)]
    across = apart(q, (i, p), (j, p), t if link.kind == "travel" else n)
    return [across, spin(q, i, j)] if link.kind == "guide" else [across]


def sliding_row(q: np.ndarray, link: Link) -> np.ndarray:
    """Return w of the sliding speed of a joint."""
    i, j = link.first.body, link.second.body
    if link.kind == "pin":
        return spin(q, i, j, link.length)
    p = placed(q, link.first)
    return apart(q, (i, p), (j, p), turned(q, j, link.axis)[0])


class Meeting(NamedTuple):
    """A gap, and w of its rate and of the sliding speed."""

    gap: complex
    normal: np.ndarray
    sliding: np.ndarray


def meetings(q: np.ndarray, touch: Touch) -> list[Meeting]:
    """Return the gaps of a contact."""
    kind, a, b, numbers, _ = touch
    centre, other = placed(q, a), placed(q, b)
    x, y = centre[0] - other[0], centre[1] - other[1]
    if kind in ("line", "stop"):
        if kind == "line":
            walls = [(numbers[1], numbers[0], 0.0)]
        else:
            walls = [(0.0, 0.0, numbers[0]), (math.pi, 0.0, -numbers[1])]
        of_walls = []
        for angle, radius, height in walls:
            n, _ = turned(q, b.body, (math.cos(angle), math.sin(angle)))
            gap = n[0] * x + n[1] * y - radius - height
            of_walls.append((gap, n, radius, radius + gap, centre))
    else:
        d = cmath.sqrt(x * x + y * y)
        hole = kind == "hole"
        n = (-x / d, -y / d) if hole else (x / d, y / d)
        gap = numbers[1] - numbers[0] - d if hole else d - numbers[0] - numbers[1]
        of_walls = [(gap, n, numbers[0], numbers[0] + gap, centre)]
    found = []
    for gap, n, near, far, (cx, cy) in of_walls:
        p = a.body, (cx - near * n[0], cy - near * n[1])
        r = b.body, (cx - far * n[0], cy - far * n[1])
        found.append(Meeting(gap, apart(q, p, r, n), apart(q, p, r, (-n[1], n[0]))))
    return found


class JammedError(Exception):
    """Friction that has no unique solution."""


class Balance(NamedTuple):
    """Accelerations, forces of friction, their static limits, sliding speeds and their rates."""

    acceleration: np.ndarray
    force: np.ndarray
    limit: np.ndarray
    speed: np.ndarray
    rate: np.ndarray


class Event(NamedTuple):
    """What happens: when, to which load or joint, what, and how far from not happening."""

    time: float
    name: str
    what: str
    share: float


class Reference:
    """The equations of motion of a `Draw` in x, y and φ of its bodies."""

    def __init__(self, draw: Draw):
        self.draw = draw
        self.mass = np.array([[p.mass, p.mass, p.inertia] for p in draw.parts]).ravel()
        self.start = np.array([part.place for part in draw.parts], dtype=float).ravel()
        self.first_row = np.cumsum([0] + [len(rows_of(self.start, link)) for link in draw.links])
        self.rough = [k for k, link in enumerate(draw.links) if link.friction]
        self.gap_touch = [
            k for k, rough in enumerate(draw.touches) for _ in meetings(self.start, rough.touch)
        ]
        self.laws = [link.friction for link in draw.links if link.friction]
        self.laws += [draw.touches[k].friction for k in self.gap_touch]
        self.laws += [brake.friction for brake in draw.brakes]
        self.names = [f"J{k}" for k in self.rough] + [f"T{k}" for k in self.gap_touch]
        self.names += [f"B{k}" for k in range(len(draw.brakes))]
        self.contacts = slice(len(self.rough), len(self.rough) + len(self.gap_touch))
        self.pins = [k for k, row in enumerate(self.rough) if draw.links[row].kind == "pin"]
        self.static = self.coefficients([law.static for law in self.laws])
        self.damping = [damping(rough.touch.law[1]) for rough in draw.touches]
        self.evaluations = 0

    def coefficients(self, mu: list[float]) -> np.ndarray:
        """Return friction over what it is proportional to: sin(arctan µ) of pins, µ of others."""
        values = np.array(mu, dtype=float)
        values[self.pins] = np.sin(np.arctan(values[self.pins]))
        return values

    def joint_rows(self, q: np.ndarray) -> np.ndarray:
        """Return the rows of all joints."""
        rows = [row for link in self.draw.links for row in rows_of(q, link)]
        return np.array(rows, dtype=complex).reshape(-1, len(q))

    def drives(self, t: float, order: int) -> np.ndarray:
        """Return the rates (1) or accelerations (2) of all rows of joints."""
        values = np.zeros(self.first_row[-1])
        for k, link in enumerate(self.draw.links):
            if link.drive:
                values[self.first_row[k]] = link.drive(t)[order]
        return values

    def velocities(self) -> np.ndarray:
        """Return the velocities at the start, those of the parts as far as joints allow them."""
        given = np.array([part.velocity for part in self.draw.parts], dtype=float).ravel()
        J = self.joint_rows(self.start).real
        forces = np.concatenate([self.mass * given, self.drives(0.0, 1)])
        return bordered(self.mass, J, forces)[: len(given)]

    def gaps(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return all gaps and their rates."""
        n = len(self.mass)
        of_all = [m for rough in self.draw.touches for m in meetings(y[:n], rough.touch)]
        gap = np.array([m.gap.real for m in of_all])
        return gap, np.array([m.normal.real @ y[n:] for m in of_all])

    def balance(self, t: float, y: np.ndarray, modes: np.ndarray, begun: np.ndarray) -> Balance:
        """Return the solution for rows that stick (0), slide (±1) or do nothing (NaN)."""
        self.evaluations += 1
        if self.evaluations > MOST:
            raise TooLongError
        n, draw = len(self.mass), self.draw
        v = y[n:]
        q = y[:n] + 1j * STEP * v
        J = self.joint_rows(q)
        F = np.zeros(n)
        F[1::3] = -GRAVITY * self.mass[1::3]
        for a, b, stiffness, rest in draw.springs:
            p, r = placed(q, a), placed(q, b)
            x, z = (p[0] - r[0]).real, (p[1] - r[1]).real
            d = math.hypot(x, z)
            F -= stiffness * (d - rest) * apart(q, (a.body, p), (b.body, r), (x / d, z / d)).real
        W = [sliding_row(q, draw.links[k]) for k in self.rough]
        given = np.zeros(len(self.laws))  # normal forces that do not depend on reactions
        k = self.contacts.start
        for rough, damps in zip(draw.touches, self.damping, strict=True):
            K, _, exponent = rough.touch.law
            for meeting in meetings(q, rough.touch):
                W.append(meeting.sliding)
                if not np.isnan(modes[k]) and meeting.gap.real < 0.0:
                    w = meeting.normal.real
                    damped = 1.0 - damps * (w @ v) / begun[k - self.contacts.start]
                    given[k] = max(K * (-meeting.gap.real) ** exponent * damped, 0.0)
                    F += given[k] * w
                k += 1
        for brake in draw.brakes:
            W.append(spin(q, brake.first.body, brake.second.body, brake.radius))
            given[k] = brake.force(t)
            k += 1
        W = np.array(W, dtype=complex).reshape(-1, n)
        speed, bent = W.real @ v, W.imag @ v / STEP
        sticks, slides = np.flatnonzero(modes == 0), np.flatnonzero(np.abs(modes) == 1)
        rows = np.concatenate([J.real, W.real[sticks]])
        right = np.concatenate([self.drives(t, 2) - J.imag @ v / STEP, -bent[sticks]])
        # columns: what is given, and the forces of friction of 1 N of each row that slides
        columns = np.zeros((n + len(rows), 1 + len(slides)))
        columns[:n, 0], columns[n:, 0] = F, right
        columns[:n, 1:] = -W.real[slides].T
        solution = bordered(self.mass, rows, columns)
        laws = list(zip(self.laws, np.abs(speed), strict=True))
        sign = modes[slides]
        mu = self.coefficients([law.coefficient(u) for law, u in laws])[slides]
        viscous = np.array([law.viscous * u for law, u in laws])[slides]
        f = np.zeros(len(slides))
        for _ in range(50):
            reactions = solution[n : n + len(J)] @ np.concatenate([[1.0], f])
            normal, gradient = self.normal_forces(reactions, given)
            error = f - sign * (mu * normal[slides] + viscous)
            if np.abs(error).max(initial=0.0) <= 1e-13 * (1.0 + np.abs(f).max(initial=0.0)):
                break
            change = np.eye(len(slides))
            change -= (sign * mu)[:, None] * (gradient[slides] @ solution[n : n + len(J), 1:])
            f = f - np.linalg.solve(change, error)
        else:
            raise JammedError
        x = solution @ np.concatenate([[1.0], f])
        force = np.zeros(len(self.laws))
        force[slides], force[sticks] = f, x[n + len(J) :]
        return Balance(x[:n], force, self.static * normal, speed, W.real @ x[:n] + bent)

    def normal_forces(self, reactions: np.ndarray, given: np.ndarray):
        """Return what friction is proportional to, row by row, and its derivative by reactions."""
        value, gradient = given.copy(), np.zeros((len(given), len(reactions)))
        for row, k in enumerate(self.rough):
            first, link = self.first_row[k], self.draw.links[k]
            x = reactions[first : first + 2]
            if link.kind == "pin":
                value[row] = np.hypot(*x)
                gradient[row, first : first + 2] = x / max(value[row], 1e-300)
            elif link.kind == "slot":
                value[row], gradient[row, first] = abs(x[0]), np.sign(x[0])
            else:  # both ends of the guide
                for end in (0.5, -0.5):
                    N = x[0] / 2 + end * 2 * x[1] / link.length
                    value[row] += abs(N)
                    gradient[row, first] += np.sign(N) / 2
                    gradient[row, first + 1] += np.sign(N) * end * 2 / link.length
        return value, gradient

    def settled(
        self, t: float, y: np.ndarray, modes: np.ndarray, begun: np.ndarray, slid: np.ndarray
    ) -> tuple[np.ndarray, float]:
        """Return the modes after those that stick have been examined, and the smallest margin.

        `slid` are signs of rows that have just come to rest, 0 for the others.

        Raises
        ------
        JammedError
            If no set of modes is found.
        """
        modes, released, margin = modes.copy(), np.zeros(len(modes), dtype=bool), math.inf
        for _ in range(4 * len(modes) + 1):
            if not self.independent(y, modes):  # a drive moves on what has come to rest
                forced = np.flatnonzero((slid != 0) & (modes == 0))
                if not len(forced):
                    raise JammedError
                modes[forced[0]] = -slid[forced[0]]
                continue
            found = self.balance(t, y, modes, begun)
            sticks = modes == 0
            ratio = np.where(sticks, np.abs(found.force) / np.maximum(found.limit, 1e-12), 0.0)
            if sticks.any():
                margin = min(margin, float(np.abs(ratio[sticks] - 1.0).min()))
            k = int(np.argmax(ratio))
            if ratio[k] > 1.0 + 1e-9:
                modes[k], released[k] = np.sign(found.force[k]), True
                continue
            back = released & (modes * found.rate < -1e-9 * (1 + np.abs(found.rate)))
            if back.any():
                raise JammedError
            return modes, margin
        raise JammedError

    def motion(self, times: np.ndarray, rtol: float = 1e-11) -> Motion:
        """Return the motion at these times and its events, until there are enough of them.

        Raises
        ------
        TooLongError
            If that takes more than `MOST` evaluations.
        JammedError
            If the modes of friction are not unique.
        """
        self.evaluations = 0
        n, t = len(self.mass), float(times[0])
        y = np.concatenate([self.start, self.velocities()])
        gap, rates = self.gaps(y)
        closed = np.array([self.draw.touches[k].closed for k in self.gap_touch], dtype=bool)
        closed &= gap < 0.0
        begun = np.maximum(-rates, LAW["least_speed"])
        modes, slid = np.zeros(len(self.laws)), np.zeros(len(self.laws))
        modes[self.contacts] = np.where(closed, 0.0, np.nan)
        speed = self.speeds(y)
        modes = np.where(np.isnan(modes) | (np.abs(speed) < REST), modes, np.sign(speed))
        modes, _ = self.settled(t, y, modes, begun, slid)
        kept = Motion.empty(times, n, self.names)
        fastest = 0.0
        while t < times[-1] and len(kept.counted) <= EVENTS:
            watched = self.watched(y, modes, begun, closed)
            part = solve_ivp(
                lambda t, y, m=modes, b=begun: np.concatenate(
                    [y[n:], self.balance(t, y, m, b).acceleration]
                ),
                (t, times[-1]), y, "DOP853", rtol=rtol, atol=0.01 * rtol, max_step=LONGEST * (1 if len(gap) else 5),
                events=watched, dense_output=True,
            )  # fmt: skip
            inside = np.flatnonzero((times >= t) & (times <= part.t[-1]))
            for m in inside:
                state = part.sol(times[m])
                found = self.balance(times[m], state, modes, begun)
                kept.places[m], kept.modes[m] = state[:n], modes
                kept.force[m], kept.speed[m] = found.force, found.speed
            y, t = part.y[:, -1], float(part.t[-1])
            struck = np.array([len(moments) > 0 for moments in part.t_events])
            gap, rates = self.gaps(y)
            fastest = max(fastest, float(np.abs(rates).max(initial=0.0)))
            g = len(gap)
            closing, opening = ~closed & struck[:g], closed & struck[:g]
            begun = np.where(closing, np.maximum(-rates, LAW["least_speed"]), begun)
            closed = (closed | closing) & ~opening
            before = modes.copy()
            speed = self.speeds(y)
            contacts = np.arange(self.contacts.start, self.contacts.stop)
            modes[contacts[closing]] = np.sign(speed[contacts[closing]])
            modes[contacts[opening]] = np.nan
            stopped = struck[g:] & (np.abs(before) == 1)
            stopped[contacts[opening]] = False
            freed = struck[g:] & (before == 0)
            slid = np.where(stopped, before, 0.0)
            modes[stopped] = 0.0
            margin = math.inf
            if freed.any():
                found = self.balance(t, y, before, begun)
                modes[freed & ~np.isnan(modes)] = np.sign(found.force)[freed & ~np.isnan(modes)]
            modes, margin = self.settled(t, y, modes, begun, slid)
            for k in np.flatnonzero(closing):
                share = -rates[k] / fastest
                kept.events.append(Event(t, self.names[contacts[k]], "closes", share))
            for k in np.flatnonzero(opening):
                kept.events.append(Event(t, self.names[contacts[k]], "opens", 1.0))
            for k in range(len(modes)):
                if modes[k] != before[k] and not np.isnan(modes[k]) and not np.isnan(before[k]):
                    what = "sticks" if modes[k] == 0 else "slides" if before[k] == 0 else "turns"
                    kept.events.append(Event(t, self.names[k], what, margin))
        return kept

    def sliding_rows(self, q: np.ndarray) -> np.ndarray:
        """Return w of all sliding speeds."""
        rows = [sliding_row(q, self.draw.links[k]) for k in self.rough]
        rows += [m.sliding for rough in self.draw.touches for m in meetings(q, rough.touch)]
        rows += [spin(q, b.first.body, b.second.body, b.radius) for b in self.draw.brakes]
        return np.array(rows, dtype=complex).real.reshape(-1, len(q))

    def speeds(self, y: np.ndarray) -> np.ndarray:
        """Return all sliding speeds."""
        n = len(self.mass)
        return self.sliding_rows(y[:n]) @ y[n:]

    def independent(self, y: np.ndarray, modes: np.ndarray) -> bool:
        """Return whether the rows of joints and of what sticks are independent."""
        q = y[: len(self.mass)]
        rows = np.concatenate([self.joint_rows(q).real, self.sliding_rows(q)[modes == 0]])
        sizes = np.linalg.svd(rows / np.sqrt(self.mass), compute_uv=False)
        return len(rows) <= len(q) and bool((sizes > 1e-9 * sizes.max(initial=0.0)).all())

    def watched(self, y, modes, begun, closed) -> list:
        """Return the functions whose zeros are events: of gaps, then of rows of friction."""
        gap, _ = self.gaps(y)
        functions = []
        for k in range(len(gap)):
            raised = 0.0 if closed[k] else max(0.0, ZERO - gap[k])
            functions.append(_falling(
                lambda _, y, k=k, a=raised, s=-1.0 if closed[k] else 1.0: s * (
                    a + self.gaps(y)[0][k])
            ))  # fmt: skip
        for k, mode in enumerate(modes):
            if np.isnan(mode):
                functions.append(_falling(lambda _, y: 1.0))
            elif mode:
                functions.append(_falling(lambda _, y, k=k, s=mode: s * self.speeds(y)[k]))
            else:
                functions.append(_falling(
                    lambda t, y, k=k, m=modes.copy(): self._reserve(t, y, m, begun, k)
                ))  # fmt: skip
        return functions

    def _reserve(self, t, y, modes, begun, k) -> float:
        found = self.balance(t, y, modes, begun)
        return found.limit[k] - abs(found.force[k])


@dataclass
class Motion:
    """Coordinates, modes, forces of friction and sliding speeds at times, and events."""

    times: np.ndarray
    places: np.ndarray
    modes: np.ndarray
    force: np.ndarray
    speed: np.ndarray
    names: list[str]
    events: list[Event] = field(default_factory=list)

    @classmethod
    def empty(cls, times: np.ndarray, n: int, names: list[str]) -> Motion:
        """Return a motion without values."""
        rows = [np.full((len(times), len(names)), np.nan) for _ in range(3)]
        return cls(times, np.full((len(times), n), np.nan), *rows, names)

    @property
    def counted(self) -> list[Event]:
        """The events, without contacts that open."""
        return [event for event in self.events if event.what != "opens"]


def _falling(function):
    """Return a function whose falling zeros end an integration."""
    function.terminal, function.direction = True, -1.0
    return function


def bordered(mass: np.ndarray, J: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return x and λ of M x + Jᵀλ and J x, which are one column or several."""
    n, m = len(mass), len(J)
    A = np.zeros((n + m, n + m))
    A[range(n), range(n)] = mass
    A[n:, :n], A[:n, n:] = J, J.T
    return np.linalg.solve(A, right)
