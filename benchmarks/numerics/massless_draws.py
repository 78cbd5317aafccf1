"""Mechanisms of rigid bodies drawn at random, as data, and their exact motion.

A mechanism is drawn as a list of bodies, joints and springs. `mechanism` makes the model of
flexband of it; `Reference` integrates x, y and φ of each body as an ordinary differential equation,
so that it shares neither coordinates nor methods with the engine.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import flexband as fb

GRAVITY = 9.81
SINGULAR = 3e-2
"""Motions of what has mass, as a share of those of all, below which the reference is not exact."""

OPEN = 1e-6
"""Distance of pins, relative to the mechanism, beyond which the reference has left its joints."""

SENSITIVE = 1e-3
"""Difference of two integrations of the reference [m or rad] beyond which it tells nothing."""

BETWEEN = 10
"""Places between two times where the reference is checked."""

INDEPENDENT = 1e-7
"""Relative size of singular values of independent constraints; others are rounding and drift."""


@dataclass(frozen=True)
class Part:
    """A rigid body: mass, inertia (None for a point mass), points in its axes, place and angle."""

    mass: float
    inertia: float | None
    points: dict[str, tuple[float, float]]
    place: tuple[float, float]
    angle: float


Place = tuple[str, str] | tuple[float, float]
"""A point of a body, or of the ground."""


@dataclass(frozen=True)
class Draw:
    """A mechanism as data; a joint is its kind, two places and further numbers."""

    kind: str
    parts: dict[str, Part]
    joints: dict[str, tuple[Any, ...]]
    springs: list[tuple[Any, ...]] = field(default_factory=list)

    @property
    def size(self) -> float:
        """The largest distance between two bodies [m]."""
        places = np.array([part.place for part in self.parts.values()])
        return float(np.hypot(*np.ptp(places, axis=0))) or 1.0


def rod(start: Sequence[float], end: Sequence[float], mass: float, inertia: float) -> Part:
    """Return a straight body between two points, with its centre in the middle."""
    (x0, y0), (x1, y1) = start, end
    half = 0.5 * float(np.hypot(x1 - x0, y1 - y0))
    points = {"start": (-half, 0.0), "end": (half, 0.0), "centre": (0.0, 0.0)}
    angle = float(np.arctan2(y1 - y0, x1 - x0))
    return Part(mass, inertia, points, (0.5 * (x0 + x1), 0.5 * (y0 + y1)), angle)


def mechanism(draw: Draw) -> fb.Mechanism:
    """Return the model; sensors are x, y and angle of each body, then the force of each joint."""
    loads: dict[str, Any] = {"gravity": fb.Gravity(y=-GRAVITY)}
    bodies = {}
    joints = {}
    sensors: dict[str, Any] = {}

    def point_name(place: Place) -> Any:
        if not isinstance(place[0], str):
            return place
        return place[0] if draw.parts[place[0]].inertia is None else f"{place[0]}.{place[1]}"

    # Bodies.
    for name, part in draw.parts.items():
        sensors[f"place {name}"] = fb.Position(name)
        if part.inertia is None:
            bodies[name] = fb.PointMass(mass=part.mass, position=part.place)
        else:
            sensors[f"angle {name}"] = fb.Angle(name)
            bodies[name] = fb.RigidBody(
                mass=part.mass, inertia=part.inertia, points=part.points, position=part.place,
                angle=part.angle,
            )  # fmt: skip
    # Joints.
    kinds: dict[str, Callable] = {
        "pin": fb.Revolute,
        "weld": fb.Weld,
        "slot": fb.Slot,
        "slide": fb.Prismatic,
        "rod": fb.Distance,
        "motor": lambda a, _, rate: fb.PrescribedRotation(a, drive(draw, a.split(".")[0], rate)),
    }
    for name, (kind, first, second, *numbers) in draw.joints.items():
        joints[name] = kinds[kind](point_name(first), point_name(second), *numbers)
        if kind != "motor":
            sensors[f"force {name}"] = fb.Reaction(name)
    # Springs.
    for k, (kind, first, second, *numbers) in enumerate(draw.springs):
        spring = fb.Spring if kind == "line" else fb.TorsionSpring
        stiffness, rest, damping = numbers
        of_rest = {"rest_length" if kind == "line" else "rest_angle": rest}
        loads[f"spring {k}"] = spring(
            point_name(first), point_name(second), stiffness, damping=damping, **of_rest
        )
    return fb.Mechanism(bodies=bodies, joints=joints, loads=loads, sensors=sensors)


def drive(draw: Draw, body: str, rate: float) -> Callable:
    """Return the angle of a body that turns at constant rate."""
    return lambda t: draw.parts[body].angle + rate * t


class Reference:
    """The equations of motion of a `Draw` in x, y and φ of its bodies."""

    def __init__(self, draw: Draw):
        self.draw = draw
        self.row = {name: 3 * k for k, name in enumerate(draw.parts)}
        parts = draw.parts.values()
        self.start = np.array([[*part.place, part.angle] for part in parts]).ravel()
        turning = [1.0 if part.inertia is None else part.inertia for part in parts]
        masses = [part.mass for part in parts]
        self.mass = np.stack([masses, masses, turning], axis=1).ravel()
        self.turns = {}
        for kind, first, second, _, rest, _ in draw.springs:
            if kind == "turn":
                relative_angle = (
                    self.rotation(first, self.start)[0] - self.rotation(second, self.start)[0]
                )
                self.turns[first[0]] = 2 * np.pi * np.round((relative_angle - rest) / (2 * np.pi))
        self.gravity = np.array([[0.0, -GRAVITY * part.mass, 0.0] for part in parts]).ravel()

    def point(self, place: Place, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return a point and its derivative by q, (2, coordinates)."""
        J = np.zeros((2, len(q)))
        if not isinstance(place[0], str):
            return np.array(place, dtype=float), J
        i, (x, y) = self.row[place[0]], self.draw.parts[place[0]].points[str(place[1])]
        c = np.cos(q[i + 2])
        s = np.sin(q[i + 2])
        J[:, i : i + 2] = np.eye(2)
        J[:, i + 2] = -s * x - c * y, c * x - s * y
        return np.array([q[i] + c * x - s * y, q[i + 1] + s * x + c * y]), J

    def rotation(self, place: Place, q: np.ndarray) -> tuple[float, np.ndarray]:
        """Return the angle of a body, or 0, and its derivative by q."""
        J = np.zeros(len(q))
        if not isinstance(place[0], str):
            return 0.0, J
        J[self.row[place[0]] + 2] = 1.0
        return q[self.row[place[0]] + 2], J

    def rows(self, q: np.ndarray) -> tuple[np.ndarray, dict[str, slice]]:
        """Return Φ_q, and the rows of each joint; those of forces are by unit vectors."""
        rows = []
        of = {}
        for name, (kind, first, second, *numbers) in self.draw.joints.items():
            begin = len(rows)
            (r1, J1), (r2, J2) = self.point(first, q), self.point(second, q)
            (_, W1), (angle, W2) = self.rotation(first, q), self.rotation(second, q)
            if kind in ("pin", "weld"):
                rows += [*(J1 - J2)]
            if kind == "rod":
                unit = (r1 - r2) / np.hypot(*(r1 - r2))
                rows.append(unit @ (J1 - J2))
            if kind in ("slot", "slide"):
                axis = numbers[0]
                c = np.cos(angle)
                s = np.sin(angle)
                n = np.array([-s * axis[0] - c * axis[1], c * axis[0] - s * axis[1]])
                n /= np.hypot(*n)
                tangent = np.array([-n[1], n[0]])
                rows.append(n @ (J1 - J2) + tangent @ (r1 - r2) * W2)
            if kind in ("weld", "slide", "motor"):
                rows.append(W1 - W2)
            of[name] = slice(begin, len(rows))
        return np.array(rows), of

    def rate(self) -> np.ndarray:
        """Return Φ_q v, which is constant in time."""
        rates = []
        for kind, *_, number in self.draw.joints.values():
            count = {"pin": 2, "weld": 3, "slot": 1, "slide": 2, "rod": 1, "motor": 1}[kind]
            rates += [number if kind == "motor" else 0.0] * count
        return np.array(rates)

    def forces(self, q: np.ndarray, v: np.ndarray) -> np.ndarray:
        """Return the generalized forces of gravity and springs."""
        Q = self.gravity.copy()
        for kind, first, second, stiffness, rest, damping in self.draw.springs:
            if kind == "line":
                (r1, J1), (r2, J2) = self.point(first, q), self.point(second, q)
                length = np.hypot(*(r1 - r2))
                J = (r1 - r2) / length @ (J1 - J2)
                Q -= J * (stiffness * (length - rest) + damping * (J @ v))
            else:
                (a1, W1), (a2, W2) = self.rotation(first, q), self.rotation(second, q)
                turn = a1 - a2 - rest - self.turns[first[0]]
                Q -= (W1 - W2) * (stiffness * turn + damping * ((W1 - W2) @ v))
        return Q

    def solve_constrained(self, q: np.ndarray, forces: np.ndarray, right: np.ndarray):
        """Return x and λ of M x + Φ_qᵀλ = forces and Φ_q x = right.

        x is a solution of the constraints and a motion that they allow, so that light bodies are as
        accurate as heavy ones; λ are the least where constraints are redundant.
        """
        J, _ = self.rows(q)
        U, sizes, V = np.linalg.svd(J)
        rank = int(np.sum(sizes > INDEPENDENT * sizes[0]))
        x = V[:rank].T @ (U[:, :rank].T @ right / sizes[:rank])
        null_space = V[rank:].T
        reduced_mass = null_space.T @ (self.mass[:, None] * null_space)
        x += null_space @ np.linalg.solve(reduced_mass, null_space.T @ (forces - self.mass * x))
        return x, U[:, :rank] @ (V[:rank] @ (forces - self.mass * x) / sizes[:rank])

    def accelerations(self, q: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return q̈ and λ."""
        h = 1e-6 / max(1.0, float(np.abs(v).max()))
        drift = (self.rows(q + h * v)[0] - self.rows(q - h * v)[0]) @ v / (2 * h)
        return self.solve_constrained(q, self.forces(q, v), -drift)

    def largest_gap(self, q: np.ndarray) -> float:
        """Return the largest distance between the points of a pin, relative to the mechanism."""
        pins = [j for j in self.draw.joints.values() if j[0] in ("pin", "weld")]
        gaps = [self.point(a, q)[0] - self.point(b, q)[0] for _, a, b, *_ in pins]
        return float(np.max(np.abs(gaps), initial=0.0)) / self.draw.size

    def determinacy(self, q: np.ndarray) -> float:
        """Return how well masses and joints determine the motion, 0 if they do not.

        It is the smallest displacement of what has mass in a motion of all, as a share of it.
        """
        J, _ = self.rows(q)
        size = np.tile([self.draw.size, self.draw.size, 1.0], len(q) // 3)
        scaled = J * size
        scaled = scaled / np.maximum(np.linalg.norm(scaled, axis=1, keepdims=True), 1e-300)
        _, sizes, directions = np.linalg.svd(scaled)
        null_space = directions[int(np.sum(sizes > INDEPENDENT * sizes[0])) :]
        if not len(null_space) or not np.any(self.mass > 0):
            return float(not len(null_space))
        return float(np.linalg.svd(null_space[:, self.mass > 0])[1][len(null_space) - 1 :].sum())

    def is_redundant(self, q: np.ndarray) -> bool:
        """Return whether constraints depend on each other."""
        sizes = np.linalg.svd(self.rows(q)[0], compute_uv=False)
        return bool(sizes[-1] < INDEPENDENT * sizes[0] or len(self.rows(q)[0]) > len(q))

    def velocity(self) -> np.ndarray:
        """Return the velocities at the start: those of drives, with the least kinetic energy."""
        return self.solve_constrained(self.start, np.zeros(len(self.start)), self.rate())[0]

    def motion(self, times: np.ndarray) -> dict[str, np.ndarray] | None:
        """Return the outputs of `mechanism` at these times, or None if this cannot tell them.

        That is where masses hardly determine the motion, drives ask for what joints do not allow,
        or the motion is so sensitive that tolerances of the integration matter.
        """
        n = len(self.start)
        begin = np.concatenate([self.start, self.velocity()])

        def derivative(_, y):
            return np.concatenate([y[n:], self.accelerations(y[:n], y[n:])[0]])

        # Integrate twice; what is sensitive or singular has no reference.
        coarse, fine = (
            solve_ivp(
                derivative, (0.0, float(times[-1])), begin, method, dense_output=True,
                rtol=tolerance, atol=0.1 * tolerance, max_step=0.02,
            )
            for method, tolerance in (("RK45", 1e-6), ("DOP853", 1e-9))
        )  # fmt: skip
        if not (coarse.success and fine.success):
            return None
        check_times = np.linspace(times[0], times[-1], BETWEEN * (len(times) - 1) + 1)
        places = fine.sol(check_times)[:n].T
        if np.abs(coarse.sol(check_times)[:n].T - places).max() > SENSITIVE:
            return None
        if (
            max(map(self.largest_gap, places)) > OPEN
            or min(map(self.determinacy, places)) < SINGULAR
        ):
            return None
        # Collect places, angles and forces of joints.
        outputs: dict[str, list] = {}
        for state in fine.sol(times).T:
            q = state[:n]
            v = state[n:]
            _, forces = self.accelerations(q, v)
            J, of = self.rows(q)
            for name, i in self.row.items():
                outputs.setdefault(f"place {name}_X", []).append(q[i])
                outputs.setdefault(f"place {name}_Y", []).append(q[i + 1])
                outputs.setdefault(f"angle {name}", []).append(q[i + 2])
            for name, (kind, first, *_) in self.draw.joints.items():
                if kind == "motor":
                    continue
                rows = J[of[name]]
                place = self.row[first[0]]
                count = {"pin": 2, "weld": 2, "slot": 1, "slide": 1, "rod": 1}[kind]
                force = -(forces[of[name]][:count] @ rows[:count, place : place + 2])
                outputs.setdefault(f"force {name}_X", []).append(force[0])
                outputs.setdefault(f"force {name}_Y", []).append(force[1])
        return {name: np.array(values) for name, values in outputs.items()}
