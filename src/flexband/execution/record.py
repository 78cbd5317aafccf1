"""An open store: what is in it, and what writes the runs that are added."""

from __future__ import annotations

import platform
import threading
import time
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import xarray as xr

from flexband.basics.warning import warn
from flexband.basics.words import are, number_of
from flexband.errors import StoreError
from flexband.execution.growing import COPY, GrowingArrays
from flexband.execution.journal import Finished, Journal
from flexband.execution.layout import (
    add_columns,
    add_outputs,
    add_remarks,
    check_recordable,
    columns,
    stored_labels,
)
from flexband.execution.lock import Lock, this_process
from flexband.execution.names import RunStatus
from flexband.execution.store import Owner, Store, versions


class RunRecorder:
    """The runs of a store, and a thread that writes what is added.

    Runs are in the journal as soon as `add` returns, so that they survive the end of the process; a
    thread writes them to the arrays every `period` [s], or when `most_waiting` bytes wait, and
    syncs these. Runs that took longer than `long_run_time` [s] are synced at once, unless others
    were just now.
    """

    period = 0.5
    most_waiting = 64e6
    long_run_time = 0.1

    def __init__(self, store: Store, owner: Owner, about: Mapping[str, str] | None = None):
        """Open or make the store; `about` says which inputs the runs to come are for."""
        self.store = store
        self.owner = owner
        self.about = dict(about or {})
        folder = Path(store.folder)
        try:
            folder.mkdir(parents=True, exist_ok=True)
            self._lock = Lock(folder)
            try:
                self._open()
            except BaseException:
                self._lock.release()
                raise
        except OSError as error:
            raise StoreError(f"{folder} must be a folder to write to; got {error}") from None

    def _open(self) -> None:
        self.arrays = GrowingArrays(self.store.runs)
        self.owner.check(self.arrays.attrs.get("owner"), self.store)
        self.labels, self.journal = stored_labels(self.arrays), Journal(self.store.runs)
        self._mend()
        self.confirmed = False
        self.rows: dict[bytes, int] = {}
        self.status = np.zeros(0, np.int8)
        if "status" not in self.arrays.arrays:
            self.arrays.commit([COPY])
            add_columns(self.arrays, self.owner.inputs.split(", "))
        elif "remarks" not in self.arrays.arrays:
            add_remarks(self.arrays)
        if self.arrays.runs:
            self.status = self.arrays.read("status")
            self._index(self.arrays.read("setting"), self.arrays.read("inputs"), 0)
        self.arrays.attrs["owner"] = self.owner._asdict()
        sessions = self.arrays.sessions
        records = self.journal.read(self.arrays.runs)
        records = [record for record in records if record.values is None or self.labels is not None]
        if records:  # of a session that was killed
            self.arrays.append(columns(records, len(sessions) - 1, self._shape))
            for record in records:
                self._count(record)
        about = {"versions": versions(), "python": platform.python_version()}
        sessions.append({**about, **self.about, "by": this_process(), "started": time.time()})
        self.arrays.commit()
        _remove(self.journal.rotate())
        self._waiting: list[Finished] = []
        self._bytes = 0.0  # of their values
        self._safe = 0  # number of those that are in the journal
        self._writing = False
        self._synced = float("-inf")
        self._changed = threading.Condition()
        self._error: BaseException | None = None
        self._warning_issued = self._closing = self._hurry = False
        self._writer = threading.Thread(target=self._write_all, daemon=True)
        self._writer.start()

    def _mend(self) -> None:
        """Give up the runs in damaged chunks; the status of a run tells before they are cleared."""
        bad, chunks = self.arrays.find_damage()
        for name, chunk in chunks:
            if name == "status":
                self.arrays.clear(name, chunk)
        lost_runs = np.flatnonzero(bad)
        if len(lost_runs):
            self.arrays.replace("status", lost_runs, RunStatus.LOST)
            for name, chunk in chunks:
                self.arrays.clear(name, chunk) if name != "status" else None
            text = f"{are(len(lost_runs), 'run')} damaged in {self.store.runs}"
            warn(f"{text}; those needed are made again")

    @property
    def _shape(self) -> tuple[int, ...] | None:
        return None if self.labels is None else self.labels.shape[1:]

    def _index(self, settings: Sequence[str] | np.ndarray, inputs: np.ndarray, first: int) -> None:
        for k, (setting, row) in enumerate(zip(settings, inputs, strict=True), start=first):
            if self.status[k] in (RunStatus.DONE, RunStatus.FAILED):
                self.rows[_key(setting, row)] = k

    def _count(self, record: Finished) -> None:
        first = len(self.status)
        count = len(record.inputs)
        status = RunStatus.FAILED if record.values is None else RunStatus.DONE
        self.status = np.concatenate([self.status, np.full(count, status, np.int8)])
        self._index([record.setting] * count, record.inputs, first)

    def find(self, setting: str, inputs: np.ndarray) -> np.ndarray:
        """Return the numbers of the recorded runs with these inputs, −1 for those there are not."""
        return np.array([self.rows.get(_key(setting, row), -1) for row in inputs], dtype=int)

    def read(self, runs: np.ndarray) -> tuple[np.ndarray, dict[int, str]]:
        """Return the values of recorded runs, NaN for failed ones, and the reasons of these."""
        assert self.labels is not None
        self.flush()
        values = np.full((len(runs), *self.labels.shape[1:]), np.nan)
        reasons = np.full(len(runs), "", object)
        failed_mask = self.status[runs] == RunStatus.FAILED
        with self._changed:
            self._changed.wait_for(lambda: not self._writing)
            first = self.arrays.runs
            written = runs < first
            if "outputs" in self.arrays.arrays:
                values[written] = self.arrays.read("outputs", runs[written])
            reasons[written & failed_mask] = self.arrays.read("reason", runs[written & failed_mask])
            for record in self._waiting:  # which could not be written
                mask = (runs >= first) & (runs < first + len(record.inputs))
                reasons[mask] = record.reason
                if record.values is not None:
                    values[mask] = record.values[runs[mask] - first]
                first += len(record.inputs)
        return values, {int(k): str(reasons[k]) for k in np.flatnonzero(failed_mask)}

    def remarks(self, runs: np.ndarray) -> list[str]:
        """Return the remarks on recorded runs, see `layout`; "" for runs without one."""
        texts = np.full(len(runs), "", object)
        with self._changed:
            self._changed.wait_for(lambda: not self._writing)
            written = runs < self.arrays.runs
            texts[written] = self.arrays.read("remarks", runs[written])
        return texts.tolist()

    def of_other_intervals(self, setting: str, intervals: str, random: str) -> np.ndarray:
        """Return the numbers of runs made for other intervals, but the same random inputs."""
        sessions = self.arrays.sessions
        other = [
            session.get("random") == random and session.get("intervals") not in (None, intervals)
            for session in sessions
        ]
        if not self.arrays.runs or not any(other):
            return np.zeros(0, int)
        serves = np.array(other)[self.arrays.read("session")]
        serves &= self.arrays.read("setting") == setting
        return np.flatnonzero(serves & (self.status[: len(serves)] == RunStatus.DONE))

    def inputs(self, runs: np.ndarray) -> np.ndarray:
        """Return the numbers of runs that are in the arrays, shape (runs, inputs)."""
        return self.arrays.read("inputs", runs)

    def begin(self, labels: xr.DataArray) -> None:
        """Tell the dims and coordinates of the response, which its first run shows."""
        if self.labels is not None:
            return
        check_recordable(labels)
        self.flush()
        with self._changed:
            self._changed.wait_for(lambda: not self._writing)
            self.labels = labels
            try:
                self._begin_outputs()
            except OSError as error:
                self._error = error

    def _begin_outputs(self) -> None:
        """Add the outputs to the arrays, unless they are there."""
        if self.labels is not None and "outputs" not in self.arrays.arrays:
            add_outputs(self.arrays, self.labels)
            self.arrays.commit()

    def add(self, record: Finished) -> None:
        """Record runs; warn if that is not possible at present."""
        with self._changed:
            self._waiting.append(record)
            self._bytes += _size(record)
            self._count(record)
            try:
                self._append_to_journal()
            except OSError as error:
                self._error = error
            if self._bytes > self.most_waiting / 2:
                self._hurry = True
                self._changed.notify_all()
            self._changed.wait_for(lambda: self._error or self._bytes <= self.most_waiting)
        if self._error and not self._warning_issued:
            self._warning_issued = True
            warn(f"runs cannot be recorded in {self.store.folder} at present: {self._error}")

    def _append_to_journal(self) -> None:
        """Append the runs that are not in it yet."""
        first = len(self.status) - sum(len(record.inputs) for record in self._waiting[self._safe :])
        while self._safe < len(self._waiting):
            record = self._waiting[self._safe]
            took = min(record.seconds * len(record.inputs), time.monotonic() - self._synced)
            self.journal.append(first, record, sync=took > self.long_run_time)
            if took > self.long_run_time:
                self._synced = time.monotonic()
            self._safe += 1
            first += len(record.inputs)

    def _write_all(self) -> None:
        """Write to the arrays from time to time; `add` and `close` tell what ends this."""
        try:
            while self._write():
                pass
        except BaseException as error:  # this thread has no caller
            with self._changed:
                self._error = error
                self._writing = False
                self._changed.notify_all()

    def _write(self) -> bool:
        """Write the runs that wait; return whether to go on."""
        error = None
        older = []
        with self._changed:
            self._changed.wait_for(lambda: self._closing or self._hurry, timeout=self.period)
            self._hurry = False
            batch = list(self._waiting)
            closing = self._closing
            try:
                older = self.journal.rotate() if batch else []
            except OSError as exception:
                error = exception
            self._writing = bool(batch)
        if batch and error is None:
            try:
                self._begin_outputs()
                session = len(self.arrays.sessions) - 1
                self.arrays.append(columns(batch, session, self._shape))
                _remove(older)
            except Exception as exception:  # it is told by `add` and `close`
                error = exception
        with self._changed:
            self._writing = False
            if batch:
                self._error = error
            if batch and error is None:
                del self._waiting[: len(batch)]
                self._bytes -= sum(map(_size, batch))
                self._safe = max(0, self._safe - len(batch))
            self._changed.notify_all()
        return not closing

    def flush(self) -> None:
        """Wait until all runs are in the arrays, as far as that is possible."""
        with self._changed:
            self._hurry = bool(self._waiting)
            self._changed.notify_all()
            self._changed.wait_for(lambda: self._error or not self._waiting)

    def forget_failed(self) -> int:
        """Let failed runs be made again; return their number."""
        self.flush()
        failed_runs = np.flatnonzero(self.status == RunStatus.FAILED)
        if len(failed_runs):
            self.arrays.replace("status", failed_runs, RunStatus.AGAIN)
            self.status[failed_runs] = RunStatus.AGAIN
            forgotten_runs = set(failed_runs.tolist())
            self.rows = {key: k for key, k in self.rows.items() if k not in forgotten_runs}
        return len(failed_runs)

    def close(self) -> None:
        """Write what is left; warn if that fails."""
        try:
            with self._changed:
                self._closing = True
                self._changed.notify_all()
            self._writer.join()
            self.journal.rotate()
            if not self._error:
                self.arrays.finish()
        except OSError as error:
            self._error = error
        finally:
            self._lock.release()
        if self._error:
            lost_count = sum(len(record.inputs) for record in self._waiting)
            warn(
                f"{number_of(lost_count, 'run')} could not be recorded in {self.store.folder}: "
                f"{self._error}"
            )


def _key(setting: str, row: np.ndarray) -> bytes:
    return setting.encode() + b"\0" + (row + 0.0).tobytes()


def _size(record: Finished) -> float:
    return 0.0 if record.values is None else 8.0 * np.size(record.values)


def _remove(files: Sequence[Path]) -> None:
    for file in files:
        file.unlink(missing_ok=True)
