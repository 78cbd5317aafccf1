"""What a study is: a response, its uncertain inputs, a method, and requirements; data only."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any, Self

import xarray as xr

from flexband.basics.arguments import Fixed, frozen
from flexband.basics.checks import check_instance
from flexband.basics.former_names import warn_of_former_name
from flexband.basics.progress import Progress
from flexband.basics.response import Response, ResponseFunction, as_response
from flexband.errors import InputError
from flexband.requirements.criteria import Probability, ShareOfParts
from flexband.requirements.requirement import Requirement, Requirements, requirement_tuple
from flexband.requirements.scatter import Scatter, ScatteringTolerances
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
    from flexband.uncertainty.surrogates.choices import SurrogateOfChoices
    from flexband.uncertainty.surrogates.surrogate import Surrogate


@frozen()
class StudyDefinition:
    """A response, its inputs and a method: what `Study` has, without what runs it into a folder.

    Parameters and errors are those of `Study`.
    """

    response: ResponseFunction
    inputs: Mapping[str, Any]
    method: Method
    sigmas: float = 1.0
    requirements: Requirements = ()
    units: Mapping[str, str] = field(default_factory=dict)
    scatter: Scatter = field(default_factory=dict)
    display_units: Mapping[str, str] = field(default_factory=dict)
    title_block: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        check_names(self.response, self.inputs)
        as_method(self.method)
        check_instance("scatter", self.scatter, Mapping, '{"length": fb.Uniform(0.9, 1.1)}')
        display = Display.from_units(self.display_units, self.units, self.inputs)
        field_values = {
            "inputs": Fixed(self.inputs),
            "sigmas": checked_sigmas(self.sigmas),
            "requirements": tuple(dict.fromkeys(requirement_tuple(self.requirements))),
            "scatter": Fixed(self.scatter),
            "units": Fixed(display.units),
            "display_units": Fixed(display.display_units),
            "title_block": Fixed(checked_title_block("title_block", self.title_block)),
        }
        for name, value in field_values.items():
            object.__setattr__(self, name, value)
        if self.scatter:
            ScatteringTolerances.from_scatter(self.scatter, Space(first_case(self.inputs)))
        _check_criteria(self)

    @property
    def limits(self) -> tuple[Requirement, ...]:
        """The requirements, by their former name."""
        warn_of_former_name("Study.limits", "Study.requirements")
        return requirement_tuple(self.requirements)

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
        for requirement in requirement_tuple(self.requirements):
            requirement.check_fits(labels)

    def with_method(self, method: Method) -> Self:
        """Return the same study with another method."""
        return replace(self, method=method)

    def with_domains(self) -> Self:
        """Return the same study with the domains of all fields set."""
        return replace(self, inputs=locate_fields(self.response, self.inputs)[0])

    def nominal(self) -> xr.DataArray:
        """Return the response with every input at its nominal value: ξ = 0, η = 0.

        That is the midpoint of an interval, and the mean of a random input; of a `LogNormal`, and
        of distributions with heavy tails, the median.
        """
        space = Space(first_case(self.with_domains().inputs))
        nominal = space.nominal()
        evaluation = Evaluations()(self.response, space, "", nominal, None, lambda *_: None)
        assert evaluation.values is not None
        return evaluation.values.isel(sample=0)

    def fields(self) -> dict[str, Field]:
        """Return the fields among the inputs, with their domains set."""
        return {k: i for k, i in self.with_domains().inputs.items() if isinstance(i, Field)}


def _check_criteria(study: StudyDefinition) -> None:
    """Raise `InputError` if a criterion needs random inputs, or a scatter, that a study has not."""
    for requirement in requirement_tuple(study.requirements):
        criterion = requirement.criterion
        label = requirement.label
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
