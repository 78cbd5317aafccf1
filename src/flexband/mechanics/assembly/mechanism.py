"""A mechanism: bodies, joints, loads and sensors by name. It is plain data."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from flexband.arguments import Fixed, frozen
from flexband.errors import (
    InputError,
    check_finite,
    check_instance,
    check_integer,
    shown,
    warn,
)
from flexband.mechanics.assembly.parts import (
    check_body,
    check_entries,
    check_forms,
    check_outputs,
    entered,
    naming,
    owned_parts,
)
from flexband.mechanics.assembly.turns import drawn_angle, nearest
from flexband.mechanics.bodies.body import Body
from flexband.mechanics.bodies.body import point as ground_point
from flexband.mechanics.bodies.centre_line import CentreLine
from flexband.mechanics.bodies.properties import Property
from flexband.mechanics.contact.friction import Activity, FrictionEntry
from flexband.mechanics.joints.joint import Joint, PointName, body_and_point
from flexband.mechanics.joints.placement import placed
from flexband.mechanics.kernels.forms import (
    Form,
    Frame,
    GeneralizedForce,
    Polar,
    Vector,
    add,
    at_point,
    constraint_force,
    moves,
    scale,
)
from flexband.mechanics.kernels.state import (
    FRICTION_ROWS,
    State,
    friction_rows,
    reaction_rows,
    rows_of_gaps,
)
from flexband.mechanics.loads.contacts import contact_entries
from flexband.mechanics.loads.load import (
    Entries,
    FollowingEntry,
    LawEntry,
    Load,
    MomentEntry,
    PairLoad,
    SpringEntry,
)
from flexband.mechanics.loads.springs import spring_entries
from flexband.mechanics.sensors.extremes import OverSteps
from flexband.mechanics.sensors.motion import ContactRows, FrictionRows, Sensor
from flexband.words import with_article


class Watched(NamedTuple):
    """A form of which a sensor wants an extreme or the integral in a window of time [s]."""

    form: Form
    kind: int
    times: tuple[float, float]
    sensor: OverSteps


@frozen(kw_only=True)
class Mechanism:
    """A planar mechanism of rigid bodies, point masses, beams and cables.

    Parameters
    ----------
    bodies, joints, loads, sensors : name -> object. A sensor named "F" gives outputs such as "F_X"
        and "F_Y". The mechanism keeps copies, so that changing a mapping or an array later does
        not change it.
    branches : body name -> angle [rad] from which the turns of its angle are counted, in place of
        the given one. Studies pass what they know of the nominal inputs.

    Raises
    ------
    InputError
        If there is no body, two outputs have one name, or a joint, load or sensor names something
        that the mechanism lacks. So do all methods that look up a name.
    """

    bodies: Mapping[str, Body]
    joints: Mapping[str, Joint] = field(default_factory=dict)
    loads: Mapping[str, Load] = field(default_factory=dict)
    sensors: Mapping[str, Sensor] = field(default_factory=dict)
    branches: Mapping[str, ArrayLike] = field(default_factory=dict)

    def __post_init__(self) -> None:
        kinds = ("body", Body), ("joint", Joint), ("load", Load), ("sensor", Sensor)
        for name, (kind, base) in zip(("bodies", "joints", "loads", "sensors"), kinds, strict=True):
            object.__setattr__(self, name, owned_parts(name, kind, base, getattr(self, name)))
        if not self.bodies:
            raise InputError("a Mechanism needs at least one body; got none")
        for name, body in self.bodies.items():
            naming(f"body {name!r}", check_body, body)
        object.__setattr__(self, "bodies", Fixed(self._divided()))
        check_instance("branches", self.branches, Mapping, "a mapping from names to angles")
        object.__setattr__(self, "branches", Fixed(self.branches))
        for name, angle in self.branches.items():
            _within("body", name, self.bodies)
            check_finite(f"branches[{name!r}] [rad]", angle)
        for name, joint in self.joints.items():
            naming(f"joint {name!r}", self._check_joint, joint)
        for name in self.loads:
            naming(f"load {name!r}", check_entries, self.entries[name], self.state)
            self.forces(name)
        check_outputs(self.sensors)
        for name, sensor in self.sensors.items():
            rows, count = naming(f"sensor {name!r}", sensor.rows, self), len(self.watched)
            naming(f"sensor {name!r}", check_forms, "rows", rows, self.state.rows + count)

    def _divided(self) -> dict[str, Body]:
        """Return the bodies, divided where joints and loads act."""
        points: dict[str, list[str]] = {name: [] for name in self.bodies}
        for part in (*self.joints.values(), *self.loads.values()):
            for body, point in map(body_and_point, part.points):
                if body in points:
                    points[body].append(point)
        return {name: body.divided(points[name]) for name, body in self.bodies.items()}

    def _check_joint(self, joint: Joint) -> None:
        rows, count = joint.constraints(self.frame), sum(body.size for body in self.bodies.values())
        check_forms("constraints", rows, 1 + count)
        self._check_points(joint)
        kind = with_article(type(joint).__name__)
        for row in (*rows, *(spring.travel for spring in joint.compliances(self.frame))):
            moved = any(j > 0 and np.any(c != 0) for (_, j, _), c in row.terms.items())
            if not moved and not row.polar:
                raise InputError(
                    f"{kind} must hold something that moves: only bodies that rotate have an "
                    "angle, and a point mass does not"
                )

    def _check_points(self, joint: Joint) -> None:
        """Raise `InputError` if a joint is between points that cannot move against each other."""
        points = list(joint.points)
        owners = {body for body, _ in map(body_and_point, points)}
        if len(points) < 2 or len(owners) > 1:
            return
        (owner,) = owners
        body = self.bodies.get(owner)
        text, kind = " and ".join(map(shown, points)), with_article(type(joint).__name__)
        if not owner:
            raise InputError(f"its points {text} are both of the ground; one must be of a body")
        if body is not None and (len(body.nodes) == 1 or len(set(points)) == 1):
            raise InputError(
                f"its points {text} are both of body {owner!r}; {kind} is between two bodies, or a "
                "body and the ground, whose points are pairs (X, Y)"
            )

    def refined(self, parts: int = 2) -> Mechanism:
        """Return the mechanism with this many elements in place of each of every flexible member.

        Points keep their names and places, "node 2" included, and so do joints, loads and sensors.
        A mechanism without elements is returned as it is.

        Raises
        ------
        InputError
            If `parts` is not a whole number, 1 or more, or a member gets too many elements.
        """
        check_integer("parts", parts, 1)
        finer = {
            name: naming(f"body {name!r}", body.refined, parts)
            for name, body in self.bodies.items()
        }
        if all(finer[name] is body for name, body in self.bodies.items()):
            return self
        return replace(self, bodies=finer)

    @property
    def elements(self) -> dict[str, int]:
        """The number of elements of each flexible member."""
        return {name: body.elements for name, body in self.bodies.items() if body.elements}

    @property
    def without_elements(self) -> list[str]:
        """The flexible members whose number of elements was left out."""
        return [name for name, body in self.bodies.items() if body.elements_left_out]

    def warn_of_windings(self) -> None:
        """Warn of springs that begin wound up since their bodies are given angles turns apart."""
        for name, load in self.loads.items():
            rest = load.rest_turn if isinstance(load, PairLoad) else None
            if rest is None:
                continue
            first, second = (self.drawn(self.frame(point).normal) for point in load.points)
            apart, twist = np.subtract(first, second), np.subtract(first, second) - rest
            if np.any((np.abs(apart) > np.pi) & (np.abs(twist) > np.pi)):
                largest = np.ravel(twist)[np.argmax(np.abs(twist))]
                warn(
                    f"load {name!r} starts {largest:.3g} rad from its rest angle, since angles "
                    "count from those that bodies are given, turns included; give its bodies "
                    "angles on the same turn, unless it is wound up"
                )

    def warn_of_stretched_joints(self, size: float, largest: float = 0.01) -> None:
        """Warn of joints that give and start far from where they hold, which moves no body.

        A displacement is far from a part `largest` of the size [m] of the mechanism on, and an
        angle from ten times as many radians on.
        """
        for name, joint in self.joints.items():
            for travel, _, _, angular, relaxed in joint.compliances(self.frame):
                scale, unit = (10.0, "rad") if angular else (size, "m")
                stretch = 0.0 if relaxed else float(np.abs(self._at_guess(travel)).max())
                if stretch > largest * scale:
                    warn(
                        f"joint {name!r} starts {stretch:.3g} {unit} from where it holds, and "
                        "moves no body there: a Compliant joint is a spring; give its bodies "
                        "places where its points meet, unless it is preloaded"
                    )

    def check_sensors(self) -> None:
        """Raise `InputError` if there are no sensors, without which nothing is returned."""
        if not self.sensors:
            raise InputError(
                "the mechanism has no sensors, so it has no outputs; add what is to be known, such "
                "as Mechanism(..., sensors={'tip': fb.Position('arm.end')})"
            )

    # --- points and the state ---------------------------------------------------------------

    @cached_property
    def first_coordinates(self) -> dict[str, int]:
        """The row of z where the coordinates of each body start."""
        first, rows = 1, {}
        for name, body in self.bodies.items():
            rows[name] = first
            first += body.size
        return rows

    @cached_property
    def node_rows(self) -> list[int]:
        """The row of z of the first coordinate of each node."""
        first = self.first_coordinates
        return [first[name] + k for name, body in self.bodies.items() for k in body.nodes]

    @cached_property
    def members(self) -> dict[str, CentreLine]:
        """The beams and cables."""
        bodies = self.bodies.items()
        return {name: body for name, body in bodies if isinstance(body, CentreLine)}

    @cached_property
    def state(self) -> State:
        """The rows of the state z before those of extremes, which may depend on all of them."""
        coordinates = sum(body.size for body in self.bodies.values())
        angles = sum(len(row.polar) for row in self.rows_with_multipliers)
        angles += sum(len(spring.angles) for _, spring in self.springs)
        points = sum(len(law.points) for law in self.laws)
        angles += points + len(self.moments)
        return State.of(
            coordinates, len(self.constraints), len(self.frictions), angles,
            len(self.sensor_points), len(self.springs), len(self.following), points,
            sum(len(law.states) for law in self.laws),
            sum(2 * friction.normals for _, friction in self.frictions),
            sum(len(law.events) for law in self.laws),
        )  # fmt: skip

    @cached_property
    def sensor_points(self) -> list[PointName]:
        """The points whose angles sensors read."""
        points = [point for sensor in self.sensors.values() for point in sensor.turning_points]
        return list(dict.fromkeys(points))

    @cached_property
    def sensor_directions(self) -> list[Vector]:
        """The vectors whose angles sensors alone read."""
        return [self.frame(point).normal for point in self.sensor_points]

    def angle(self, point: PointName) -> Form:
        """Return the angle of a point that is among the `turning_points` of a sensor."""
        return Form.variable(self.state.sensor_angle + self.sensor_points.index(point))

    @cached_property
    def drawn_angles(self) -> list[ArrayLike]:
        """The angles θ near which those in z are at the start, see `turns`; 0 for lengths."""
        polars = (self.polars[row][0] for row in range(self.state.angle, self.state.velocity))
        return [0.0 if polar.length else self.drawn(polar.vector) for polar in polars]

    def drawn(self, vector: Vector) -> ArrayLike:
        """Return the angle [rad] near which that of a linear vector is at the start."""
        return drawn_angle(vector, self.bodies, self.first_coordinates, self.branches)

    def _at_guess(self, form: Form) -> np.ndarray:
        """Return the value of a form in the guess, with angles on the turn that is drawn."""
        guess, turns = list(self.guess), []
        for polar in form.polar:
            x, y = (part.at(guess) for part in polar.vector)
            angle = nearest(np.arctan2(y, x), self.drawn(polar.vector))
            turns.append(np.hypot(x, y) if polar.length else angle)
        return form.with_variables(itertools.count(len(guess))).at([*guess, *turns])

    @cached_property
    def turning(self) -> list[tuple[str, list[Vector]]]:
        """The axes that turn with each body, and the rods of joints, with the part's name."""
        parts = []
        for name, body in self.bodies.items():
            first = self.first_coordinates[name]
            if body.axes:
                axes = [tuple(Form.variable(first + k) for k in axis) for axis in body.axes]
                parts.append((f"body {name!r}", axes))
        for name, joint in self.joints.items():
            parts += [(f"joint {name!r}", [rod]) for rod in joint.rods(self.frame)]
        return parts

    def frame(self, point: PointName) -> Frame:
        """Return the frame of a point."""
        if not isinstance(point, str):
            if callable(point) or (isinstance(point, list | tuple) and any(map(callable, point))):
                raise InputError(
                    "a point must be 'body.point' or a pair of ground coordinates; got a function. "
                    "A point that moves is one of a body with a PrescribedPath; a load that moves "
                    "along a member is shared by Forces at its nodes, which are functions of time"
                )
            return Frame.ground(ground_point("ground point", point))
        if point not in self._frames:
            body, name = body_and_point(point)
            _within("body", body, self.bodies)
            self._frames[point] = self.bodies[body].frame(name, self.first_coordinates[body])
        return self._frames[point]

    @cached_property
    def _frames(self) -> dict[str, Frame]:
        """The frames that were asked for, by point."""
        return {}

    def velocity(self, point: PointName) -> Frame:
        """Return the rates of a point's frame."""
        return self.frame(point).shifted(self.state.velocity)

    def acceleration(self, point: PointName) -> Frame:
        """Return the second rates of a point's frame."""
        return self.frame(point).shifted(self.state.acceleration)

    def member(self, name: str) -> tuple[CentreLine, int]:
        """Return a beam or cable, and the row of z where its coordinates start."""
        _within("beam", name, self.members)
        return self.members[name], self.first_coordinates[name]

    # --- constraints and loads --------------------------------------------------------------

    @cached_property
    def given(self) -> list[np.ndarray]:
        """The guess [1, q] for the start, as the bodies state it."""
        coordinates = [
            naming(f"body {name!r}", body.coordinates) for name, body in self.bodies.items()
        ]
        return [np.ones(()), *itertools.chain.from_iterable(coordinates)]

    @cached_property
    def guess(self) -> list[np.ndarray]:
        """The guess with each body at its angle, moved to where the joints meet if possible."""
        bodies = [
            [self.first_coordinates[name] + k for k in body.nodes]
            for name, body in self.bodies.items()
        ]
        joints = [joint for joint in self.joints.values() if not joint.holds_start]
        return placed(
            self.given, bodies, [row for joint in joints for row in joint.constraints(self.frame)]
        )

    @cached_property
    def constraints(self) -> list[tuple[str, Form]]:
        """The rows of Φ, each with the name of the part that it belongs to."""
        rows = [
            (f"rigidity of body {name!r}", row)
            for name, body in self.bodies.items()
            for row in body.constraints(self.first_coordinates[name])
        ]
        for name, joint in self.joints.items():
            for row in joint.constraints(self.frame):
                held = row - self._at_guess(row) if joint.holds_start else row
                rows.append((f"joint {name!r}", held))
        return rows

    @cached_property
    def frictions(self) -> list[tuple[str, FrictionEntry]]:
        """What sticks and slides as the engine numbers it, each with the name of its part."""
        joints = self.joints.items()
        entered = [(name, joint.frictions(self.frame)) for name, joint in joints]
        entered += [(name, entries.frictions) for name, entries in self.entries.items()]
        frictions = [(name, friction) for name, group in entered for friction in group]
        for name, friction in frictions:
            travel = friction.whole_travel
            if not (travel.terms or any(moves(polar.vector) for polar in travel.polar)):
                raise InputError(
                    f"friction of {name!r} must be against something that moves: only bodies that "
                    "rotate have an angle, and a point mass does not"
                )
        return frictions

    @property
    def rows_with_multipliers(self) -> list[Form]:
        """The rows of Φ, then the travels of frictions."""
        rows = [row for _, row in self.constraints]
        return rows + [friction.whole_travel for _, friction in self.frictions]

    @cached_property
    def _rows_of_variables(self) -> list[Form]:
        """The same with variables of z in place of the angles."""
        variables = itertools.count(self.state.angle)
        return [row.with_variables(variables) for row in self.rows_with_multipliers]

    @property
    def constraint_forms(self) -> list[Form]:
        """The rows of Φ with variables of z in place of the angles."""
        return self._rows_of_variables[: len(self.constraints)]

    @property
    def travel_forms(self) -> list[Form]:
        """The travels of frictions with variables of z in place of the angles."""
        return self._rows_of_variables[len(self.constraints) :]

    @cached_property
    def normal_forces(self) -> list[Sequence[Vector]]:
        """Of each friction, the vectors whose lengths add up to its normal force."""
        normals = []
        for name, friction in self.frictions:
            owners = [owner for owner, _ in self.contact_laws]
            forces = [c.force for c in self.contacts(name)] if name in owners else []
            if name in self.joints and not forces:
                carried = self.state.sliding + FRICTION_ROWS * len(self.frictions)
                forces = [Form.variable(carried + k) for k in self._rows_of(name)]
            normal = friction.normal(forces)
            if friction.active:
                normal = [(naming(f"joint {name!r}", self._activity, friction.active), Form({}))]
            normals.append(normal)
        return normals

    def _activity(self, active: Activity) -> Form:
        """Return what is positive where a joint that switches is active."""
        if not isinstance(active, tuple):
            return Form.function(active) - 0.5
        first = rows_of_gaps.py_func(self.state).mode
        return Form.variable(first + self._number_in_laws("event", *active)) * -1.0

    def at_rest(self) -> Mechanism:
        """Return the mechanism for statics and modes, without sensors that are of a motion.

        Joints that switch are as at the start.
        """
        joints = {name: joint.at_rest() for name, joint in self.joints.items()}
        sensors = {name: sensor for name, sensor in self.sensors.items() if sensor.in_equilibrium}
        if len(sensors) == len(self.sensors) and not self.switches:
            return self
        return replace(self, joints=joints, sensors=sensors)

    @property
    def switches(self) -> bool:
        """Whether a joint of it becomes active or inactive."""
        return any(joint.at_rest() is not joint for joint in self.joints.values())

    def left_out_at_rest(self) -> dict[str, list[str]]:
        """Return the attribute that lists sensors which statics and modes leave out; warn of it."""
        names = [name for name, sensor in self.sensors.items() if not sensor.in_equilibrium]
        if not names:
            return {}
        warn(
            f"left out: {', '.join(map(repr, names))}, since what these sensors return is of a "
            "motion, and there is none"
        )
        return {"left_out": names}

    def switching_losses(self, joint: str) -> list[Form]:
        """Return the energies that the rows of a joint that switches have taken so far."""
        count, owners = len(self.frictions), [name for name, f in self.frictions if f.active]
        _within("joint that switches", joint, dict.fromkeys(owners))
        rows = [k for k, (name, f) in enumerate(self.frictions) if f.active and name == joint]
        return [Form.variable(self.state.sliding + 4 * count + k) for k in rows]

    def works_of_impulses(self, part: str) -> list[Form]:
        """Return the works that the impulses of a joint or load have done so far [J].

        There are none without friction, where impulses are rounds of a run.
        """
        owners = [owner for owner, _ in self.frictions]
        if not owners:
            return []
        rows = [reaction_rows.py_func(self.state).work + k for k in self._rows_of(part)]
        first = friction_rows.py_func(self.state).work
        rows += [first + k for k, owner in enumerate(owners) if owner == part]
        return [Form.variable(row) for row in rows]

    @cached_property
    def entries(self) -> dict[str, Entries]:
        """What each load, and each joint with contacts, enters in the equations of motion."""
        entries = {
            name: naming(f"load {name!r}", entered, load, self) for name, load in self.loads.items()
        }
        for name, joint in self.joints.items():
            contacts, compliances = joint.contacts(self.frame), joint.compliances(self.frame)
            if name in entries and (contacts or compliances or entries[name].frictions):
                raise InputError(
                    f"joint {name!r} must not have the name of a load, since one of them has "
                    "contacts, springs or friction"
                )
            if compliances:
                entries[name] = naming(f"joint {name!r}", spring_entries, compliances)
            if contacts:
                first, second = map(self.frame, joint.points)
                entries[name] = contact_entries(contacts, first, second, closed_at_start=False)
        return entries

    @cached_property
    def springs(self) -> list[tuple[str, SpringEntry]]:
        """The springs as the engine numbers them, each with the name of its load."""
        springs = [(name, entry) for name, e in self.entries.items() for entry in e.springs]
        return sorted(springs, key=lambda spring: spring[1].line is None)

    @cached_property
    def laws(self) -> list[LawEntry]:
        """The force laws as the engine numbers them."""
        return [law for entries in self.entries.values() for law in entries.laws]

    @cached_property
    def contact_laws(self) -> list[tuple[str, LawEntry]]:
        """The laws of contacts as the engine numbers them, each with the name of its part."""
        laws = [(name, law) for name, entries in self.entries.items() for law in entries.laws]
        return [(name, law) for name, law in laws if law.is_contact]

    @cached_property
    def moments(self) -> list[MomentEntry]:
        """The moments on angles as the engine numbers them."""
        return [moment for entries in self.entries.values() for moment in entries.moments]

    @cached_property
    def following(self) -> list[FollowingEntry]:
        """The forces along directions of flexible members as the engine numbers them."""
        return [force for entries in self.entries.values() for force in entries.following]

    def forces(self, load: str) -> GeneralizedForce:
        """Return the generalized forces of a load, on coordinates and, of moments, on angles.

        Those of springs and force laws are left out. Raise `InputError` if one acts on anything
        else.
        """
        entries, state = self.entries[load], self.state
        for j in entries.forces:
            if not (0 < j <= state.coordinates or state.angle <= j < state.sensor_angle):
                raise InputError(
                    f"load {load!r}: forces must act on coordinates, rows 1 to {state.coordinates} "
                    f"of z, or on angles; got a force on row {j}"
                )
        force, before = dict(entries.forces), self._before(load, "moments")
        first = state.sensor_angle - len(self.moments) + before
        for k, entry in enumerate(entries.moments):
            force[first + k] = force.get(first + k, Form({})) + entry.moment
        first = state.direction + 2 * self._before(load, "following")
        for k, entry in enumerate(entries.following):
            x, y = (Form.variable(first + 2 * k + axis) for axis in range(2))
            vector = add(scale(entry.along, (x, y)), scale(entry.across, (-y, x)))
            for j, part in at_point(vector, entry.position).items():
                force[j] = force.get(j, Form({})) + part
        return force

    def _before(self, load: str, kind: str) -> int:
        """Return how many entries of a kind belong to loads before this one."""
        others = itertools.takewhile(lambda name: name != load, self.entries)
        return sum(len(getattr(self.entries[name], kind)) for name in others)

    def joint(self, name: str) -> tuple[Joint, list[Form]]:
        """Return a joint and its multipliers: of springs, their tensions.

        Those of contacts are −1 times their force and moment.
        """
        _within("joint", name, self.joints)
        if name in self.entries and self.joints[name].contacts(self.frame):
            rows = self._law_rows(name)
            force = ([Form.variable(row + axis) * -1.0 for row in rows] for axis in range(3))
            return self.joints[name], [sum(parts, Form({})) for parts in force]
        if springs := self._springs_of(name):
            return self.joints[name], [self._spring_forms(k)[0] for k in springs]
        frictions = [k for k, (part, _) in enumerate(self.frictions) if part == name]
        rows = [self.state.multiplier + k for k in self._rows_of(name)]
        rows += [self.state.friction + k for k in frictions]
        return self.joints[name], [Form.variable(row) for row in rows]

    def _rows_of(self, joint: str) -> list[int]:
        """Return the numbers of the rows of Φ that belong to a joint."""
        return [k for k, (owner, _) in enumerate(self.constraints) if owner == f"joint {joint!r}"]

    def _law_rows(self, part: str) -> list[int]:
        """Return the row of z with the first force of each law of a part."""
        before, laws = self._before(part, "laws"), self.entries[part].laws
        points = itertools.accumulate((len(law.points) for law in laws), initial=0)
        row = self.state.law + 3 * sum(len(law.points) for law in self.laws[:before])
        return [row + 3 * point for point in points][: len(laws)]

    @cached_property
    def rubbed_rows(self) -> dict[int, int]:
        """Of each friction of a contact, the row of z with the force of the contact."""
        return self._by_contact(self._law_rows)

    @cached_property
    def rubbed_gaps(self) -> dict[int, int]:
        """Of each friction of a contact, the number of the gap of the contact."""
        return self._by_contact(self._gaps_of)

    def _by_contact(self, numbers_of: Callable[[str], list[int]]) -> dict[int, int]:
        """Return for each friction of a contact its own of the numbers of its part."""
        numbers = {name: iter(numbers_of(name)) for name in self.entries}
        frictions = enumerate(self.frictions)
        return {k: next(numbers[name]) for k, (name, f) in frictions if f.sliding.action}

    def _gaps_of(self, part: str) -> list[int]:
        """Return the numbers of the gaps of a load or joint."""
        before = sum(len(law.events) for law in self.laws[: self._before(part, "laws")])
        number = sum(len(law.events) for law in self.entries[part].laws)
        return list(range(before, before + number))

    def spring(self, name: str, *, torsion: bool) -> tuple[Form, Form]:
        """Return the tension and the elongation of a translational or a torsion spring."""
        rows = {}
        for k, (owner, spring) in enumerate(self.springs):
            if spring.angular == torsion and owner in self.loads:
                rows.setdefault(owner, self._spring_forms(k))
        _within("torsion spring" if torsion else "spring", name, rows)
        return rows[name]

    def _springs_of(self, joint: str) -> list[int]:
        """Return the numbers of the springs of a joint that gives."""
        if joint not in self.joints or not self.joints[joint].compliances(self.frame):
            return []
        return [k for k, (owner, _) in enumerate(self.springs) if owner == joint]

    def _elongation_form(self, number: int) -> Form:
        """Return the elongation of a spring with variables of z in place of its angles."""
        first = sum(len(row.polar) for row in self.rows_with_multipliers)
        first += sum(len(spring.angles) for _, spring in self.springs[:number])
        variables = itertools.count(self.state.angle + first)
        return self.springs[number][1].elongation.with_variables(variables)

    def _spring_forms(self, number: int) -> tuple[Form, Form]:
        rows = (self.state.tension + number, self.state.elongation + number)
        return Form.variable(rows[0]), Form.variable(rows[1])

    def law_state(self, load: str, name: str) -> Form:
        """Return a first-order state of a force law."""
        return Form.variable(self.state.law_state + self._number_in_laws("state", load, name))

    def _number_in_laws(self, kind: str, load: str, name: str) -> int:
        """Return the number of a state or an event of a load among those of all laws."""
        names = {
            part: [n for law in entries.laws for n in getattr(law, f"{kind}s")]
            for part, entries in self.entries.items()
        }
        _within(f"load with {kind}s", load, {part: group for part, group in names.items() if group})
        _within(f"{kind} of load {load!r}", name, dict.fromkeys(names[load]))
        others = itertools.takewhile(lambda part: part != load, names)
        return sum(len(names[part]) for part in others) + names[load].index(name)

    def contacts(self, part: str) -> list[ContactRows]:
        """Return the contacts of a load or joint."""
        owners = [name for name, _ in self.contact_laws]
        _within("part with contacts", part, dict.fromkeys(owners))
        number, law = owners.count(part), self._before(part, "laws")
        rows, gaps = rows_of_gaps.py_func(self.state), self._gaps_of(part)
        return [
            ContactRows(
                *(Form.variable(first + gaps[n]) for first in rows[1:6]),
                angular=self.laws[law + n].is_angular,
            )
            for n in range(number)
        ]

    def frictions_of(self, part: str) -> list[FrictionRows]:
        """Return what sticks and slides of a joint or load."""
        owners = [name for name, _ in self.frictions]
        _within("part with friction", part, dict.fromkeys(owners))
        speeds = self.state.sliding + 2 * len(owners)
        rows = []
        for k in (k for k, owner in enumerate(owners) if owner == part):
            multiplier, speed = map(Form.variable, (self.state.friction + k, speeds + k))
            rows.append(FrictionRows(multiplier, speed, self.frictions[k][1].angular))
        return rows

    @cached_property
    def watched(self) -> list[Watched]:
        """The forms whose extremes and integrals sensors want, as the engine numbers them."""
        sensors = [s for s in self.sensors.values() if isinstance(s, OverSteps)]
        return [Watched(*form, s.times, s) for s in sensors for form in s.watched(self)]

    def over_steps(self, sensor: OverSteps) -> list[Form]:
        """Return what the engine makes of the outputs of a sensor over its steps."""
        rows = [k for k, watched in enumerate(self.watched) if watched.sensor is sensor]
        return [Form.variable(self.state.extreme + k) for k in rows]

    def generalized_force(self, part: str) -> list[tuple[Form, Form]]:
        """Return the forces of a joint or load, each with the variable of z that it does work on.

        They are −Φ_qᵀλ of a joint, −T on the elongation of a spring, and the forces and moments of
        a law on the positions and angles of its points, with those of friction in contacts.
        """
        _within("joint or load", part, {**self.joints, **self.loads})
        frictions = enumerate(self.frictions)
        alone = [k for k, (owner, f) in frictions if owner == part and not f.sliding.action]
        travels = [self.travel_forms[k] for k in alone]
        if part in self.joints and not self.joints[part].contacts(self.frame):
            rows = [self.constraint_forms[k] for k in self._rows_of(part)] + travels
            rows += [self._elongation_form(k) for k in self._springs_of(part)]
            force = constraint_force(rows, self.joint(part)[1])
            return [(form, Form.variable(j)) for j, form in force.items()]
        multipliers = [Form.variable(self.state.friction + k) for k in alone]
        forces = self.forces(part), constraint_force(travels, multipliers)
        pairs = [(form, Form.variable(j)) for force in forces for j, form in force.items()]
        for k, (owner, _) in enumerate(self.springs):
            if owner == part:
                tension, elongation = self._spring_forms(k)
                pairs.append((-tension, elongation))
        first = sum(len(law.points) for law in self.laws[: self._before(part, "laws")])
        frames = [frame for law in self.entries[part].laws for frame in law.points]
        points = sum(len(law.points) for law in self.laws)
        angle = self.state.sensor_angle - len(self.moments) - points
        for p, frame in enumerate(frames, start=first):
            moved = (*frame.position, Form.variable(angle + p))
            row = self.state.law + 3 * p
            pairs += [(Form.variable(row + axis), form) for axis, form in enumerate(moved)]
        return [(force, moved) for force, moved in pairs if moved.terms]

    @cached_property
    def polars(self) -> dict[int, list[Polar]]:
        """The terms of each row of z that is an angle or an elongation, which is their sum."""
        rows, unit = self.rows_with_multipliers, np.asarray(1.0)
        angles = [polar._replace(c=unit, f=None) for row in rows for polar in row.polar]
        turns = [[angle.vector for angle in spring.angles] for _, spring in self.springs]
        turns += [[frame.normal for frame in law.points] for law in self.laws]
        turns += [[moment.direction] for moment in self.moments]
        turns += [self.sensor_directions]
        angles += [Polar(vector, unit) for vectors in turns for vector in vectors]
        polars = {self.state.angle + k: [angle] for k, angle in enumerate(angles)}
        for k, (_, spring) in enumerate(self.springs):
            polars[self.state.elongation + k] = list(spring.elongation.polar)
        return polars

    # --- inertia ----------------------------------------------------------------------------

    @cached_property
    def mass(self) -> dict[tuple[int, int], np.ndarray]:
        """The entries (i, j), i ≤ j, of the mass matrix, counted as in z."""
        return {
            (self.first_coordinates[name] + i, self.first_coordinates[name] + j): value
            for name, body in self.bodies.items()
            for (i, j), value in naming(f"body {name!r}", body.mass_entries).items()
        }

    def weight(self, x: ArrayLike, y: ArrayLike) -> GeneralizedForce:
        """Return M g, where g = (x, y) [m/s²] in the rows of the nodes' positions."""
        g = {n + axis: Form.constant(a) for n in self.node_rows for axis, a in enumerate((x, y))}
        force: GeneralizedForce = {}
        for (i, j), value in self.mass.items():
            for to, of in {(i, j), (j, i)}:
                if of in g:
                    force[to] = force.get(to, Form({})) + g[of] * value
        return force

    def line_load(self, body: str, x: Property, y: Property) -> GeneralizedForce:
        """Return the generalized force of a load [N/m] along a beam or cable."""
        member, first = self.member(body)
        return {first + j: Form.constant(force) for j, force in member.line_load(x, y).items()}


def _within(kind: str, name: str, parts: Mapping[str, object]) -> None:
    if not isinstance(name, str) or name not in parts:
        there = ", ".join(parts) or "none"
        raise InputError(f"{kind} {shown(name)} is not in the mechanism; there is {there}")
