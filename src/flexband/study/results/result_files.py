"""Files of a study's result, written one by one as soon as each part is there."""

from __future__ import annotations

from collections.abc import Callable, Collection
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import xarray as xr

from flexband.basics.files import try_write
from flexband.errors import InputError
from flexband.execution.names import FileName
from flexband.study.folder import StudyFolder
from flexband.study.results.answers import mark_stale, stale_files
from flexband.study.results.netcdf import write_netcdf
from flexband.uncertainty.surrogates.surrogate_file import (
    load_surrogate,
    same_expansions,
    save_surrogate,
)

if TYPE_CHECKING:
    from flexband.analysis.selection import AnySurrogate


def stale_results(folder: Path, names: Collection[str]) -> list[str]:
    """Return the names of files of earlier results in a folder, where `names` were written."""
    others = (
        name
        for name in (FileName.SURROGATE, FileName.VERIFICATION, FileName.CONTRIBUTIONS)
        if name not in names
    )
    stale = [name for name in others if (folder / name).exists()]
    return stale + [file.name for file in stale_files(folder)]


class ResultFiles:
    """The files of a result in a folder; what cannot be written is warned of, and left out.

    `names` are those of the files that were written; `changed` tells whether the surrogate is
    another one than before.
    """

    def __init__(self, folder: StudyFolder) -> None:
        self.folder = folder
        self.names = list[str]()
        self.changed = False

    def write_surrogate(self, surrogate: AnySurrogate | None) -> None:
        """Write a surrogate, if the method makes one; mark answers of another one as stale."""
        file = self.folder.path / FileName.SURROGATE
        is_regular = file.is_file() and not file.is_symlink()
        earlier = self.folder.checksums([file]) if is_regular else {}
        if surrogate is not None:
            self._write(FileName.SURROGATE, lambda: save_surrogate(surrogate, file))
        self.changed = (
            FileName.SURROGATE not in self.names or self.folder.checksums([file]) != earlier
        )
        if self.changed:
            mark_stale(self.folder.path)  # before anything may end this process
            if surrogate is not None and FileName.SURROGATE in self.names:
                self._delete_report()

    def write_unjudged(self, surrogate: AnySurrogate) -> None:
        """Write a surrogate that runs are about to judge, unless it is there as they judged it."""
        with suppress(InputError):
            if same_expansions(load_surrogate(self.folder.path / FileName.SURROGATE), surrogate):
                return
        self.write_surrogate(surrogate)

    def write_bands(self, bands: xr.Dataset) -> None:
        """Write the bands; delete the report of other ones."""
        if self._write_dataset(FileName.BANDS, bands):
            self._delete_report()

    def write_verification(self, verification: xr.Dataset) -> None:
        """Write a result of `verify`."""
        self._write_dataset(FileName.VERIFICATION, verification)

    def write_contributions(self, shares: xr.Dataset) -> None:
        """Write a result of `contributions`."""
        self._write_dataset(FileName.CONTRIBUTIONS, shares)

    def stale(self) -> list[str]:
        """Return the names of files in the folder that belong to earlier results."""
        pictures = [FileName.CONTRIBUTIONS_PICTURE] * self.changed
        return stale_results(self.folder.path, self.names) + [
            name for name in pictures if (self.folder.path / name).exists()
        ]

    def _write_dataset(self, name: str, dataset: xr.Dataset) -> bool:
        return self._write(name, lambda: write_netcdf(dataset, self.folder.path / name))

    def _write(self, name: str, write: Callable[[], object]) -> bool:
        if written := try_write(write):
            self.names.append(name)
        return written

    def _delete_report(self) -> None:
        for name in (FileName.PAGE, FileName.REPORT):
            (self.folder.path / name).unlink(missing_ok=True)
