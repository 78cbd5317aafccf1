"""The parts of a mechanism: copies that nobody else can change, and what they must return.

Parts may be of classes that users write. What they return is checked once, because compiled code
does not check it.
"""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from typing import ParamSpec, Protocol, TypeVar, runtime_checkable

import numpy as np

from flexband.basics.arguments import Fixed
from flexband.basics.checks import check_each_finite, check_instance
from flexband.basics.words import number_of, value_text
from flexband.errors import InputError
from flexband.mechanics.bodies.body import Body, check_implements
from flexband.mechanics.kernels.forms import Form, Key, section_normal
from flexband.mechanics.kernels.state import State
from flexband.mechanics.loads.load import Entries

Part = TypeVar("Part")
Result = TypeVar("Result")
Arguments = ParamSpec("Arguments")


@runtime_checkable
class _WithNumbers(Protocol):
    def __array__(self) -> np.ndarray: ...


def owned_parts(kinds: str, kind: str, base: type, parts: Mapping[str, Part]) -> Fixed[Part]:
    """Return a copy of one of the mappings of a mechanism."""
    check_instance(kinds, parts, Mapping, f"a mapping from names to {kinds}")
    copies = {}
    for name, part in parts.items():
        if not isinstance(name, str) or not name or (kind == "body" and "." in name):
            requirement = "non-empty text" + (" without a dot" if kind == "body" else "")
            raise InputError(f"the name of a {kind} must be {requirement}; got {value_text(name)}")
        check_implements(f"{kinds}[{name!r}]", part, base, f"a {kind}")
        copies[name] = _copy_data(part)
        if type(part).__module__.startswith("flexband."):  # checked as it is now
            copies[name] = name_errors(f"{kind} {name!r}", replace, copies[name])
    return Fixed(copies)


def _copy_data(value):
    """Return a copy of data and of the data in it; functions and other objects are kept."""
    if type(value) in (float, int, str, bool, type(None), type):  # most are
        return value
    if isinstance(value, np.ndarray):
        duplicate = value.copy()
        duplicate.flags.writeable = False
        return duplicate
    if isinstance(value, Mapping):
        return Fixed({key: _copy_data(element) for key, element in value.items()})
    if type(value) in (list, tuple):
        return tuple(map(_copy_data, value))
    if is_dataclass(value) and not isinstance(value, type):
        duplicate = copy.copy(value)
        for field in fields(value):
            object.__setattr__(duplicate, field.name, _copy_data(getattr(value, field.name)))
        return duplicate
    return copy.deepcopy(value) if isinstance(value, _WithNumbers) else value


def name_errors(
    place: str,
    action: Callable[Arguments, Result],
    *arguments: Arguments.args,
    **options: Arguments.kwargs,
) -> Result:
    """Return what the action returns; an `InputError` names the place."""
    try:
        return action(*arguments, **options)
    except InputError as error:
        raise InputError(f"{place}: {error}") from None


def check_body(body: Body) -> None:
    """Raise `InputError` if what a body returns does not fit its number of coordinates."""
    for what, values in (("coordinates", body.coordinates()), ("velocities", body.velocities())):
        if len(values) != body.size:
            raise InputError(
                f"{what} must return {number_of(body.size, 'value')}; got {len(values)}"
            )
        check_each_finite(what, values)
    masses = body.mass_entries()
    for i, j in masses:
        if not 0 <= i <= j < body.size:
            raise InputError(
                f"mass_entries must be (i, j) with 0 ≤ i ≤ j < {body.size}; got ({i}, {j})"
            )
    check_each_finite("mass_entries", masses.values())


def check_forms(what: str, forms: Sequence[Form], rows: int) -> None:
    """Raise `InputError` if these are not forms of the first rows of z."""
    check_instance(what, forms, Sequence, "a list of forms")
    for form in forms:
        check_instance(what, form, Form)
        check_each_finite(f"coefficients of {what}", (c for _, c in _terms(form)))
        for (i, j, _), _ in _terms(form):
            if not 0 <= i <= j < rows:
                raise InputError(f"{what} must be of rows 0 to {rows - 1} of z; got row {j}")


def _terms(form: Form) -> Iterable[tuple[Key, np.ndarray]]:
    """Yield the terms of a form and of the vectors whose angles or lengths it has."""
    yield from form.terms.items()
    for polar in form.polar:
        for component in polar.vector:
            yield from component.terms.items()


def check_entries(entries: Entries, state: State) -> None:
    """Raise `InputError` if a load enters forms of rows that do not exist."""
    check_forms("forces", list(entries.forces.values()), state.rows)
    check_forms("the potential", [entries.potential], state.rows)
    for spring in entries.springs:
        check_forms("the elongation of a spring", [spring.elongation], 1 + state.coordinates)
    for law in entries.laws:
        for frame in law.points:
            check_forms("the points of a law", frame.position, 1 + state.coordinates)
            section_normal(frame)  # refuses bodies of space
    if any(len(force.direction) > 2 for force in entries.following):
        raise InputError("forces that follow a deformed section are of the plane")


def check_outputs(outputs: Mapping[str, Sequence[tuple[str, str]]]) -> None:
    """Raise `InputError` if two outputs of sensors have the same name."""
    owners: dict[str, str] = {}
    for sensor, sensor_outputs in outputs.items():
        for name, _ in sensor_outputs:
            if name in owners:
                raise InputError(
                    f"sensors {owners[name]!r} and {sensor!r} both have an output {name!r}; give "
                    "one of them another name"
                )
            owners[name] = sensor
