"""The result of a study that was run into a folder."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import xarray as xr

from flexband.analysis.limits.least_margin import MarginRecord
from flexband.analysis.limits.limit_verdicts import (
    LimitCheck,
    requirement_verdicts,
    uncertain_inputs,
)
from flexband.analysis.selection import AnySurrogate
from flexband.basics.warning import warn
from flexband.errors import InputError, StoreError
from flexband.execution.names import WRITTEN_BY_RUN, FileName
from flexband.remarks.collection import CollectedRemark, remarks_of
from flexband.requirements.verdict import RequirementVerdict
from flexband.study.folder import StudyFolder, checksum_of
from flexband.study.nominal import around_nominal
from flexband.study.presentation.display import Display
from flexband.study.results.answers import OF_STUDY, Unusable, read_answers
from flexband.study.results.netcdf import read_netcdf
from flexband.study.results.reliability import Doubt, DoubtKind
from flexband.study.results.result_files import stale_results
from flexband.uncertainty.surrogates.bands import BandRecord
from flexband.uncertainty.surrogates.surrogate_file import load_surrogate
from flexband.uncertainty.surrogates.verification_verdict import (
    Confirmation,
    VerificationRecord,
    inferred_share,
)

if TYPE_CHECKING:
    from flexband.requirements.requirement import Requirements
    from flexband.requirements.scatter import Scatter


@dataclass(frozen=True)
class StudyResult:
    """What a study has computed, and where it is written.

    Attributes
    ----------
    folder : where the files are.
    label : of the method.
    bands : interval mean and interval error bar, as `propagate` returns them.
    surrogate : as `expand` returns it; None if the method makes none.
    verification : result of `verify`; None if no runs verified the result.
    contributions : result of `contributions`; None without a surrogate, or where they failed.
    limits : whether the limits of the study are kept; None if it has none, or they are not checked.
    unchecked : the verdicts on requirements that the study has, but that could not be checked.
    doubts : why the result is not what was asked for.
    parts : results of `sample_parts` and `predictability_horizon` in one dataset, with choices
        along the dim "choice", where bands do not answer what is asked; else None.
    seconds_per_run : mean time of a run [s], with all that is made of it.
    files : names of the files that were written.
    stale : names of files in the folder that belong to earlier results.
    computed : by which command and file the result was computed, and when, as texts by name.
    failures : which steps failed that the next run repeats, such as "verification".
    reused : whether the folder had this result already, so that nothing was computed.
    """

    folder: Path
    label: str
    bands: xr.Dataset
    surrogate: AnySurrogate | None
    verification: xr.Dataset | None
    contributions: xr.Dataset | None
    limits: LimitCheck | None
    unchecked: tuple[RequirementVerdict, ...]
    doubts: tuple[Doubt, ...]
    parts: xr.Dataset | None
    seconds_per_run: float
    files: tuple[str, ...]
    stale: tuple[str, ...]
    computed: Mapping[str, str]
    failures: tuple[str, ...] = ()
    reused: bool = False

    @property
    def limits_unchecked(self) -> str:
        """Why requirements of the study could not be checked; "" if they were."""
        return self.unchecked[0].why if self.unchecked else ""

    @property
    def remarks(self) -> tuple[CollectedRemark, ...]:
        """What the runs warn of: the worst remark of each topic, and how many runs have one."""
        runs = self.bands if self.verification is None else self.verification  # which has both
        return remarks_of(runs.attrs)

    @property
    def unpredictable(self) -> bool:
        """Whether impacts make the motion of a part unpredictable, so that bands tell nothing."""
        return self.parts is not None and not bool(self.parts["predictable"].all())

    @property
    def runs(self) -> int:
        """Number of runs of the method."""
        return int(BandRecord.read(self.bands).runs)

    @property
    def result_files(self) -> list[str]:
        """Names of the files that no command but ``flexband run`` writes."""
        return [name for name in self.files if name != FileName.CONTRIBUTIONS]

    @property
    def answers(self) -> list[str]:
        sampled = ["parts"] * (self.parts is not None)
        if self.limits is None:
            return sampled
        likely = self.limits.probability is not None
        parts = self.limits.production is not None
        return [*sampled, "limits", *["probability"] * likely, *["yield"] * parts]

    @property
    def verdicts(self) -> list[RequirementVerdict]:
        """The verdict on every requirement of the study."""
        return self.verdicts_in(Display())

    def verdicts_in(self, display: Display) -> list[RequirementVerdict]:
        """Return the verdicts with their numbers in display units."""
        if self.limits is None:
            return list(self.unchecked)
        shares = None if self.unpredictable else self.contributions
        if self.surrogate is not None:
            shares = uncertain_inputs(shares, self.surrogate)
        verification = None if self.verification is None else display.data(self.verification)
        check = self.limits._replace(margins=display.data(self.limits.margins))
        return requirement_verdicts(check, shares, verification)

    def production_yield(
        self, requirements: Requirements, scatter: Scatter, **options: Any
    ) -> xr.Dataset:
        """Return the share of the parts that meet requirements, if tolerances scatter.

        It is `production_yield` of the surrogate, with requirements around the nominal response of
        the study.

        Parameters
        ----------
        requirements : such as those of the study, or others.
        scatter : of the tolerances, as for `production_yield`.
        options : the other ones of `production_yield`, such as `response` and `runs`.

        Raises
        ------
        InputError
            If the method made no surrogate, and as `production_yield` does.
        """
        # only here, since it takes a while to import
        from flexband.analysis.limits.production import production_yield  # noqa: PLC0415

        if self.surrogate is None:
            raise InputError(f"a yield requires a method with a surrogate; got {self.label}")
        absolute_requirements = around_nominal(requirements, self.folder, self.surrogate)
        return production_yield(self.surrogate, absolute_requirements, scatter, **options)

    def record(self) -> dict[str, Any]:
        """Return what study.json has of the result, beside its files."""
        content = {
            "label": self.label,
            "unchecked": [verdict.as_json() for verdict in self.unchecked],
            "verdicts": [verdict.as_json() for verdict in self.verdicts],
            "remarks": [remark.as_json() for remark in self.remarks],
            "doubts": [doubt.as_json() for doubt in self.doubts],
            "seconds_per_run": self.seconds_per_run,
            "files": list(self.files),
            "answers": self.answers,
            "computed": dict(self.computed),
            "failures": list(self.failures),
            "checksums": StudyFolder(self.folder).checksums(
                [self.folder / name for name in self.result_files]
            ),
        }
        return {**content, "checksum": checksum_of(content)}


def finished_result(folder: StudyFolder, identity: str) -> StudyResult | None:
    """Return the result in a folder; None unless it is that of this study, whole, and as written.

    A study.json that is damaged is warned of, and written again. `identity` is the hash of the
    study.
    """
    try:
        about = folder.read()
    except StoreError as error:
        warn(str(error))
        return None
    record: dict[str, Any] = about.get("result") or {}
    finished = about.get("state") == "finished" and not record.get("failures")
    if about.get("identity") != identity or not finished:
        return None
    try:
        return _read(folder.path, record) if folder.is_result(record) else None
    except (InputError, OSError, KeyError, ValueError):
        return None


def _read(folder: Path, record: Mapping[str, Any]) -> StudyResult:
    files = record["files"]
    verification, contributions = (
        read_netcdf(folder / name) if name in files else None
        for name in (FileName.VERIFICATION, FileName.CONTRIBUTIONS)
    )
    answers = read_answers(folder, WRITTEN_BY_RUN)
    limits = None
    if Unusable.ALTERED in answers.unusable.values():
        raise InputError("an answer is not as written")
    if "limits" in record["answers"]:
        likely = "probability" in record["answers"]
        probability = answers.usable["probability"] if likely else None
        production = answers.usable["yield"] if "yield" in record["answers"] else None
        limits = LimitCheck(answers.usable["limits"], probability, True, production)
        if MarginRecord.read(limits.margins).of != OF_STUDY:
            raise InputError("the requirements are not those of the study")
    saved = FileName.SURROGATE in files
    return StudyResult(
        folder=folder,
        label=record["label"],
        bands=read_netcdf(folder / FileName.BANDS),
        surrogate=load_surrogate(folder / FileName.SURROGATE) if saved else None,
        verification=verification,
        contributions=contributions,
        limits=limits,
        unchecked=tuple(map(RequirementVerdict.from_json, record["unchecked"])),
        doubts=tuple(map(Doubt.from_json, record["doubts"])),
        parts=answers.usable["parts"] if "parts" in record["answers"] else None,
        seconds_per_run=record["seconds_per_run"],
        files=tuple(files),
        stale=tuple(stale_results(folder, files)),
        computed=record["computed"],
        reused=True,
    )


def doubts_about(
    bands: xr.Dataset,
    verification: xr.Dataset | None,
    *,
    requested: bool,
    inaccurate_share: float = 0.25,
) -> tuple[Doubt, ...]:
    """Return why a result is not what was asked for; verification may be `requested`, and fail.

    If verification runs imply an error above `inaccurate_share` of the error bar's width, the
    result is doubtful, unless its tolerance is larger.
    """
    record = BandRecord.read(bands)
    doubts = []
    if record.tolerance_missed:
        error, target = (float(x or 0.0) for x in (record.expected_error, record.tolerance))
        doubts.append(Doubt(DoubtKind.TOLERANCE_NOT_MET, error, target))
    if record.not_trusted:
        doubts.append(Doubt(DoubtKind.NOT_TRUSTED))
    if verification is None:
        return (*doubts, *[Doubt(DoubtKind.NOT_VERIFIED)] * requested)
    if VerificationRecord.read(verification).confirmed == Confirmation.REFUTED:
        doubts.append(Doubt(DoubtKind.NOT_CONFIRMED))
    elif (error := inferred_share(verification)) > max(inaccurate_share, record.tolerance or 0.0):
        doubts.append(Doubt(DoubtKind.INACCURATE, error))
    return tuple(doubts)
