"""How far a study is, told in its folder while it runs."""

from __future__ import annotations

import math
import shlex
import signal
import time
from collections.abc import Callable
from typing import Any

from flexband.cli.messages import Ending, in_words, print_remark, print_text, signal_of
from flexband.errors import free_memory
from flexband.execution.growing import GrowingArrays
from flexband.progress import Budget, Progress
from flexband.study.folder import StudyFolder
from flexband.words import number_of

GIGABYTE = 1e9

PERIOD = 0.5
"""Time [s] between two writings of study.json."""


def in_bytes(size: float) -> str:
    """Return a size in bytes as text, in MB or GB."""
    return f"{1e-9 * size:.3g} GB" if size >= GIGABYTE else f"{1e-6 * size:.3g} MB"


class Course:
    """How far a study is, written to its folder while it runs.

    `claim` is called once the store has been opened: until then it may refuse the study.
    `memory` returns what `peak_memory` does, for a number of runs and the memory of one.
    """

    def __init__(
        self,
        folder: StudyFolder,
        about: dict[str, Any],
        claim: Callable[[], object],
        memory: Callable[[int, float], tuple[float, float]],
    ):
        self.folder, self.about, self.claim, self.memory = folder, about, claim, memory
        self.begin, self.written, self.told = time.monotonic(), float("-inf"), False
        self.bar: Progress = lambda done, total: None
        self.before, self.sized, self.first, self.opened = 0, False, False, False
        sessions = GrowingArrays(folder.runs).attrs.get("sessions", [])
        self.about |= {"session": len(sessions), "done": 0, "total": None}

    def begins(self, *, recorded: bool) -> None:
        """Write study.json before there is a store, so that whoever finds one can go on.

        One that is there is kept until the store has been opened, which may refuse the study.
        """
        self.first = recorded and not self.folder.begun
        if self.first:
            self.write("running")

    def ends(self, error: BaseException, *, recorded: bool) -> None:
        """Write why the study has ended; of one that has no store yet, nothing is left."""
        if recorded and self.opened:
            state, reason = "failed", in_words(error)
            if isinstance(error, KeyboardInterrupt):
                terminated = signal_of(error) == signal.SIGTERM
                state, reason = "stopped", "SIGTERM" if terminated else "Ctrl-C"
            self.write(state, reason=reason)
        if self.first and not (self.opened and self.folder.runs.exists()):
            self.folder.forget()

    def of(self, bar: Progress) -> Course:
        """Return itself for further runs, whose progress a bar shows."""
        self.bar, self.before = bar, self.about["done"]
        return self

    def __call__(self, done: int, total: int) -> None:
        """Take progress: the first call comes when the store has been opened."""
        self.bar(done, total)
        most, each = isinstance(total, Budget), total.each if isinstance(total, Budget) else 0
        done, total = self.before + done, self.before + total
        if not self.opened:
            self.claim()
        if not self.sized:
            self.tell_size(total)
        known = {"total": None if each else total, "each": each, "most": most}
        now = time.monotonic()
        new = not self.opened or any(self.about.get(k) != own for k, own in known.items())
        self.opened = True
        self.about |= {"done": done, **known, "ran": now - self.begin}
        if new or done == total or now > self.written + PERIOD:
            self.written = now
            self.write("running")
        goes_on = f"`flexband resume {shlex.quote(str(self.folder.path))}` goes on"
        Ending.stopped = f"flexband: stopped; {goes_on}"

    def hear(self, now: str, line: str = "") -> None:
        """Take what is done now."""
        self.about["now"] = now
        if self.first or self.opened:
            self.write("running")

    def tell_size(self, total: int) -> None:
        """Tell how much memory the study takes, once the store knows the size of one run's."""
        outputs = GrowingArrays(self.folder.runs).arrays.get("outputs")
        if outputs is None:
            return
        self.sized = True
        one = 8.0 * math.prod(outputs.shape[1:])
        peak, per_carrier = self.memory(total, one)
        ringing = f", {in_bytes(per_carrier)} more for each carrier if they ring"
        print_text(
            f"Outputs of {number_of(total, 'run')} take {in_bytes(total * one)}; the study needs "
            f"about {in_bytes(peak)} of memory{ringing * (per_carrier > 0)}.",
            error=True,
        )
        if peak > free_memory():
            print_remark(f"only {in_bytes(free_memory())} of memory are free")

    def write(self, state: str, **more: Any) -> None:
        """Write study.json; print a remark, once, if that fails: the study goes on."""
        self.about |= {"state": state, "elapsed": time.monotonic() - self.begin, **more}
        if state != "running":
            self.about.pop("now", None)
        try:
            self.folder.write(self.about)
        except OSError as error:
            if not self.told:
                print_remark(str(error))
            self.told = True
