"""The motion of mechanisms with friction, from event to event, by SciPy.

x, y and φ of each body are integrated, so that neither coordinates nor methods are those of the
engine. What sticks is a constraint of the accelerations; what slides has the force of its law, with
the reactions of the same equations.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from scipy.integrate import solve_ivp

from benchmarks.friction.draws import Draw
from benchmarks.friction.rows import (
    meetings,
    normal_force,
    point_at,
    rows_of,
    separation_row,
    sliding_row,
    spin,
)
from benchmarks.numerics.contact_draws import (
    EVENTS,
    GRAVITY,
    LAW,
    LONGEST,
    ZERO,
    TooLongError,
    damping,
    damping_ratio,
    push,
)

MOST = 60_000
"""Most evaluations of the equations of motion for one mechanism."""

STEP = 1e-30
"""Of a derivative along the complex axis."""

REST = 1e-11
"""Sliding speed [m/s] of a row at rest."""


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


class State(NamedTuple):
    """What holds between two events.

    Attributes
    ----------
    modes : of all rows of friction, 0 if one sticks, ±1 if it slides, NaN if its contact is open.
    closed, impact_speeds : whether gaps are closed, and the speeds with which they closed.
    over : whether they have been pressed in again since.
    """

    modes: np.ndarray
    closed: np.ndarray
    impact_speeds: np.ndarray
    over: np.ndarray


class Reference:
    """The equations of motion of a `Draw` in x, y and φ of its bodies."""

    def __init__(self, draw: Draw):
        self.draw = draw
        self.mass = np.array([[p.mass, p.mass, p.inertia] for p in draw.parts]).ravel()
        self.start = np.array([part.place for part in draw.parts], dtype=float).ravel()
        self.first_row = np.cumsum([0] + [len(rows_of(self.start, link)) for link in draw.links])
        self.rough_links = [k for k, link in enumerate(draw.links) if link.friction]
        self.gap_touch = [
            k
            for k, rough_touch in enumerate(draw.touches)
            for _ in meetings(self.start, rough_touch.touch)
        ]
        self.laws = [link.friction for link in draw.links if link.friction]
        self.laws += [draw.touches[k].friction for k in self.gap_touch]
        self.laws += [brake.friction for brake in draw.brakes]
        self.names = [f"J{k}" for k in self.rough_links] + [f"T{k}" for k in self.gap_touch]
        self.names += [f"B{k}" for k in range(len(draw.brakes))]
        self.contacts = slice(len(self.rough_links), len(self.rough_links) + len(self.gap_touch))
        self.pins = [k for k, row in enumerate(self.rough_links) if draw.links[row].kind == "pin"]
        self.static = self.coefficients([law.static for law in self.laws])
        self.kinetic = self.coefficients([law.kinetic for law in self.laws])
        self.damping = [
            (damping(rough_touch.touch.law[1]), damping_ratio(rough_touch.touch.law[1]))
            for rough_touch in draw.touches
        ]
        self.evaluations = 0
        self.fastest = 0.0

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
        part_velocities = np.array([part.velocity for part in self.draw.parts], dtype=float).ravel()
        J = self.joint_rows(self.start).real
        forces = np.concatenate([self.mass * part_velocities, self.drives(0.0, 1)])
        return bordered(self.mass, J, forces)[: len(part_velocities)]

    def gaps(self, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return all gaps and their rates."""
        n = len(self.mass)
        of_all = [
            m for rough_touch in self.draw.touches for m in meetings(y[:n], rough_touch.touch)
        ]
        gap = np.array([m.gap.real for m in of_all])
        return gap, np.array([m.normal.real @ y[n:] for m in of_all])

    def applied_forces(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return weights and the forces of springs."""
        F = np.zeros(len(self.mass))
        F[1::3] = -GRAVITY * self.mass[1::3]
        for a, b, stiffness, rest in self.draw.springs:
            p = point_at(q, a)
            r = point_at(q, b)
            x = (p[0] - r[0]).real
            y = (p[1] - r[1]).real
            d = math.hypot(x, y)
            F -= (
                stiffness
                * (d - rest)
                * separation_row(q, (a.body, p), (b.body, r), (x / d, y / d)).real
            )
        return F

    def contact_forces(self, t: float, q: np.ndarray, v: np.ndarray, state: State):
        """Return normal forces that do not depend on reactions, and the forces of contacts."""
        normal = np.zeros(len(self.laws))
        F = np.zeros(len(self.mass))
        k = 0
        J = self.joint_rows(q).real
        for rough_touch, damps in zip(self.draw.touches, self.damping, strict=True):
            K, _, exponent = rough_touch.touch.law
            for meeting in meetings(q, rough_touch.touch):
                depth = -meeting.gap.real
                w = meeting.normal.real
                if state.closed[k] and depth > 0.0:
                    response = bordered(self.mass, J, np.concatenate([w, np.zeros(len(J))]))
                    law = (K, exponent, *damps)
                    mass = 1.0 / (w @ response[: len(w)])
                    force = push(depth, -(w @ v), law, state.impact_speeds[k], state.over[k], mass)
                    normal[self.contacts.start + k] = force
                    F += normal[self.contacts.start + k] * w
                k += 1
        normal[self.contacts.stop :] = [brake.force(t) for brake in self.draw.brakes]
        return normal, F

    def balance(self, t: float, y: np.ndarray, state: State) -> Balance:
        """Return accelerations and forces of friction."""
        self.evaluations += 1
        if self.evaluations > MOST:
            raise TooLongError
        n = len(self.mass)
        v = y[len(self.mass) :]
        q = y[:n] + 1j * STEP * v
        J = self.joint_rows(q)
        W = self.sliding_rows(q)
        fixed_normals, F = self.contact_forces(t, q, v, state)
        speed = W.real @ v
        drift = W.imag @ v / STEP
        sticks = np.flatnonzero(state.modes == 0)
        slides = np.flatnonzero(abs(state.modes) == 1)
        rows = np.concatenate([J.real, W.real[sticks]])
        # one column of the applied loads, and one for 1 N of friction of each row that slides
        columns = np.zeros((n + len(rows), 1 + len(slides)))
        columns[:n, 0] = F + self.applied_forces(q, v)
        columns[n : n + len(J), 0] = self.drives(t, 2) - J.imag @ v / STEP
        columns[n + len(J) :, 0] = -drift[sticks]
        columns[:n, 1:] = -W.real[slides].T
        solution = bordered(self.mass, rows, columns)
        sliding = self.sliding_coefficients(slides, state.modes, speed)
        f, normal = self.friction(solution[n : n + len(J)], fixed_normals, slides, *sliding)
        x = solution @ np.concatenate([[1.0], f])
        force = np.zeros(len(self.laws))
        force[slides] = f
        force[sticks] = x[n + len(J) :]
        return Balance(x[:n], force, self.static * normal, speed, W.real @ x[:n] + drift)

    def sliding_coefficients(self, slides: np.ndarray, modes: np.ndarray, speed: np.ndarray):
        """Return ±µ and the viscous forces of what slides."""
        fall = np.array([
            law.fall(abs(u)) for law, u in zip(self.laws, speed, strict=True)
        ])  # fmt: skip
        mu = self.kinetic + (self.static - self.kinetic) * fall
        viscous = np.array([law.viscous for law in self.laws]) * np.abs(speed)
        return (modes * mu)[slides], (modes * viscous)[slides]

    def friction(self, of_joints, fixed_normals, slides, mu, viscous):
        """Return f = ± µ N + viscous of what slides, by Newton's method, and all N.

        The reactions of joints are affine in f: `of_joints` has their values and derivatives.
        """
        f = np.zeros(len(slides))
        for _ in range(50):
            normal, gradient = self.normal_forces(
                of_joints[:, 0] + of_joints[:, 1:] @ f, fixed_normals
            )
            error = f - mu * normal[slides] - viscous
            if np.abs(error).max(initial=0.0) <= 1e-13 * (1.0 + np.abs(f).max(initial=0.0)):
                return f, normal
            change = np.eye(len(f)) - mu[:, None] * (gradient[slides] @ of_joints[:, 1:])
            f = f - np.linalg.solve(change, error)
        raise JammedError

    def normal_forces(self, reactions: np.ndarray, fixed_normals: np.ndarray):
        """Return what friction is proportional to, row by row, and its derivative by reactions."""
        value = fixed_normals.copy()
        gradient = np.zeros((len(fixed_normals), len(reactions)))
        for row, k in enumerate(self.rough_links):
            first = self.first_row[k]
            link = self.draw.links[k]
            count = 1 if link.kind == "slot" else 2
            part = slice(first, first + count)
            value[row], gradient[row, part] = normal_force(link, reactions[part])
        return value, gradient

    def settle_modes(
        self,
        t: float,
        y: np.ndarray,
        state: State,
        former_modes: np.ndarray,
        release_mask: np.ndarray,
    ) -> tuple[State, float]:
        """Return the state after those that stick have been examined, and the smallest margin.

        `former_modes` are those of rows that have just come to rest, 0 for the others, and
        `release_mask` tells which rows begin to slide.

        Raises
        ------
        JammedError
            If no modes are found with which all is as it should be.
        """
        modes = state.modes.copy()
        release_mask = release_mask.copy()
        margin = math.inf
        for _ in range(4 * len(modes) + 1):
            if not self.is_independent(y, modes):  # a drive moves on what has come to rest
                forced_rows = np.flatnonzero((former_modes != 0) & (modes == 0))
                if not len(forced_rows):
                    raise JammedError
                modes[forced_rows[0]] = -former_modes[forced_rows[0]]
                continue
            trial = self.balance(t, y, state._replace(modes=modes))
            sticks = modes == 0
            ratio = np.where(sticks, np.abs(trial.force) / np.maximum(trial.limit, 1e-12), 0.0)
            margin = np.abs(ratio[sticks] - 1.0).min(initial=margin)
            if ratio.max(initial=0.0) > 1.0 + 1e-9:
                k = int(np.argmax(ratio))
                modes[k] = np.sign(trial.force[k])
                release_mask[k] = True
                continue
            if (release_mask & (modes * trial.rate < -1e-9 * (1 + np.abs(trial.rate)))).any():
                raise JammedError
            return state._replace(modes=modes), float(margin)
        raise JammedError

    def begin(self, y: np.ndarray) -> State:
        """Return the state at the start."""
        gap, rates = self.gaps(y)
        closed = np.array([self.draw.touches[k].closed for k in self.gap_touch], dtype=bool)
        closed &= gap < 0.0
        speed = self.speeds(y)
        zeros = np.zeros(len(self.laws))
        modes = np.where(np.abs(speed) < REST, 0.0, np.sign(speed))
        modes[self.contacts] = np.where(closed, modes[self.contacts], np.nan)
        state = State(modes, closed, np.maximum(-rates, LAW["least_speed"]), closed & False)
        return self.settle_modes(0.0, y, state, zeros, zeros > 0)[0]

    def after(
        self, t: float, y: np.ndarray, state: State, event_mask: np.ndarray
    ) -> tuple[State, list]:
        """Return the state after events, given which `event_functions` struck, and the events."""
        count = len(state.closed)
        old_modes = state.modes
        _, rates = self.gaps(y)
        # Contacts that open or close.
        closing_mask = ~state.closed & event_mask[:count]
        opening_mask = state.closed & event_mask[:count]
        modes = old_modes.copy()
        speed = self.speeds(y)
        of_contacts = modes[self.contacts]
        of_contacts[closing_mask] = np.sign(speed[self.contacts][closing_mask])
        of_contacts[opening_mask] = np.nan
        modes[self.contacts] = of_contacts
        # Rows that come to rest or begin to slide.
        friction_events = event_mask[count : count + len(self.names)]
        former_modes = np.where(
            friction_events & (np.abs(old_modes) == 1) & ~np.isnan(modes), old_modes, 0.0
        )
        modes[former_modes != 0] = 0.0
        release_mask = friction_events & (old_modes == 0) & ~np.isnan(modes)
        if release_mask.any():
            modes[release_mask] = np.sign(self.balance(t, y, state).force[release_mask])
        impact_speeds = np.where(
            closing_mask, np.maximum(-rates, LAW["least_speed"]), state.impact_speeds
        )
        closed = (state.closed | closing_mask) & ~opening_mask
        over = (state.over | event_mask[count + len(self.names) :]) & closed & ~closing_mask
        state, margin = self.settle_modes(
            t, y, State(modes, closed, impact_speeds, over), former_modes, release_mask
        )
        self.fastest = max(self.fastest, float(np.abs(rates).max(initial=0.0)))
        names = self.names[self.contacts]
        # Name the events.
        events = [
            Event(t, names[k], "closes", -rates[k] / self.fastest)
            for k in np.flatnonzero(closing_mask)
        ]
        events += [Event(t, names[k], "opens", 1.0) for k in np.flatnonzero(opening_mask)]
        for name, old, new in zip(self.names, old_modes, state.modes, strict=True):
            if old != new and not np.isnan([old, new]).any():
                what = "sticks" if new == 0 else "slides" if old == 0 else "turns"
                events.append(Event(t, name, what, margin))
        return state, events

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
        self.fastest = 0.0
        n = len(self.mass)
        t = float(times[0])
        y = np.concatenate([self.start, self.velocities()])
        state = self.begin(y)
        result = Motion.empty(times, n, self.names)
        longest = LONGEST if self.draw.touches else 5 * LONGEST
        while t < times[-1] and len(result.counted_events) <= EVENTS:

            def derivative(t, y, state=state):
                return np.concatenate([y[n:], self.balance(t, y, state).acceleration])

            part = solve_ivp(
                derivative, (t, times[-1]), y, "DOP853", rtol=rtol, atol=0.01 * rtol,
                max_step=longest, events=self.event_functions(y, state), dense_output=True,
            )  # fmt: skip
            for m in np.flatnonzero((times >= t) & (times <= part.t[-1])):
                at_time = part.sol(times[m])
                balance = self.balance(times[m], at_time, state)
                result.places[m] = at_time[:n]
                result.modes[m] = state.modes
                result.force[m] = balance.force
                result.speed[m] = balance.speed
            y = part.y[:, -1]
            t = float(part.t[-1])
            event_mask = np.array([len(moments) > 0 for moments in part.t_events])
            if event_mask.any():
                state, events = self.after(t, y, state, event_mask)
                result.events += events
        return result

    def sliding_rows(self, q: np.ndarray) -> np.ndarray:
        """Return w of all sliding speeds."""
        rows = [sliding_row(q, self.draw.links[k]) for k in self.rough_links]
        rows += [
            m.sliding for rough_touch in self.draw.touches for m in meetings(q, rough_touch.touch)
        ]
        rows += [spin(q, b.first.body, b.second.body, b.radius) for b in self.draw.brakes]
        return np.array(rows, dtype=complex).reshape(-1, len(q))

    def speeds(self, y: np.ndarray) -> np.ndarray:
        """Return all sliding speeds."""
        n = len(self.mass)
        return self.sliding_rows(y[:n]).real @ y[n:]

    def is_independent(self, y: np.ndarray, modes: np.ndarray) -> bool:
        """Return whether the rows of joints and of what sticks are independent."""
        q = y[: len(self.mass)]
        rows = np.concatenate([self.joint_rows(q).real, self.sliding_rows(q).real[modes == 0]])
        sizes = np.linalg.svd(rows / np.sqrt(self.mass), compute_uv=False)
        return len(rows) <= len(q) and bool((sizes > 1e-9 * sizes.max(initial=0.0)).all())

    def event_functions(self, y: np.ndarray, state: State) -> list:
        """Return the functions whose zeros are events: of gaps, then of rows of friction."""
        functions = []
        for k, (gap, closed) in enumerate(zip(self.gaps(y)[0], state.closed, strict=True)):
            sign, offset = (-1.0, 0.0) if closed else (1.0, max(0.0, ZERO - gap))
            functions.append(
                lambda _, y, k=k, sign=sign, offset=offset: sign * (offset + self.gaps(y)[0][k])
            )
        for k, mode in enumerate(state.modes):
            if np.isnan(mode):
                functions.append(lambda *_: 1.0)
            elif mode:
                functions.append(lambda _, y, k=k, sign=mode: sign * self.speeds(y)[k])
            else:
                functions.append(lambda t, y, k=k: self.reserve(t, y, state, k))
        for k in range(len(state.closed)):
            impact = state.closed[k] and not state.over[k]
            functions.append((lambda _, y, k=k: self.gaps(y)[1][k]) if impact else (lambda *_: 1.0))
        for function in functions:
            function.terminal = True
            function.direction = -1.0
        return functions

    def reserve(self, t: float, y: np.ndarray, state: State, k: int) -> float:
        """Return how much more a row that sticks can hold."""
        balance = self.balance(t, y, state)
        return balance.limit[k] - abs(balance.force[k])


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
    def counted_events(self) -> list[Event]:
        """The events, without contacts that open."""
        return [event for event in self.events if event.what != "opens"]


def bordered(mass: np.ndarray, J: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return x and λ of M x + Jᵀλ and J x, which are one column or several."""
    n = len(mass)
    m = len(J)
    A = np.zeros((n + m, n + m))
    A[range(n), range(n)] = mass
    A[n:, :n] = J
    A[:n, n:] = J.T
    return np.linalg.solve(A, right)
