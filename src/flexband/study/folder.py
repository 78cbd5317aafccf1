"""The folder of a study: which study it is, how far it is, and its results.

``study.json`` tells what is needed to go on, to watch from another terminal, and to find that
nothing is left to do. Whoever writes it holds the lock of the folder.
"""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import google_crc32c

from flexband.basics.computation import NUMBERING
from flexband.basics.files import read_unlinked, replace_file, try_write
from flexband.basics.progress import listener
from flexband.basics.response import ResponseFunction
from flexband.basics.words import value_text
from flexband.errors import StoreError
from flexband.execution.journal import Journal
from flexband.execution.lock import Lock, is_locked
from flexband.execution.names import FileName, RunStatus

FORMAT = 2
"""Of study.json; a program refuses larger numbers. Results of format 1 are computed again."""

KINDS = {
    "file": str, "method": str, "values": dict, "sigmas": int | float, "verify": int,
    "failed": str, "batch": int, "executor": str, "time_limit": int | float, "command": str,
    "identity": str, "process": str, "started": str, "session": int, "done": int,
    "total": int, "each": int, "most": bool, "ran": int | float, "elapsed": int | float,
    "state": str, "reason": str, "now": str, "result": dict, "points": dict, "numbering": list,
}  # fmt: skip
"""Of what study.json may have; each may be missing, or null."""


