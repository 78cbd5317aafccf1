"""A functional mock-up unit (FMU) for co-simulation as a response, run by FMPy."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import field
from hashlib import sha256
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_finite, check_instance, check_numbers, check_positive
from flexband.basics.words import value_text
from flexband.errors import InputError, ModelError
from flexband.models.fmu_variables import (
    access,
    assigned_variables,
    differs,
    recorded_variables,
    unit,
)
from flexband.models.one_by_one import OneByOne

if TYPE_CHECKING:
    from fmpy import model_description as fmi  # pyright: ignore[reportMissingImports]

    from flexband.models.fmu_variables import Assignments


@frozen()
class FMU(OneByOne):
    """``response(**values)``: simulate an FMU for co-simulation, FMI 2.0 or 3.0, for each sample.

    The inputs are parameters, inputs and start values of the FMU, by name; inputs stay constant in
    time. Each sample extracts and loads the FMU anew, so that none depends on those before it. FMPy
    is needed: ``pip install 'flexband[fmi]'``.

    Parameters
    ----------
    path : the file.
    times : at which the outputs are recorded [s], increasing. The simulation begins at the start
        time of the FMU's default experiment, or at 0.
    outputs : names of the variables to record; all that the FMU calls outputs if None.
    step : longest communication step [s]. By default it is that of the FMU's default experiment, or
        as long as from one of the `times` to the next. Steps are shortened to meet the `times`.

    Attributes
    ----------
    checksum : SHA-256 of the file, which must not change afterwards.

    Raises
    ------
    ImportError
        If FMPy is not installed.
    InputError
        If the file is no FMU for co-simulation, or not one for this kind of computer, it does not
        have a variable, or `times` require steps that it cannot take. By a call, if a variable is
        unknown, cannot be set, or has another value after initialization; messages list what is
        known.
    ModelError
        By a call, if the FMU reports an error or ends early; the message shows what it has logged.
    """

    path: str | os.PathLike[str]
    times: ArrayLike
    outputs: Sequence[str] | None = None
    step: float | None = None
    checksum: str = field(init=False, default="")

    def __post_init__(self) -> None:
        check_instance("FMU path", self.path, str | os.PathLike, "the path of a file")
        path = os.path.abspath(os.fspath(self.path))
        if not os.path.isfile(path):
            raise InputError(f"FMU path must be a file that exists; got {value_text(self.path)}")
        times = np.atleast_1d(check_finite("FMU times [s]", self.times, rank=None))
        if times.ndim > 1 or np.any(np.diff(times) <= 0):
            raise InputError(f"FMU times [s] must increase; got {value_text(self.times)}")
        if isinstance(self.outputs, str):
            raise InputError(f"FMU outputs must be a list of names; got {self.outputs!r}")
        if self.step is not None:
            check_positive("FMU step [s]", check_numbers("FMU step [s]", self.step))
        attributes = {"path": path, "times": tuple(times.tolist()), "checksum": _checksum(path)}
        for name, value in attributes.items():
            object.__setattr__(self, name, value)
        description = self._description(validate=True)
        names = None if self.outputs is None else list(self.outputs)
        object.__setattr__(
            self, "outputs", tuple(v.name for v in recorded_variables(description, names))
        )
        self._communication(description)

    @property
    def identity(self) -> tuple[object, ...]:
        """What the results depend on: the content of the file, wherever it is."""
        return self.checksum, self.times, self.outputs, self.step

    def sample(self, **values: Any) -> xr.DataArray:
        """Return the outputs of one simulation, dims (output, time)."""
        if _checksum(self.path) != self.checksum:
            raise ModelError(f"the FMU {self.path} has changed since the response was made")
        description = self._description()
        outputs = recorded_variables(description, list(self.outputs or ()))
        assignments = assigned_variables(description, values)
        messages: list[str] = []
        with TemporaryDirectory(prefix="flexband-") as folder:
            _fmpy("fmpy").extract(self.path, folder)
            run = _Run(folder, description, messages)
            try:
                run.start(self._start(description), self._ends[-1], assignments)
                rows = [run.read(outputs)] if self._ends[0] == self._start(description) else []
                for begin, step, count in self._communication(description):
                    run.advance(begin, step, count)
                    rows.append(run.read(outputs))
            except run.failure as error:
                run.fatal = (
                    getattr(error, "status", 0) == 4
                )  # after which no function may be called
                raise ModelError(f"the FMU fails: {error}{_last_messages(messages)}") from error
            finally:
                run.end()
        return xr.DataArray(
            np.array(rows).T,
            dims=("output", "time"),
            coords={
                "output": [v.name for v in outputs],
                "unit": ("output", [unit(v) for v in outputs]),
                "time": ("time", np.array(self._ends), {"units": "s"}),
            },
        )

    @property
    def _ends(self) -> tuple[float, ...]:
        return self.times  # pyright: ignore[reportReturnType]

    def _description(self, *, validate: bool = False) -> fmi.ModelDescription:
        """Return what FMPy reads of the FMU; raise `InputError` if it cannot be simulated."""
        fmpy = _fmpy("fmpy")
        try:
            description = fmpy.read_model_description(self.path, validate=validate)
            platforms = fmpy.supported_platforms(self.path)
        except Exception as error:  # FMPy raises many kinds
            raise InputError(
                f"FMU path must be an FMU; {self.path} cannot be read: {error}"
            ) from error
        if description.fmiVersion != "2.0" and not description.fmiVersion.startswith("3."):
            raise InputError(f"FMU path must be of FMI 2.0 or 3.0; got {description.fmiVersion}")
        if description.coSimulation is None:
            raise InputError(f"FMU path must be an FMU for co-simulation; {self.path} is not")
        if fmpy.platform not in platforms:
            raise InputError(
                f"FMU path must be an FMU for {fmpy.platform}; {self.path} is for "
                f"{', '.join(platforms) or 'nothing'}"
            )
        return description

    def _start(self, description: fmi.ModelDescription) -> float:
        experiment = description.defaultExperiment
        return float((experiment and experiment.startTime) or 0.0)

    def _communication(self, description: fmi.ModelDescription) -> list[tuple[float, float, int]]:
        """Return begin, communication step and number of steps between all times."""
        start = self._start(description)
        ends = self._ends
        if ends[0] < start:
            raise InputError(f"FMU times [s] must not be before its start {start:g}; got {ends[0]}")
        experiment = description.defaultExperiment
        longest = self.step or float((experiment and experiment.stepSize) or np.inf)
        points = ends if ends[0] == start else (start, *ends)
        parts = []
        equal = 1e-6  # relative difference of equal steps
        for begin, end in pairwise(points):
            count = max(1, int(np.ceil((end - begin) / longest - equal)))
            parts.append((begin, (end - begin) / count, count))
        steps = [step for _, step, _ in parts]
        variable = description.coSimulation.canHandleVariableCommunicationStepSize
        if not variable and steps and max(steps) - min(steps) > equal * max(steps):
            raise InputError(
                f"this FMU takes equal communication steps only; FMU times with step "
                f"{longest:g} s would need steps from {min(steps):g} to {max(steps):g} s"
            )
        return parts


class _Run:
    """An FMU that is instantiated, through FMPy."""

    def __init__(self, folder: str, description: fmi.ModelDescription, messages: list[str]):
        self.description = description
        self.fatal = False
        simulation = _fmpy("fmpy.simulation")
        self.failure: type[Exception] = _fmpy("fmpy.fmi1").FMICallException

        def log(*parts: bytes) -> None:
            messages.append(parts[-1].decode(errors="replace"))

        try:
            self.fmu = simulation.instantiate_fmu(folder, description, "CoSimulation", logger=log)
        except Exception as error:
            raise ModelError(
                f"the FMU cannot be loaded: {error}{_last_messages(messages)}"
            ) from error

    def start(self, begin: float, end: float, assignments: Assignments) -> None:
        """Set the values and initialize; raise `InputError` if a value is then another."""
        if self.description.fmiVersion == "2.0":
            self.fmu.setupExperiment(startTime=begin, stopTime=end)
        for variable, value in assignments.values():
            kind = access(self.description, variable)
            getattr(self.fmu, f"set{kind}")([variable.valueReference], [value])
        if self.description.fmiVersion == "2.0":
            self.fmu.enterInitializationMode()
        else:
            self.fmu.enterInitializationMode(startTime=begin, stopTime=end)
        self.fmu.exitInitializationMode()
        for name, (variable, value) in assignments.items():
            reading = self._get(access(self.description, variable), [variable])[0]
            if differs(value, reading):
                raise InputError(
                    f"{name} cannot be set in this FMU: it was set to {value!r} and is {reading!r} "
                    "after initialization"
                )

    def advance(self, begin: float, step: float, count: int) -> None:
        """Take equal steps."""
        for k in range(count):
            ended = self.fmu.doStep(begin + k * step, step)
            if ended and (ended[1] or ended[2]):  # FMI 3.0: terminated, returned early
                raise ModelError(f"the FMU ends at {begin + k * step:g} s")

    def read(self, variables: list[fmi.ScalarVariable]) -> np.ndarray:
        """Return the values of variables now."""
        values = np.empty(len(variables))
        kinds = [access(self.description, v) for v in variables]
        for kind in dict.fromkeys(kinds):
            places = [k for k, variable_kind in enumerate(kinds) if variable_kind == kind]
            values[places] = self._get(kind, [variables[k] for k in places])
        return values

    def end(self) -> None:
        """Free the instance, unless that is forbidden."""
        if not self.fatal:
            self.fmu.freeInstance()

    def _get(self, kind: str, variables: list[fmi.ScalarVariable]) -> list[Any]:
        return getattr(self.fmu, f"get{kind}")([v.valueReference for v in variables])


def _checksum(path: str | os.PathLike[str]) -> str:
    return sha256(Path(path).read_bytes()).hexdigest()


def _fmpy(module: str) -> Any:
    """Return a module of FMPy; raise `ImportError` with how to install it if it is missing."""
    try:
        return import_module(module)
    except ImportError as error:
        raise ImportError(
            "the package 'fmpy' is needed here; install it by: pip install 'flexband[fmi]'"
        ) from error


def _last_messages(messages: list[str], count: int = 5) -> str:
    """Return the last messages of an FMU, as text to append."""
    last = [f"\n    {message}" for message in messages[-count:]]
    return f". Its last messages:{''.join(last)}" if last else ""
