"""Runs at the nominal values, on the discretization of the others, for requirements around it."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import xarray as xr

from flexband.analysis.selection import AnySurrogate, labels_of, surrogates_of
from flexband.analysis.verification.expanded_runs import runs_as_expanded
from flexband.basics.files import try_write
from flexband.basics.progress import listener
from flexband.errors import InputError
from flexband.execution.names import FileName
from flexband.execution.store import open_runs
from flexband.requirements.corridors import at_more_times
from flexband.requirements.requirement import Requirement, Requirements, requirement_tuple
from flexband.study.presentation.display import Display
from flexband.study.results.netcdf import read_netcdf, write_netcdf
from flexband.study.start_vibrations import attributes, start_vibrations
from flexband.uncertainty.inputs.evaluation import coordinates
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.runs.between import parts_between
from flexband.uncertainty.surrogates.bands import BandRecord
from flexband.uncertainty.surrogates.surrogate import Surrogate

if TYPE_CHECKING:
    from flexband.study.definition import StudyDefinition


def write_nominal(
    study: StudyDefinition, surrogate: AnySurrogate, folder: Path, **options: Any
) -> int:
    """Run the nominal of each combination of options if a requirement needs it; return how many.

    `options` are those of the runs, such as store and executor.
    """
    if not any(requirement.needs_nominal for requirement in requirement_tuple(study.requirements)):
        return 0
    cases = surrogates_of(surrogate)
    values = []
    with runs_as_expanded(study.response, study.inputs, **options) as runs_of:
        for label, case in cases.items():
            made = runs_of(case, label, lambda *_: None)(case.space.nominal())
            assert made.values is not None
            values.append(made.values.values[0])
    labels = next(iter(cases.values())).labels
    data = xr.DataArray(
        np.stack(values), dims=("case", *labels.dims[1:]), coords=coordinates(labels)
    )
    nominal = xr.Dataset({"nominal": data}).assign_coords(case=[label or "-" for label in cases])
    try_write(lambda: write_netcdf(nominal, folder / FileName.NOMINAL))
    return len(cases)


def bands_with_nominal(
    study: StudyDefinition, surrogate: AnySurrogate, folder: Path, **options: Any
) -> xr.Dataset:
    """Return the bands of a surrogate, with what nominal runs tell in their attributes.

    These are runs for requirements around the nominal, which count, and which vibrations the start
    of the motion excites (`start_vibrations`).
    """
    nominal = write_nominal(study, surrogate, folder, **options)
    listener().stage("the bands of the expansion")
    bands = surrogate.bands(study.sigmas)
    if nominal:
        runs = BandRecord.read(bands).runs + nominal
        bands = bands.assign_attrs(runs=runs, runs_nominal=nominal)
    if not study.runs_elsewhere:
        bands.attrs |= attributes(start_vibrations(study, surrogate, bands))
    return bands


def around_nominal(
    limits: Requirements,
    folder: Path,
    surrogate: AnySurrogate,
    display: Display = Display(),
) -> list[Requirement]:
    """Return requirements in display units, with the nominal that a study wrote into its folder.

    Raise `InputError` if one needs it, and it is not there.
    """
    requirements = display.requirements(requirement_tuple(limits), labels_of(surrogate))
    if not any(requirement.needs_nominal for requirement in requirements):
        return requirements
    try:
        data = read_netcdf(folder / FileName.NOMINAL)["nominal"]
    except FileNotFoundError:
        raise InputError(
            f"'{folder}' has no {FileName.NOMINAL} of its study; `flexband run` writes it"
        ) from None
    cases = {
        "" if str(label) == "-" else str(label): data.isel(case=k, drop=True)
        for k, label in enumerate(data["case"].values)
    }
    return [requirement.around(cases) for requirement in requirements]


def with_runs(
    study: StudyDefinition,
    surrogate: AnySurrogate,
    requirements: list[Requirement],
    margins: xr.Dataset,
    **options: Any,
) -> tuple[xr.Dataset, int]:
    """Return margins with `run_margin`: that of a run where the surrogate alone does not decide.

    The run is at the worst tolerances, with random inputs at their means. One that leaves the
    bounds there by more than the error of the discretization shows that the requirement is not met,
    however wrong the surrogate is. It is NaN where none does. The number of runs is returned as
    well. `options` are those of the runs, such as store and executor.
    """
    unknown = xr.full_like(margins["least_margin"], np.nan)
    run_margins = margins.get("run_margin", unknown).values.copy()
    count = 0
    recorded = margins.get("recorded_margin", unknown).values.copy()
    cases = surrogates_of(surrogate)
    # Requirements that the surrogate alone does not decide.
    unsure = margins["verdict"].values.astype(str) == "undecided"
    if not any(case.space.random_dimension for case in cases.values()):
        unsure |= margins["run_required"].values
    suspects = np.flatnonzero(
        unsure & (margins["margin_between"].values < 0) & np.isnan(run_margins)
    )
    if not suspects.size or "worst_inputs" not in margins:
        return margins, 0
    with runs_as_expanded(study.response, study.inputs, **options) as runs_of:
        for k in suspects:
            limit = margins.isel(limit=k)
            label = str(limit["worst_choice"].values) if "worst_choice" in limit else ""
            case = cases[label]
            # The point of the run: the worst tolerances, and means of random inputs.
            tolerances = Space(case.space.of_kind(random=False))
            values = dict(
                zip(limit["input"].values.tolist(), limit["worst_inputs"].values, strict=True)
            )
            if set(values) != set(tolerances.inputs):  # those of interval fields
                continue
            _, eta = tolerances.standardize(values)
            points = np.zeros((1, case.space.random_dimension)), np.reshape(eta, (1, -1))
            made = runs_of(case, label, lambda *_: None)(points)
            assert made.values is not None
            # Its margin counts if the discretization does not explain it.
            corridor = requirements[k].corridor(case.labels, label)
            run = made.values.values[0]
            margin = corridor.margin(run, run)
            count = count + 1
            at = np.unravel_index(int(np.argmin(margin)), margin.shape)
            error = np.broadcast_to(discretization_error(case), margin.shape)[at]
            recorded[k] = np.fmin(recorded[k], margin[at])
            if margin[at] + error < 0:
                run_margins[k] = margin[at]
    columns = {"run_margin": run_margins, "recorded_margin": recorded}
    made = margins.assign({name: ("limit", column) for name, column in columns.items()})
    return made.assign_attrs(runs=count), count


def discretization_error(surrogate: Surrogate) -> np.ndarray | float:
    """Return the error of a run's step and elements, of the shape of a run; 0 if it is not known.

    Past the horizon a run is one of many that are as likely, and this error is not one of shares.
    """
    name = "error_bar_discretization_error"
    data = surrogate.diagnostics
    return data[name].transpose(*surrogate.labels.dims[1:]).values if name in data else 0.0


def with_recorded(
    surrogate: AnySurrogate,
    requirements: list[Requirement],
    margins: xr.Dataset,
    folder: Path,
) -> xr.Dataset:
    """Return margins with the value in all runs that is nearest to a bound, or farthest beyond it.

    It is `run_value`, the bound `run_bound`, its distance from it `recorded_margin`, below zero
    beyond, and `run_extreme` "largest", "smallest" or, at a curve, "most critical";
    ``attrs["runs_recorded"]`` counts the runs. If all inputs are intervals, there is a `run_margin`
    as in `with_runs`. With choices, whose bounds may differ, nothing is added.
    """
    if len(surrogates_of(surrogate)) > 1:
        return margins
    (case,) = surrogates_of(surrogate).values()
    stores = [folder, *(f for f in [folder / FileName.SAMPLES] if (f / FileName.RUNS).exists())]
    count = 0
    extremes = dict[int, RunExtreme]()
    for runs in itertools.chain.from_iterable(map(_blocks, stores)):
        count += len(runs)
        for k, requirement in enumerate(requirements):
            extreme = RunExtreme.from_runs(runs, requirement, case)
            extreme_so_far = extremes.setdefault(k, extreme)
            extremes[k] = min(
                extreme_so_far, extreme, key=lambda candidate: candidate.recorded_margin
            )
    columns = {
        name: ("limit", [getattr(extremes[k], name) for k in range(len(requirements))])
        for name in RunExtreme._fields
    }
    if case.space.random_dimension or "corrected" in case.diagnostics.attrs:
        del columns["run_margin"]
    return margins.assign(columns).assign_attrs(runs_recorded=count)


def _blocks(folder: Path, at_once: int = 64) -> Iterator[xr.DataArray]:
    """Yield the recorded outputs of runs that succeeded, some at a time."""
    outputs = open_runs(folder)["outputs"]
    for first in range(0, outputs.sizes["run"], at_once):
        block = outputs.isel(run=slice(first, first + at_once)).dropna("run")
        if len(block):
            yield block


class RunExtreme(NamedTuple):
    """The value in some runs that is nearest to a bound: what `with_recorded` returns."""

    run_value: float
    run_bound: float
    recorded_margin: float
    run_extreme: str
    run_margin: float

    @classmethod
    def from_runs(cls, runs: xr.DataArray, requirement: Requirement, case: Surrogate) -> RunExtreme:
        parts = parts_between(runs, case.labels)
        corridor = requirement.corridor(case.labels).at_more_times(parts)
        error = np.broadcast_to(discretization_error(case), case.labels.shape[1:])
        margin = corridor.margin(runs.values, runs.values)
        place = np.unravel_index(margin.argmin(), runs.shape)
        value = runs.values[place]
        ends = [corridor.upper, corridor.lower]
        side = int(ends[0][place[1:]] - value > value - ends[1][place[1:]])
        curve = np.unique(ends[side][np.isfinite(ends[side])]).size > 1
        extreme = "most critical" if curve else ("largest", "smallest")[side]
        beyond = margin[place] + at_more_times(error, parts)[place[1:]] < 0
        decisive = margin[place] if beyond else np.nan
        return cls(value, ends[side][place[1:]], margin[place], extreme, decisive)
