"""A study: a response, its uncertain inputs, and a method."""

from __future__ import annotations

import runpy
import sys
import traceback
from collections.abc import Mapping
from dataclasses import field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr

from flexband.analysis.requirements.criteria import Probability, ShareOfParts
from flexband.analysis.requirements.requirement import Requirements, several
from flexband.analysis.requirements.scatter import Scatter, ScatteringTolerances
from flexband.arguments import frozen
from flexband.errors import InputError, check_instance
from flexband.progress import Progress
from flexband.response import Response, ResponseFunction, as_response
from flexband.study.presentation.display import Display, names_of_inputs
from flexband.study.presentation.title_block import checked_title_block
from flexband.uncertainty.inputs.fields.field import Field
from flexband.uncertainty.inputs.space import Space, check_names, locate_fields
from flexband.uncertainty.inputs.unfolding import first_case
from flexband.uncertainty.methods.method import Method, as_method
from flexband.uncertainty.propagate import expand, propagate
from flexband.uncertainty.runs.evaluations import BATCH, Evaluations
from flexband.uncertainty.surrogates.sigmas import checked_sigmas

if TYPE_CHECKING:
    from os import PathLike

    from flexband.execution.executors import ExecutorLike
    from flexband.execution.store import Store
    from flexband.study.results.result import StudyResult
    from flexband.study.run import RunOptions
    from flexband.uncertainty.surrogates.choices import SurrogateOfChoices
    from flexband.uncertainty.surrogates.surrogate import Surrogate


