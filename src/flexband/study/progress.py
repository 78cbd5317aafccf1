"""The progress of a study, written to study.json in its folder while it runs."""

from __future__ import annotations

import math
import signal
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from flexband.basics.checks import free_memory
from flexband.basics.error_text import error_text, signal_of
from flexband.basics.progress import Budget, Progress, ProgressListener, add_listener, listener
from flexband.basics.warning import warn
from flexband.basics.words import number_of
from flexband.errors import RunsNeeded
from flexband.execution.growing import GrowingArrays
from flexband.execution.lock import this_process
from flexband.study.exchange.points import RequestedPoints
from flexband.study.folder import StudyFolder
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.inputs.unfolding import cases
from flexband.uncertainty.methods.method import as_method
from flexband.uncertainty.phases.carriers import CarrierOptions
from flexband.uncertainty.runs.reuse import locate_domains

if TYPE_CHECKING:
    from flexband.execution.store import Store
    from flexband.study.definition import StudyDefinition


class StudyProgress(ProgressListener):
    """How far a study is.

    `about` is what study.json has: how to go on with the study, and how far it is. Between two
    writings of it there is a `period` [s].
    """

    period = 0.5

    def __init__(
        self,
        study: StudyDefinition,
        folder: StudyFolder,
        store: Store | None,
        about: Mapping[str, Any],
        begin_task: Callable[[str], Progress],
    ) -> None:
        sessions = GrowingArrays(folder.runs).sessions
        self.study = study
        self.folder = folder
        self.store = store
        self.begin_task = begin_task
        self.about: dict[str, Any] = {
            **about,
            "process": this_process(),
            "started": time.strftime("%Y-%m-%d %H:%M:%S%z"),
            "session": len(sessions),
            "done": 0,
            "total": None,
        }
        self.begin = time.monotonic()
        self.written = float("-inf")
        self.warned = False
        self.failures: list[str] = []  # what failed beside the runs, and is made again next time
        self.bar: Progress = lambda done, total: None
        self.earlier_runs = 0  # those of the tasks before
        self.is_new = False  # whether study.json was written before the store accepted the study
        self.is_store_open = False  # whether the store has accepted the study
        self.has_memory_size = False  # whether the memory that is needed has been announced

    @contextmanager
    def record_study(self, claim: Callable[[], bool]) -> Iterator[None]:
        """Write study.json while the study runs, and why it ended if it fails.

        The folder is claimed once the store has been opened, which until then may refuse the study.
        """
        self.claim = claim
        if self.store is None:
            claim()
        # Whoever finds a new store can go on, but a study.json that is there stays until the store
        # accepts this study.
        self.is_new = self.store is not None and not self.folder.has_record
        if self.is_new:
            self.write("running")
        try:
            with add_listener(self):
                if self.store is not None and (recorded := GrowingArrays(self.folder.runs).runs):
                    there = f"{self.folder.path} has {number_of(recorded, 'recorded run')}"
                    listener().warn(f"{there}; matching runs are reused.")
                yield
        except BaseException as error:
            self._end(error)
            raise

    def _end(self, error: BaseException) -> None:
        """Write why the study has ended; leave nothing of one that has no store yet."""
        if self.store is not None and isinstance(error, RunsNeeded):
            file = RequestedPoints.from_folder(self.folder.path).ask(error, self.study.inputs)
            points = {"count": len(error.points), "file": str(file)}
            self.write("waiting", points=points)
        elif self.store is not None and self.is_store_open:
            state = "failed"
            reason = error_text(error)
            if isinstance(error, KeyboardInterrupt):
                terminated = signal_of(error) == signal.SIGTERM
                state = "stopped"
                reason = "SIGTERM" if terminated else "Ctrl-C"
            self.write(state, reason=reason)
        if self.is_new and not (self.is_store_open and self.folder.runs.exists()):
            self.folder.forget()

    def fail(self, step: str, text: str) -> None:
        """Warn that a step of the study failed, whose result the next run computes."""
        self.failures.append(step)
        warn(text)

    @property
    def wall_time(self) -> float:
        """Wall time [s] since the study began."""
        return time.monotonic() - self.begin

    @property
    def provenance(self) -> dict[str, str]:
        """By which command and file the study is run, and since when, as texts by name."""
        texts = {"command": self.about.get("command"), "file": self.about.get("file")}
        return {k: v for k, v in texts.items() if v} | {"date": self.about["started"][:16]}

    def task(self, name: str) -> Progress:
        """Begin further runs; return what takes their progress."""
        bar = self.begin_task(name)
        if self.store is None:
            return bar
        self.bar = bar
        self.earlier_runs = self.about["done"]
        return self._advance

    def _advance(self, done: int, total: int) -> None:
        """Take progress: the first call comes when the store has been opened."""
        self.bar(done, total)
        budget = Budget.from_total(total)
        per_discretization = budget.per_level
        is_upper_bound = not budget.exact
        done = self.earlier_runs + done
        total = self.earlier_runs + total
        if not self.is_store_open:
            self.claim()
        if not self.has_memory_size:
            self._announce_memory(total)
        counts = {
            "total": None if per_discretization else total,
            "each": per_discretization,
            "most": is_upper_bound,
        }
        now = time.monotonic()
        new = not self.is_store_open or any(
            self.about.get(k) != value for k, value in counts.items()
        )
        self.is_store_open = True
        self.about |= {"done": done, **counts, "ran": now - self.begin}
        if new or done == total or now > self.written + self.period:
            self.written = now
            self.write("running")

    def stage(self, name: str) -> None:
        """Write what is done from now on."""
        self.about["now"] = name
        if self.is_new or self.is_store_open:
            self.write("running")

    def _announce_memory(self, total: int) -> None:
        """Say how much memory the study takes, once the store knows the size of a run's outputs."""
        outputs = GrowingArrays(self.folder.runs).arrays.get("outputs")
        if outputs is None:
            return
        self.has_memory_size = True
        size = 8.0 * math.prod(outputs.shape[1:])
        peak, per_carrier = memory_of(self.study, self.store, total, size)
        carriers = CarrierOptions().max_carriers
        peak_text = in_bytes(peak + carriers * per_carrier)
        carrier_text = f"{in_bytes(per_carrier)} more for each of up to {carriers} frequencies"
        ringing = f", and if they vibrate {carrier_text}, {peak_text} in all"
        listener().warn(
            f"Outputs of {number_of(total, 'run')} take {in_bytes(total * size)}; the study needs "
            f"about {in_bytes(peak)} of memory{ringing * (per_carrier > 0)}.",
        )
        if peak > free_memory():
            warn(f"only {in_bytes(free_memory())} of memory are free")

    def write(self, state: str, **entries: Any) -> None:
        """Write study.json; warn once if that fails: the study goes on."""
        self.about |= {"state": state, "elapsed": self.wall_time, **entries}
        if state != "running":
            self.about.pop("now", None)
        try:
            self.folder.write(self.about)
        except OSError as error:
            if not self.warned:
                warn(str(error))
            self.warned = True


def memory_of(
    study: StudyDefinition, store: Store | None, runs: int, size: float
) -> tuple[float, float]:
    """Return what `Method.peak_memory` does, for runs of a size [bytes].

    The combinations of options are studied one by one.
    """
    inputs = cases(locate_domains(study.response, study.inputs, store)[0])
    intervals = Space(next(iter(inputs.values()))).interval_dimension
    return as_method(study.method).peak_memory(intervals, -(-runs // len(inputs)), size)


def in_bytes(size: float) -> str:
    """Return a size in bytes as text, in MB or GB."""
    return f"{1e-9 * size:.3g} GB" if size >= 1e9 else f"{1e-6 * size:.3g} MB"
