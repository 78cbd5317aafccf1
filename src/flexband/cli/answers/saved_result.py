"""What questions are asked of: the surrogate of a folder or file, and its study."""

from __future__ import annotations

import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import flexband as fb
from flexband.basics.error_text import error_text
from flexband.basics.warning import without_warnings
from flexband.cli.messages import (
    UsageError,
    print_remark,
)
from flexband.errors import InputError
from flexband.execution.lock import is_locked
from flexband.execution.names import FileName

if TYPE_CHECKING:
    import xarray as xr

    from flexband.analysis.selection import AnySurrogate
    from flexband.basics.response import ResponseFunction
    from flexband.study.presentation.display import Display
    from flexband.study.results.reliability import Doubt
    from flexband.study.study import Study


class SavedResult(NamedTuple):
    """What a question is asked of."""

    surrogate: AnySurrogate  # of the study
    folder: Path  # where it is, and where answers are written
    display: Display  # in which units numbers are shown
    doubts: Sequence[Doubt] = ()  # about the result of the study

    def dataset(self, name: FileName) -> xr.Dataset | None:
        """Return a result of the study, None if it has none; raise `InputError` if altered."""
        from flexband.study.results.netcdf import read_netcdf  # noqa: PLC0415

        file = self.folder / name
        return read_netcdf(file) if file.is_file() else None

    def study(self, *, trust: bool) -> Study:
        """Return the study; raise `UsageError` if its file is run only with `trust`."""
        from flexband.cli.plan import plan_in  # noqa: PLC0415

        with without_warnings():  # the run has printed them
            return plan_in(self.folder, trust=trust).study()

    def limits(self, *, trust: bool) -> list[fb.Requirement]:
        """Return the requirements of the study; remark, or raise `UsageError` without `trust`."""
        from flexband.study.nominal import around_nominal  # noqa: PLC0415

        if not (self.folder / FileName.STUDY).is_file():
            return []
        try:
            limits = self.study(trust=trust).requirements
            return around_nominal(limits, self.folder, self.surrogate, self.display)
        except UsageError:
            raise
        except Exception as error:  # the study is a program
            print_remark(f"requirements of the study are not shown: {error_text(error)}")
            return []

    def response_and_store(
        self, purpose: str, *, trust: bool
    ) -> tuple[ResponseFunction, Path | None]:
        """Return the response of the study and its folder of runs; refuse what is not there."""
        if not (self.folder / FileName.STUDY).is_file():
            raise InputError(f"there is no study in '{self.folder}' whose response {purpose}")
        store = self.folder if (self.folder / FileName.RUNS).is_dir() else None
        return self.study(trust=trust).response, store


def saved_result(folder: Path) -> SavedResult:
    """Return the surrogate of a folder or file; remark if its result was not reliable."""
    from flexband.report.page.page_record import read_given  # noqa: PLC0415
    from flexband.report.text.doubts import doubt_text  # noqa: PLC0415
    from flexband.study.presentation.display import Display  # noqa: PLC0415
    from flexband.study.results.reliability import DoubtKind  # noqa: PLC0415

    # Find the surrogate, or tell why there is none.
    file = folder / FileName.SURROGATE if folder.is_dir() else folder
    if not file.is_file():
        if not folder.exists():
            raise InputError(f"there is no '{folder}'; the argument is the --output of a study")
        if (folder / FileName.BANDS).is_file():
            raise InputError(
                f"'{folder}' has no surrogate.npz to answer from: its method does not expand the "
                "response. Run the study with one that does, such as AdaptivePCCI"
            )
        running = (
            ": its study is running"
            if folder.is_dir() and is_locked(folder / FileName.STUDY_LOCK)
            else ""
        )
        raise InputError(
            "the argument must be a folder with the surrogate.npz of a finished study; "
            f"got '{folder}', which has none{running}"
        )
    # Remark on what the answer may be worth: a newer run, and doubts about the result.
    if is_locked(file.parent / FileName.STUDY_LOCK):
        written = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(file.stat().st_mtime))
        print_remark(
            f"the study in '{file.parent}' is running; this answer is from its surrogate.npz of "
            f"{written}, which may be that of an earlier run"
        )
    page_record = read_given(file.parent)
    display = Display(page_record.get("display_units", {}), page_record.get("units", {}))
    surrogate = fb.load_surrogate(file)
    for doubt in page_record.get("doubts", []):
        if doubt.unreliable:
            print_remark(f"what follows is NOT reliable: {doubt_text(doubt)}")
        elif doubt.kind is DoubtKind.TOLERANCE_NOT_MET:
            rare = "what depends on rare values, as probabilities do, is NOT reliable"
            print_remark(f"{doubt_text(doubt)}: {rare}")
    return SavedResult(surrogate, file.parent, display, page_record.get("doubts", ()))
