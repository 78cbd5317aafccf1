"""What a command is asked to do with a study, so that another command can go on with it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

from flexband.cli.messages import usage
from flexband.cli.methods import METHODS
from flexband.errors import InputError, StoreError, known, positive, whole
from flexband.execution.dask import Dask
from flexband.execution.processes import Processes
from flexband.study.options import with_options
from flexband.study.study import Study, load_study
from flexband.uncertainty.evaluations.evaluations import BATCH
from flexband.uncertainty.surrogates.sigmas import checked_sigmas
from flexband.uncertainty.surrogates.verification import MOST_RUNS, RUNS

POLICIES = {"stop": "stop", "half-step": "half step", "leave-out": "leave out"}
"""Values of --failed, and what `propagate` calls them."""


@dataclass(frozen=True)
class Plan:
    """A study in a file, and how it is carried out: the options of ``flexband run``."""

    file: str
    method: str | None = None
    values: Mapping[str, Any] = field(default_factory=dict)
    sigmas: float | None = None
    verify: int | None = None
    failed: str = "stop"
    batch: int = BATCH
    executor: str | None = None
    time_limit: float | None = None

    def __post_init__(self) -> None:
        known("--failed", self.failed, POLICIES)
        whole("--batch", self.batch, 1)
        if self.method:
            known("--method", self.method, METHODS)
        self.where()

    @classmethod
    def of(cls, told: Mapping[str, Any], **changes: Any) -> Plan:
        """Return the plan of a study.json, with other values of options that are not None."""
        names = {one.name for one in fields(cls)}
        try:
            plan = cls(**{name: value for name, value in told.items() if name in names})
        except TypeError:
            raise StoreError("study.json does not tell which study it is") from None
        return replace(plan, **{k: value for k, value in changes.items() if value is not None})

    def told(self) -> dict[str, Any]:
        """Return what study.json tells."""
        return {**asdict(self), "values": dict(self.values)}

    @property
    def title(self) -> str:
        """Name of the study."""
        return Path(self.file).stem

    def study(self) -> Study:
        """Return the study of the file with these options.

        Raises
        ------
        InputError
            If the file has no study.
        UsageError
            If an option is not of its method, or its value is not allowed.
        """
        study = load_study(Path(self.file))
        method = METHODS[self.method]() if self.method else study.method
        with usage():
            study = study.using(with_options(method, self.values))
            if self.sigmas is not None:
                study = replace(study, sigmas=checked_sigmas(self.sigmas))
            if self.verify:
                whole("--verify", self.verify, 2, MOST_RUNS, or_zero=True)
                if not study.expands:
                    label = study.method.label
                    raise InputError(f"--verify requires a method with a surrogate; got {label}")
        return study

    def new_runs(self, study: Study) -> int:
        """Return the number of runs that verify the result."""
        if not study.expands:
            return 0
        elsewhere = getattr(study.response, "elsewhere", False)
        return (0 if elsewhere else RUNS) if self.verify is None else self.verify

    @property
    def policy(self) -> str:
        """What to do about runs that fail, as `propagate` calls it."""
        return POLICIES[self.failed]

    @property
    def has_remote_executor(self) -> bool:
        """Whether the executor is the address of a scheduler on another host."""
        found = re.fullmatch(r"(?:\w+://)?(.+):\d+/?", self.executor or "")
        local = ("localhost", "127.0.0.1", "[::1]", "processes")
        return found is not None and found[1] not in local

    def where(self) -> Processes | Dask | str | None:
        """Return the executor; raise `InputError` if there is none of this name."""
        name, limit = self.executor, self.time_limit
        if limit is not None:
            positive("--time-limit [s]", limit)
        own = re.fullmatch(r"processes(?::(\d+))?", name or "", re.ASCII)
        if own:
            return Processes(int(own[1]) if own[1] else None, limit)
        if limit is not None and name is None:
            raise InputError(
                "--time-limit requires --executor processes, or the address of a Dask scheduler: "
                "only another process can be ended"
            )
        if name is not None and not re.fullmatch(r"(\w+://)?.+:\d+/?", name):
            raise InputError(
                "--executor must be processes, processes:4, or the address of a Dask scheduler "
                f"such as tcp://127.0.0.1:8786; got {name!r}"
            )
        return name if name is None or limit is None else Dask(name, limit)
