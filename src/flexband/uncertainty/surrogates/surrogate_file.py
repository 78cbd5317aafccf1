"""Surrogates as files: arrays and a record that describes them.

The record gives inputs by the names of their classes and functions, which are looked up among the
registered ones. Nothing in a file is executed, and all of it is checked.
"""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping, Sequence
from contextlib import suppress
from dataclasses import fields, replace
from importlib import import_module
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import xarray as xr

from flexband.basics.checks import check_flag, check_instance
from flexband.basics.computation import NUMBERING, OutdatedError, check_numbering
from flexband.basics.warning import without_warnings
from flexband.basics.words import value_text
from flexband.errors import InputError
from flexband.uncertainty.inputs.choices import Choice
from flexband.uncertainty.inputs.correlated import Correlated
from flexband.uncertainty.inputs.distributions.scipy_distribution import as_input
from flexband.uncertainty.inputs.evaluation import coordinates
from flexband.uncertainty.inputs.fields.field import Field
from flexband.uncertainty.inputs.fields.random_field import RandomField
from flexband.uncertainty.inputs.inputs import Input
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.inputs.unfolding import GivenInputs, cases, choices_of
from flexband.uncertainty.surrogates.archive import read_archive, write_archive
from flexband.uncertainty.surrogates.choices import SurrogateOfChoices
from flexband.uncertainty.surrogates.consistency import check
from flexband.uncertainty.surrogates.held_out import HeldOut
from flexband.uncertainty.surrogates.surrogate import Surrogate

if TYPE_CHECKING:
    from flexband.uncertainty.expansions.expansion import Expansion

FORMAT = 9
"""Version of the format: since 2 inputs are in the order of their names, since 3 every random
variable has its family of polynomials, since 4 expansions have no terms that are zero, since 5
inputs may be correlated or have intervals as parameters, since 6 a digest tells of damage, since 7
check runs are kept, since 8 the error of the discretization may be corrected, since 9 there may
be verification runs."""

Entry = TypeVar("Entry")

Record = str | float | None | Sequence["Record"] | Mapping[str, "Record"]
"""What JSON has."""

_FUNCTIONS = {"correlation": RandomField.correlations, "function": Field.functions}
"""Functions by name, by what they are in a record."""


def save_surrogate(surrogate: Surrogate | SurrogateOfChoices, file: str | Path) -> None:
    """Write a surrogate to a file, complete or not at all.

    Raises
    ------
    InputError
        If an input has a field that cannot be saved, such as a correlation function that is not in
        `RandomField.correlations`, or if the file is a folder.

    Examples
    --------
    >>> from tempfile import TemporaryDirectory
    >>> surrogate = fb.expand(lambda a: 2 * a, {"a": fb.Interval(0.0, 1.0)}, fb.PCCI(0, 1))
    >>> with TemporaryDirectory() as folder:
    ...     fb.save_surrogate(surrogate, f"{folder}/doubled.npz")
    ...     loaded = fb.load_surrogate(f"{folder}/doubled.npz")
    ...
    >>> loaded.bands()["mean"].values.round(4)
    array([0., 2.])
    """
    check_instance("surrogate", surrogate, Surrogate | SurrogateOfChoices, "a Surrogate")
    if isinstance(surrogate, Surrogate):
        about, arrays = _record(surrogate)
    else:
        parts = [_record(case_surrogate) for case_surrogate in surrogate.surrogates.values()]
        array_sets = enumerate(case_arrays for _, case_arrays in parts)
        arrays = {
            f"{k}/{name}": array
            for k, case_arrays in array_sets
            for name, array in case_arrays.items()
        }
        about = {
            "given": _recorded_inputs(surrogate.user_inputs),
            "parts": [record for record, _ in parts],
        }
    write_archive(_path(file), about | {"format": FORMAT, "numbering": NUMBERING}, arrays)


def _record(surrogate: Surrogate) -> tuple[dict[str, Any], dict[str, np.ndarray]]:
    labels = surrogate.labels
    diagnostics = surrogate.diagnostics
    variables_by_path = {f"coords/{k}": c for k, c in coordinates(labels).items()}
    variables = diagnostics.drop_vars(labels.coords, errors="ignore").variables
    variables_by_path |= {f"diagnostics/{k}": v for k, v in variables.items()}
    verification = surrogate.verification
    if verification is not None:
        variables_by_path |= {f"verification/{k}": v for k, v in verification.variables.items()}
    arrays: dict[str, np.ndarray] = {
        name: values.values.astype(str) if values.dtype == object else values.values
        for name, values in variables_by_path.items()
    }
    for group in ("expansions", "correction"):
        for k, expansion in enumerate(getattr(surrogate, group)):
            arrays |= {f"{group}/{k}/{name}": v for name, v in expansion.arrays().items()}
    held_out_runs = surrogate.held_out
    if held_out_runs is not None:
        fields_of_runs = {name: np.asarray(v) for name, v in vars(held_out_runs).items()}
        arrays |= {f"held_out/{name}": v for name, v in fields_of_runs.items() if v.shape != (0,)}
    about = {
        "inputs": _recorded_inputs(surrogate.space.user_inputs),
        "dims": labels.dims,
        "shape": labels.shape,
        "named": {name: (v.dims, _attributes(v.attrs)) for name, v in variables_by_path.items()},
        "attributes": _attributes(diagnostics.attrs),
        "expansions": [type(expansion).__name__ for expansion in surrogate.expansions],
    }
    if verification is not None:
        coords = sorted(map(str, verification.coords))
        about["verification"] = {"attributes": _attributes(verification.attrs), "coords": coords}
    return about, arrays