@frozen()
class Study:
    """A response, its inputs and a method; `flexband run` reads the one named ``study`` in a file.

    Parameters
    ----------
    response, inputs, method, sigmas : as in `propagate`.
    limits, requirements : a `Requirement` or a `Limit`, or several, which `flexband run` checks
        with the surrogate of the method. Both names mean the same; both then have all of them.
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
        If the inputs and the response's arguments do not match, the method is none, `sigmas` is
        not a positive number, `limits` or `requirements` are none, `units` has a name that is no
        input's or a unit that is no text, a display unit is none or of another dimension, or
        `title_block` has another name.

    Examples
    --------
    >>> inputs = {"force": fb.Interval(90.0, 110.0), "compliance": fb.Normal(2e-3, 1e-4)}
    >>> study = fb.Study(lambda force, compliance: force * compliance, inputs, fb.PCCI(1, 1))
    >>> study.run()["mean"].values.round(4)
    array([0.18, 0.22])
    """

    response: ResponseFunction
    inputs: Mapping[str, Any]
    method: Method
    sigmas: float = 1.0
    limits: Requirements = ()
    units: Mapping[str, str] = field(default_factory=dict)
    requirements: Requirements = ()
    scatter: Scatter = field(default_factory=dict)
    display_units: Mapping[str, str] = field(default_factory=dict)
    title_block: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_names(self.response, self.inputs)
        as_method(self.method)
        object.__setattr__(self, "inputs", dict(self.inputs))
        object.__setattr__(self, "sigmas", checked_sigmas(self.sigmas))
        both = *several(self.limits), *several(self.requirements, "requirements")
        for name in ("limits", "requirements"):
            object.__setattr__(self, name, tuple(dict.fromkeys(both)))
        check_instance("scatter", self.scatter, Mapping, '{"length": fb.Uniform(0.9, 1.1)}')
        if self.scatter:
            space = Space(first_case(self.inputs))
            ScatteringTolerances.of(self.scatter, space)
        object.__setattr__(self, "scatter", dict(self.scatter))
        _check_criteria(self)
        display = Display.of(self.display_units, self.units, self.inputs)
        object.__setattr__(self, "units", display.units)
        object.__setattr__(self, "display_units", display.chosen)
        block = checked_title_block("title_block", self.title_block)
        object.__setattr__(self, "title_block", block)

    @property
    def display(self) -> Display:
        """In which units numbers are shown: ``study.display.data(bands)`` are bands in these."""
        return Display(self.display_units, self.units)

    @property
    def expands(self) -> bool:
        """Whether the method makes a surrogate, so that `expand` can be called."""
        return as_method(self.method).expands

    @property
    def runs_elsewhere(self) -> bool:
        """Whether others run the response: `elsewhere`."""
        return as_response(self.response).elsewhere

    @property
    def source(self) -> Response:
        """The response that makes the outputs, also of a study over one of them."""
        return as_response(self.response).source

    def run(
        self,
        *,
        batch: int = BATCH,
        store: Store | str | PathLike[str] | None = None,
        executor: ExecutorLike = None,
        failed: str = "stop",
        progress: Progress | None = None,
    ) -> xr.Dataset:
        """Return the bands; parameters and errors are those of `propagate`."""
        return propagate(
            self.response,
            self.inputs,
            self.method,
            sigmas=self.sigmas,
            batch=batch,
            store=store,
            executor=executor,
            failed=failed,
            check=self._check_requirements,
            progress=progress,
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

    def expand(
        self,
        *,
        batch: int = BATCH,
        store: Store | str | PathLike[str] | None = None,
        executor: ExecutorLike = None,
        failed: str = "stop",
        progress: Progress | None = None,
    ) -> Surrogate | SurrogateOfChoices:
        """Return the surrogate; parameters and errors are those of `flexband.expand`."""
        return expand(
            self.response,
            self.inputs,
            self.method,
            batch=batch,
            store=store,
            executor=executor,
            failed=failed,
            check=self._check_requirements,
            progress=progress,
        )

    def _check_requirements(self, labels: xr.DataArray) -> None:
        """Raise `InputError` if a requirement or a display unit does not fit the outputs."""
        self.display.check_fits(labels, names_of_inputs(self.inputs))
        for requirement in several(self.requirements):
            requirement.check_fits(labels)

    def using(self, method: Method) -> Study:
        """Return the same study with another method."""
        return replace(self, method=method)

    def located(self) -> Study:
        """Return the same study with the domains of all fields set."""
        return replace(self, inputs=locate_fields(self.response, self.inputs)[0])

    def nominal(self) -> xr.DataArray:
        """Return the response with every input at its nominal value: ξ = 0, η = 0.

        That is the midpoint of an interval, and the mean of a random input; of a `LogNormal`, and
        of distributions with heavy tails, the median.
        """
        space = Space(first_case(self.located().inputs))
        nominal = space.nominal()
        evaluation = Evaluations()(self.response, space, "", nominal, None, lambda *_: None)
        assert evaluation.values is not None
        return evaluation.values.isel(sample=0)

    def fields(self) -> dict[str, Field]:
        """Return the fields among the inputs, with their domains set."""
        return {k: i for k, i in self.located().inputs.items() if isinstance(i, Field)}


def _check_criteria(study: Study) -> None:
    """Raise `InputError` if a criterion needs random inputs, or a scatter, that a study has not."""
    for requirement in several(study.requirements):
        criterion, label = requirement.criterion, requirement.label
        if isinstance(criterion, ShareOfParts) and not study.scatter:
            raise InputError(
                f"{label} criterion ShareOfParts requires the study's scatter, such as "
                'Study(…, scatter={"length": fb.Uniform(0.9, 1.1)})'
            )
        random = Space(first_case(study.inputs)).of_kind(random=True)
        if isinstance(criterion, Probability) and not random:
            raise InputError(
                f"{label} criterion Probability requires random inputs; ShareOfParts is about "
                "tolerances that scatter"
            )


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
        near = [name for name, value in variables.items() if isinstance(value, Study)]
        description = f"{study!r}" if study is not None else "no `study`"
        hint = f"; {near[0]!r} is one, call it study" if near else ""
        raise InputError(f"{file} must define `study`, a flexband.Study; got {description}{hint}")
    return study