@dataclass(frozen=True)
class StudyFolder:
    """A folder with the runs and the results of a study."""

    path: Path

    @property
    def runs(self) -> Path:
        """Folder of the recorded runs."""
        return self.path / FileName.RUNS

    @property
    def has_runs_or_record(self) -> bool:
        """Whether the folder has recorded runs, or study.json."""
        return self.runs.exists() or self.has_record

    def has_only_failures_of_others(self, response: str) -> bool:
        """Return whether no run succeeded here, and the response had another fingerprint.

        This is so after the first attempt, if the response fails at once and is mended.
        """
        from flexband.execution.store import open_runs  # noqa: PLC0415

        asked = any((self.path / name).exists() for name in (FileName.LEDGER, FileName.POINTS))
        if asked or is_locked(self.path / FileName.STORE_LOCK):
            return False
        with suppress(StoreError, OSError, ValueError, KeyError):
            runs = open_runs(self.path)
            other = json.loads(runs.attrs["owner"])["response"] != response
            failed = RunStatus.DONE not in runs["status"].values
            return (
                other
                and failed
                and all(record.values is None for record in Journal(self.runs).read(0))
            )
        return False

    def read(self) -> dict[str, Any]:
        """Return what study.json tells; nothing if there is none.

        Raise `StoreError` if it is damaged, or of a newer version of flexband.
        """
        file = self.path / FileName.STUDY
        try:
            content = json.loads(read_unlinked(file))
            newest = int(content["format"])
            for name, kind in KINDS.items():
                if not isinstance(content.get(name), kind | None):
                    raise ValueError(f"{name!r} is {value_text(content[name])}")
        except FileNotFoundError:
            return {}
        except (OSError, ValueError, KeyError, TypeError, RecursionError) as error:
            raise StoreError(
                f"{file} cannot be read: {error}. `flexband run` with the study's file and this "
                "folder writes it again, and makes none of its runs again"
            ) from None
        if newest > FORMAT:
            raise StoreError(
                f"{file} was written by a newer version of flexband (format {newest}, this one "
                f"reads {FORMAT})"
            )
        return content

    @property
    def has_record(self) -> bool:
        """Whether the folder has study.json."""
        return (self.path / FileName.STUDY).exists()

    def forget(self) -> None:
        (self.path / FileName.STUDY).unlink(missing_ok=True)

    def write(self, content: dict[str, Any]) -> None:
        """Write study.json, which is there as a whole at any moment."""
        with replace_file(self.path / FileName.STUDY) as partial:
            text = json.dumps({"format": FORMAT, **content, "numbering": NUMBERING}, indent=1)
            partial.write_text(text, encoding="utf-8")

    @contextmanager
    def hold_lock(self, *, keep_lock: bool = True) -> Iterator[None]:
        """Hold the lock of the folder, which is made if it is missing.

        Raise `StoreError` if another process holds it; `keep_lock` is whether its file stays.
        """
        try:
            self.path.mkdir(parents=True, exist_ok=True)
            lock = Lock(self.path, FileName.STUDY_LOCK)
        except OSError as error:
            raise StoreError(f"{self.path} must be a folder to write to; got {error}") from None
        try:
            yield
        finally:
            if not keep_lock and not self.has_record:
                (self.path / FileName.STUDY_LOCK).unlink(missing_ok=True)
                (self.path / FileName.HOLDER).unlink(missing_ok=True)
            lock.release()

    def in_use(self) -> bool:
        """Return whether a process holds the folder."""
        return any(
            is_locked(self.path / name) for name in (FileName.STUDY_LOCK, FileName.STORE_LOCK)
        )

    def prepare_claim(
        self, file: str, response: ResponseFunction, *, replace: bool, allow_mismatch: bool
    ) -> Callable[[], bool]:
        """Return a function that claims the folder for a study, once its store is open.

        The file is that of the study, or empty if a program runs it. With `replace`, runs that are
        there are deleted; with `allow_mismatch`, those of another study are used. Raise
        `StoreError` if there are results of another study.
        """
        from flexband.execution.fingerprint import fingerprint  # noqa: PLC0415

        if replace and self.has_runs_or_record:
            listener().warn(f"The runs in {self.runs} are deleted.")
            self.delete_runs()
        claimant = file, fingerprint(response)
        if not allow_mismatch and self.has_only_failures_of_others(claimant[1]):
            self.delete_runs()
        self.check_claim(*claimant, replace=replace, allow_mismatch=allow_mismatch)
        return partial(try_write, partial(self.claim, *claimant))

    def check_claim(
        self, file: str, response: str, *, replace: bool, allow_mismatch: bool = False
    ) -> None:
        """Refuse to have the folder for the results of a study in a file; nothing is written.

        It is the same study if the file or the fingerprint of the response is the same. With
        `replace`, results of another study may be replaced, but not those of its runs; with
        `allow_mismatch`, its runs are used. Otherwise raise `StoreError` if there are any.
        """
        before = self._read_claim()
        claim = {"file": file, "response": response}
        same = not before or any(
            value and before.get(name) == value for name, value in claim.items()
        )
        if not same and not (allow_mismatch if self.has_runs_or_record else replace):
            other = (
                "`flexband run --replace` deletes its runs"
                if self.has_runs_or_record
                else "--replace"
            )
            raise StoreError(
                f"{self.path} has results of another study, {before.get('file')}. Take another "
                f"folder (--output), or replace them: {other}"
            )

    def claim(self, file: str, response: str) -> None:
        """Have the folder for the results of the study in a file, which `check_claim` allows."""
        claim = {"file": file, "response": response}
        if self._read_claim() != claim:
            with replace_file(self.path / FileName.OWNER) as partial:
                partial.write_text(json.dumps(claim), encoding="utf-8")

    def _read_claim(self) -> dict[str, str | None]:
        """Return whose results the folder has; nothing if it has none."""
        with suppress(OSError, ValueError, TypeError):
            return dict(json.loads(read_unlinked(self.path / FileName.OWNER)))
        with suppress(StoreError):
            if content := self.read():
                return {"file": content.get("file")}
        return (
            {"file": "a study that is not known"} if (self.path / FileName.REPORT).exists() else {}
        )

    def delete_runs(self) -> None:
        """Delete the recorded runs, what was asked for elsewhere, and what tells whose they are."""
        for name in ("STUDY", "OWNER", "DOMAINS", "LEDGER", "POINTS"):
            (self.path / FileName[name]).unlink(missing_ok=True)
        for folder in (self.runs, self.path / FileName.SAMPLES):
            if folder.is_symlink():
                folder.unlink()
            elif folder.exists():
                shutil.rmtree(folder)

    def checksums(self, files: Sequence[Path]) -> dict[str, int]:
        """Return the checksums of files in this folder."""
        return {file.name: google_crc32c.value(read_unlinked(file)) for file in files}

    def has(self, signed: Mapping[str, int]) -> bool:
        """Return whether all files are as they were when they were signed."""
        try:
            return self.checksums([self.path / name for name in signed]) == signed
        except OSError:
            return False

    def is_result(self, result: Mapping[str, Any]) -> bool:
        """Return whether a result in study.json, and the files that it names, are as written."""
        is_intact = result.get("checksum") == checksum_of(result)
        return is_intact and self.has(result["checksums"])


def checksum_of(result: Mapping[str, Any]) -> int:
    """Return the checksum of a result in study.json, which has it as "checksum"."""
    content = {name: value for name, value in result.items() if name != "checksum"}
    return google_crc32c.value(json.dumps(content, sort_keys=True).encode())