def _recorded_inputs(inputs: GivenInputs) -> dict[str, Record]:
    records = {}
    for name, input_ in inputs.items():
        try:
            records[name] = _to_record(as_input(input_))
        except InputError as error:
            raise InputError(f"{name}: {error}") from None
    return records


def load_surrogate(file: str | Path, *, outdated: bool = False) -> Surrogate | SurrogateOfChoices:
    """Return the surrogate that `save_surrogate` has written. Nothing in the file is executed.

    Parameters
    ----------
    file : path of the file.
    outdated : whether it may be one of an older version of flexband, which now computes runs or
        answers otherwise.

    Raises
    ------
    InputError
        If there is no such file, it holds no surrogate or a damaged one, it is of another version
        of the format, is `outdated`, or an input in it is of a class that is not defined yet.
    """
    file = _path(file)
    outdated = check_flag("outdated", outdated)
    if not file.is_file():
        raise InputError(f"there is no file {file}")
    try:
        about, arrays, intact = read_archive(file)
        if about["format"] not in (7, 8, FORMAT):  # what is in a later one may be absent
            raise InputError(
                f"the format of the surrogate is {about['format']!r}, not {FORMAT}; "
                "save it again with this version of flexband"
            )
        if not intact:
            raise InputError("the file is not as it was saved: it is damaged, or was changed")
        if not outdated:
            check_numbering("it", about.get("numbering"))
        with without_warnings():  # which were given when it was made
            return _choices(about, arrays) if "parts" in about else _surrogate(about, arrays)
    except OutdatedError as error:
        hint = "load_surrogate(file, outdated=True) opens it as it is"
        raise OutdatedError(f"{file}: {error}, and {hint}") from None
    except InputError as error:
        raise InputError(f"{file}: {error}") from None
    except Exception:  # whatever a damaged file raises
        raise InputError(f"{file} holds no surrogate; save_surrogate writes one") from None


def same_expansions(
    first: Surrogate | SurrogateOfChoices, second: Surrogate | SurrogateOfChoices
) -> bool:
    """Return whether surrogates have the same inputs and values, whatever judges them."""
    cases_of_first, cases_of_second = (
        surrogate.surrogates if isinstance(surrogate, SurrogateOfChoices) else {"": surrogate}
        for surrogate in (first, second)
    )
    if cases_of_first.keys() != cases_of_second.keys():
        return False
    pairs = ((case, cases_of_second[label]) for label, case in cases_of_first.items())
    return all(_same_expansions(*pair) for pair in pairs)


def _same_expansions(first: Surrogate, second: Surrogate) -> bool:
    bare_surrogates = (replace(case, held_out=None, verification=None) for case in (first, second))
    (about, arrays), (other_about, other_arrays) = map(_record, bare_surrogates)
    names = {name for name in {*arrays, *other_arrays} if name.startswith("expansions/")}
    return about["inputs"] == other_about["inputs"] and all(
        name in arrays and name in other_arrays and np.array_equal(arrays[name], other_arrays[name])
        for name in names
    )


def _path(file: str | PathLike[str]) -> Path:
    check_instance("file", file, str | PathLike, "a path")
    try:
        path = Path(file)
        with suppress(FileNotFoundError, NotADirectoryError):
            path.stat()
    except (OSError, ValueError, TypeError) as error:
        raise InputError(f"file must be a path; got {value_text(file)}: {error}") from None
    if path.is_dir():
        raise InputError(f"{path} is a folder; give the name of a file")
    return path


