"""A study that can be run into a folder, and the one that a file defines."""

from __future__ import annotations

import runpy
import sys
import traceback
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from flexband.basics.arguments import Fixed, arguments_checked
from flexband.basics.former_names import former_arguments
from flexband.basics.progress import Progress
from flexband.basics.response import ResponseFunction
from flexband.errors import InputError
from flexband.requirements.requirement import Requirements
from flexband.requirements.scatter import Scatter
from flexband.study.definition import StudyDefinition
from flexband.uncertainty.methods.method import Method

if TYPE_CHECKING:
    from flexband.study.results.result import StudyResult
    from flexband.study.run import RunOptions


@former_arguments(limits="requirements")
@arguments_checked
class Study(StudyDefinition):
    """A response, its inputs and a method; `flexband run` reads the one named ``study`` in a file.

    Parameters
    ----------
    response, inputs, method, sigmas : as in `propagate`.
    requirements : a `Requirement`, or several, which `flexband run` checks with the surrogate of
        the method.
    scatter : how tolerances scatter in production, as for `production_yield`, for the yield.
    units : texts such as ``"mm"`` by names of inputs: of the numbers that the response takes.
    display_units : units such as ``"deg"`` by names of outputs and of inputs with `units`, in which
        commands and the report show numbers. All computations and files keep the others.
    title_block : texts for the head of the report: "title", "author", "part" (number), "drawing"
        (number), "revision", "date", "comment". ``wiper.toml`` beside ``wiper.py`` may have them,
        too.

    Raises
    ------
    InputError
        If the inputs and the response's arguments do not match, `method` is not a method, `sigmas`
        is not a positive number, `requirements` has something else than a `Requirement`, `units`
        has a name that is no input's or a unit that is no text, a display unit is unknown or of
        another dimension, or `title_block` has another name.

    Examples
    --------
    >>> inputs = {"force": fb.Interval(90.0, 110.0), "compliance": fb.Normal(2e-3, 1e-4)}
    >>> study = fb.Study(lambda force, compliance: force * compliance, inputs, fb.PCCI(1, 1))
    >>> study.run()["mean"].values.round(4)
    array([0.18, 0.22])
    """

    def __init__(
        self,
        response: ResponseFunction,
        inputs: Mapping[str, Any],
        method: Method,
        sigmas: float = 1.0,
        requirements: Requirements = (),
        units: Mapping[str, str] = Fixed({}),
        scatter: Scatter = Fixed({}),
        display_units: Mapping[str, str] = Fixed({}),
        title_block: Mapping[str, str] = Fixed({}),
    ) -> None:
        super().__init__(
            response=response,
            inputs=inputs,
            method=method,
            sigmas=sigmas,
            requirements=requirements,
            units=units,
            scatter=scatter,
            display_units=display_units,
            title_block=title_block,
        )

    def run_in(
        self,
        folder: str | Path,
        options: RunOptions | None = None,
        *,
        progress: Progress | None = None,
    ) -> StudyResult:
        """Run the study into a folder, as ``flexband run`` does, without its report.

        Every run is recorded as soon as it is finished. A study that was stopped goes on where it
        was; if the folder has its result already, that is read.

        Parameters
        ----------
        folder : for runs and results, which is made if it does not exist.
        options : how the study is run.
        progress : as in `propagate`; it takes the runs of the method, then those that verify.

        Returns
        -------
        StudyResult
            Bands, surrogate, verification, contributions, limits, and doubts about them.

        Raises
        ------
        StoreError
            If another process runs a study in the folder, or it has another study's results.
        InputError, RunError, RunsNeeded
            As `propagate` raises them.
        """
        from flexband.study.run import run_study  # noqa: PLC0415

        count = progress or (lambda done, total: None)
        return run_study(self, folder, options, task=lambda name: count)


def load_study(file: Path) -> Study:
    """Run a Python file and return its `study`.

    Raise `InputError` if the file does not exist, fails, or does not define a `Study` of that name.
    """
    if not file.is_file():
        raise InputError(f"file must be a Python file that exists; got {str(file)!r}")
    sys.path.insert(0, str(file.resolve().parent))
    try:
        variables = runpy.run_path(str(file))
    except (Exception, SystemExit) as error:
        frames = traceback.extract_tb(error.__traceback__)
        lines = [f", line {frame.lineno}" for frame in frames if frame.filename == str(file)]
        reason = error if isinstance(error, InputError) else f"{type(error).__name__}: {error}"
        raise InputError(f"{file}{lines[-1] if lines else ''}: {reason}") from error
    study = variables.get("study")
    if not isinstance(study, Study):
        study_names = [name for name, value in variables.items() if isinstance(value, Study)]
        description = f"{study!r}" if study is not None else "no `study`"
        hint = f"; {study_names[0]!r} is one, call it study" if study_names else ""
        raise InputError(f"{file} must define `study`, a flexband.Study; got {description}{hint}")
    return study
