"""Sensors of contacts: gap, force, and what impacts did so far."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_flag, check_integer
from flexband.errors import InputError
from flexband.mechanics.kernels.forms import Form
from flexband.mechanics.kernels.running_extremes import KINDS
from flexband.mechanics.sensors.motion import ContactRows, Sensor, SensorModel
from flexband.mechanics.sensors.sensor_extremes import OverSteps, check_window


def contacts_of(name: str, model: SensorModel, part: str, *, angular: bool) -> list[ContactRows]:
    """Return the rows of the contacts of a part; `angular` must fit it."""
    contacts = model.contacts(part)
    if contacts[0].angular != angular:
        kind = "an angular stop" if contacts[0].angular else "no angular stop"
        raise InputError(f"{part!r} is {kind}; give {name} angular={contacts[0].angular}")
    return contacts


@frozen()
class Gap(Sensor):
    """The gap of a contact, the least one if the part has several; negative where it is closed.

    Parameters
    ----------
    part : name of the contact or stop, or of the joint with clearance.
    angular : whether it is an `AngularStop`, whose gap is in rad.

    Raises
    ------
    InputError
        If the part has no contact, or `angular` does not fit it.
    """

    part: str
    angular: bool = False

    def __post_init__(self) -> None:
        check_flag("Gap angular", self.angular)

    def outputs(self, model: SensorModel) -> list[tuple[str, str]]:
        return [("", "rad" if self.angular else "m")]

    def rows(self, model: SensorModel) -> Sequence[Form]:
        return [c.gap for c in contacts_of("Gap", model, self.part, angular=self.angular)]

    def derives(self, model: SensorModel) -> bool:
        return len(self.rows(model)) > 1

    def derive(self, rows: np.ndarray, model: SensorModel) -> np.ndarray:
        return rows.min(axis=0, keepdims=True)


@frozen()
class ContactForce(Sensor):
    """The normal force of a contact [N], the largest one if the part has several.

    Parameters and errors are those of `Gap`; that of an `AngularStop` is a moment [N m].
    """

    part: str
    angular: bool = False
    in_place = "Contacts, with the largest force,"

    def __post_init__(self) -> None:
        check_flag("ContactForce angular", self.angular)

    def outputs(self, model: SensorModel) -> list[tuple[str, str]]:
        return [("", "N m" if self.angular else "N")]

    def rows(self, model: SensorModel) -> Sequence[Form]:
        contacts = contacts_of("ContactForce", model, self.part, angular=self.angular)
        return [contact.force for contact in contacts]

    def derives(self, model: SensorModel) -> bool:
        return len(self.rows(model)) > 1

    def derive(self, rows: np.ndarray, model: SensorModel) -> np.ndarray:
        return rows.max(axis=0, keepdims=True)


@frozen()
class Contacts(OverSteps):
    """What the contacts of a part did so far, taken at every step of the engine.

    Outputs are "_number", how often they have closed; "_t1", "_t2", …, the first instants [s] at
    which they did so, NaN where there is none; "_force", the largest normal force; "_energy", the
    energy that their damping has taken [J], without that of friction.

    Parameters
    ----------
    part : name of the contact or stop, or of the joint with clearance.
    first : how many instants are wanted, from 0 on.
    window : first and last time [s], or None for the whole run.
    angular : whether it is an `AngularStop`, whose force is a moment.

    Raises
    ------
    InputError
        If the part has no contact, or an argument is out of its range.
    """

    part: str
    first: int = 3
    window: tuple[float, float] | None = None
    angular: bool = False

    def __post_init__(self) -> None:
        check_integer("Contacts first", self.first, 0, 1000)
        check_flag("Contacts angular", self.angular)
        check_window("Contacts", self.window)

    def outputs(self, model: SensorModel) -> list[tuple[str, str]]:
        instants = [(f"_t{k}", "s") for k in range(1, self.first + 1)]
        force = "N m" if self.angular else "N"
        return [("_number", ""), *instants, ("_force", force), ("_energy", "J")]

    def step_forms(self, model: SensorModel) -> list[tuple[Form, int]]:
        kinds = [KINDS.closings, *(KINDS.instant + k for k in range(1, self.first + 1))]
        forms: list[tuple[Form, int]] = []
        for c in contacts_of("Contacts", model, self.part, angular=self.angular):
            forms += [(c.mode, kind) for kind in kinds]
            forms += [(c.force, KINDS.largest), (c.loss, KINDS.integral)]
        return forms

    def derive(self, rows: np.ndarray, model: SensorModel) -> np.ndarray:
        """Return the sums of numbers and energies, the first of all instants, the largest force."""
        contacts = rows.reshape(-1, self.first + 3, *rows.shape[1:])
        number = contacts[:, 0].sum(axis=0)
        energy = contacts[:, -1].sum(axis=0)
        instants = contacts[:, 1:-2].reshape(-1, *rows.shape[1:])
        instants = np.sort(instants, axis=0)[: self.first]  # NaN are last
        return np.stack([number, *instants, np.fmax.reduce(contacts[:, -2]), energy])


@frozen()
class FrictionForce(Sensor):
    """The friction on the first body of a part [N], and its sliding speed "_speed" [m/s].

    Parameters
    ----------
    part : name of the contact, brake or clutch, or of the joint with friction.
    angular : whether it acts against a rotation, as in a brake or in a pin without clearance. It is
        then a moment [N m], and the speed is in rad/s.
    number : which of its frictions it is, from 0 on, if the part has several.

    Raises
    ------
    InputError
        If the part has no such friction, or `angular` does not fit it.
    """

    part: str
    angular: bool = False
    number: int = 0

    def __post_init__(self) -> None:
        check_flag("FrictionForce angular", self.angular)
        check_integer("FrictionForce number", self.number, 0)

    def outputs(self, model: SensorModel) -> list[tuple[str, str]]:
        force, speed = ("N m", "rad/s") if self.angular else ("N", "m/s")
        return [("", force), ("_speed", speed)]

    def rows(self, model: SensorModel) -> Sequence[Form]:
        frictions = model.frictions_of(self.part)
        if self.number >= len(frictions):
            raise InputError(
                f"FrictionForce number must be below {len(frictions)} for {self.part!r}; got "
                f"{self.number}"
            )
        friction = frictions[self.number]
        if friction.angular != self.angular:
            kind = "a rotation" if friction.angular else "no rotation"
            raise InputError(
                f"{self.part!r} has friction against {kind}; give FrictionForce "
                f"angular={friction.angular}"
            )
        return [-friction.multiplier, friction.speed]