def _choices(about: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> SurrogateOfChoices:
    inputs = {name: _restore(input_record) for name, input_record in about["given"].items()}
    labels = cases(inputs)
    surrogates = {}
    for k, (label, record) in enumerate(zip(labels, about["parts"], strict=True)):
        surrogates[label] = surrogate = _surrogate(record, _under(f"{k}/", arrays))
        case_inputs = surrogate.space.user_inputs
        if any(case_inputs.get(name) != labels[label][name] for name in choices_of(inputs)):
            raise InputError(f"the choices of {label} must be those of its surrogate")
    if len(arrays) != sum(len(_under(f"{k}/", arrays)) for k in range(len(surrogates))):
        raise ValueError("arrays without a use")
    return SurrogateOfChoices(inputs, surrogates)


def _surrogate(about: Mapping[str, Any], arrays: Mapping[str, np.ndarray]) -> Surrogate:
    """Return the surrogate of a record and its arrays, which must fit together."""
    variables_by_path = {k: (dims, arrays[k], attrs) for k, (dims, attrs) in about["named"].items()}
    coords = _under("coords/", variables_by_path)
    variables = _under("diagnostics/", variables_by_path)
    labels = xr.DataArray(np.zeros(about["shape"]), dims=about["dims"], coords=coords)
    run_arrays = _under("held_out/", arrays)
    has_correction = any(name.startswith("correction/") for name in arrays)
    groups = {
        group: [_under(f"{group}/{k}/", arrays) for k in range(len(about["expansions"]))]
        for group in ("expansions", "correction")[: 1 + has_correction]
    }
    counts = (len(part) for parts in groups.values() for part in parts)
    if len(arrays) != len(variables_by_path) + len(run_arrays) + sum(counts):
        raise ValueError("arrays without a use")
    space = Space({name: _restore(record) for name, record in about["inputs"].items()})
    expansions = {
        group: tuple(
            _expansion(kind, part_arrays, space)
            for kind, part_arrays in zip(about["expansions"], parts, strict=True)
        )
        for group, parts in groups.items()
    }
    diagnostics = xr.Dataset(variables, attrs=about["attributes"])
    held_out = HeldOut(**run_arrays | {"window": run_arrays["window"][()]}) if run_arrays else None  # pyright: ignore
    verification = None
    if "verification" in about:
        record = about["verification"]
        dataset = xr.Dataset(_under("verification/", variables_by_path), attrs=record["attributes"])
        verification = dataset.set_coords(record["coords"])
    surrogate = Surrogate(
        space, labels, diagnostics=diagnostics, held_out=held_out, verification=verification,
        **expansions,
    )  # fmt: skip
    check(surrogate)
    return surrogate


def _expansion(kind: str, arrays: Mapping[str, np.ndarray], space: Space) -> Expansion:
    # the module of each kind of expansion that a file may hold, imported only if one holds it
    expansions = {
        "DirectExpansion": "flexband.uncertainty.expansions.direct",
        "PhaseExpansion": "flexband.uncertainty.phases.expansion",
    }
    return getattr(import_module(expansions[kind]), kind).of_arrays(space.families, **arrays)


def _under(start: str, entries: Mapping[str, Entry]) -> dict[str, Entry]:
    return {k.removeprefix(start): v for k, v in entries.items() if k.startswith(start)}


def _attributes(attributes: Mapping[Hashable, object]) -> dict[str, Record]:
    """Return attributes as finite numbers, texts, and lists of these."""

    def plain(value: object) -> Record:
        if isinstance(value, np.ndarray | np.generic):
            value = value.tolist()
        if isinstance(value, list | tuple):
            return [plain(entry) for entry in value]
        if isinstance(value, str | int) or (isinstance(value, float) and math.isfinite(value)):
            return value
        return str(value)

    return {str(name): plain(value) for name, value in attributes.items()}


def _to_record(value: object) -> Record:
    """Convert an input, or the value of one of its fields, to a record."""
    if isinstance(value, Input | Correlated | Choice):
        field_values = {f.name: getattr(value, f.name) for f in fields(value)}
        kind = type(value).__name__
        module = type(value).__module__
        return {"input": kind, "module": module, "fields": _to_record(tuple(field_values.items()))}
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Mapping):
        value = tuple(value.items())
    if isinstance(value, tuple | list):
        return [_to_record(entry) for entry in value]
    if value is None or isinstance(value, str | int | float):
        return value
    for key, functions in _FUNCTIONS.items():
        for name, function in functions.items():
            if value is function:
                return {key: name}
            if isinstance(function, type) and type(value) is function:
                field_values = {f.name: getattr(value, f.name) for f in fields(function)}
                return {key: name, "fields": _to_record(tuple(field_values.items()))}
    raise InputError(
        f"{value!r} cannot be saved; fields of inputs may be numbers, texts, tuples, inputs, None, "
        f"the correlations {', '.join(RandomField.correlations)} and functions in Field.functions"
    )


def _restore(record: Any) -> Any:
    """Return the value of a record; lists become tuples."""
    owners = {"correlation": "RandomField.correlations", "function": "Field.functions"}
    if isinstance(record, list):
        return tuple(_restore(entry) for entry in record)
    if not isinstance(record, Mapping):
        return record
    for key, functions in _FUNCTIONS.items():
        if key in record:
            name = record[key]
            if name not in functions:
                raise InputError(f"the {key} {name!r} must be in {owners[key]} first")
            if isinstance(functions[name], type):
                return functions[name](**dict(_restore(record["fields"])))
            return functions[name]
    values = dict(_restore(record["fields"]))
    kind = record["input"]
    if kind == "Choice":
        return Choice(*values["options"], probabilities=values.get("probabilities"))
    if kind == "Correlated":
        values["inputs"] = dict(values["inputs"])
    return _kind(kind, record["module"])(**values)


def _kind(name: str, module: str) -> type:
    """Return a class of inputs, whose module is imported if it is one of flexband."""
    # where modules are that are imported if a file holds an input of them
    own_inputs = "flexband.uncertainty.inputs."
    if name == "Correlated":
        return Correlated
    if name not in Input.kinds and module.startswith(own_inputs):
        import_module(module)
    if name not in Input.kinds:
        raise InputError(f"the input {name} must be defined first; import it from {module}")
    return Input.kinds[name]
