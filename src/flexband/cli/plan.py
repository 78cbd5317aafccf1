"""What a command is asked to do with a study, so that another command can go on with it."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields, replace
from pathlib import Path
from typing import Any

import flexband as fb
from flexband.analysis.verification import MAX_RUNS
from flexband.basics.checks import check_integer, check_option, check_positive
from flexband.cli.command_options import POLICIES
from flexband.cli.messages import UsageError, usage
from flexband.errors import InputError, StoreError
from flexband.execution.dask import Dask
from flexband.execution.processes import Processes
from flexband.study.folder import StudyFolder
from flexband.study.method_options import method_classes, with_options
from flexband.study.run import RunOptions
from flexband.study.study import Study, load_study
from flexband.uncertainty.runs import BATCH
from flexband.uncertainty.surrogates.sigmas import checked_sigmas

METHODS = method_classes([  # the public ones, without all that else is public
    fb.AdaptivePCCI, fb.ImprovedPCCI, fb.LHSScanning, fb.MonteCarlo, fb.PCCI,
    fb.methods.PerturbationChebyshev, fb.methods.PhaseResolvedPCCI, fb.methods.RegressionPCCI,
    fb.methods.SobolScanning,
])  # fmt: skip


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
        check_option("--failed", self.failed, POLICIES)
        check_integer("--batch", self.batch, 1)
        if self.verify is not None:
            check_integer("--verify", self.verify, 2, MAX_RUNS, or_zero=True)
        if self.method:
            check_option("--method", self.method, METHODS)
        self.where()

    @classmethod
    def from_content(cls, content: Mapping[str, Any], **changes: Any) -> Plan:
        """Return the plan of a study.json, with other values of options that are not None."""
        names = {plan_field.name for plan_field in fields(cls)}
        try:
            plan = cls(**{name: value for name, value in content.items() if name in names})
        except TypeError:
            raise StoreError("study.json is incomplete") from None
        return replace(plan, **{k: value for k, value in changes.items() if value is not None})

    def as_json(self) -> dict[str, Any]:
        return {**asdict(self), "values": dict(self.values)}

    @property
    def title(self) -> str:
        return Path(self.file).stem

    def study(self) -> Study:
        """Return the study of the file with these options; refuse those that are not allowed."""
        study = load_study(Path(self.file))
        method = METHODS[self.method]() if self.method else study.method
        with usage():
            study = study.with_method(with_options(method, self.values))
            if self.sigmas is not None:
                study = replace(study, sigmas=checked_sigmas(self.sigmas))
            if self.verify and not study.expands:
                label = study.method.label
                raise InputError(f"--verify requires a method with a surrogate; got {label}")
        return study

    def options(self, **others: Any) -> RunOptions:
        """Return how the study is run."""
        failed = self.failed.replace("-", " ")
        return RunOptions(self.batch, self.where(), failed, self.verify, **others)

    @property
    def has_remote_executor(self) -> bool:
        """Whether the executor is the address of a scheduler on another host."""
        match = re.fullmatch(r"(?:\w+://)?(.+):\d+/?", self.executor or "")
        local = ("localhost", "127.0.0.1", "[::1]", "processes")
        return match is not None and match[1] not in local

    def where(self) -> Processes | Dask | str | None:
        """Return the executor; raise `InputError` if there is none of this name."""
        name = self.executor
        limit = self.time_limit
        if limit is not None:
            check_positive("--time-limit [s]", limit)
        match = re.fullmatch(r"processes(?::(\d+))?", name or "", re.ASCII)
        if match:
            return Processes(int(match[1]) if match[1] else None, limit)
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


def plan_in(folder: Path, *, trust: bool = False, **changes: Any) -> Plan:
    """Return the plan of the study in a folder; raise `StoreError` if there is none.

    Without `trust`, a file to run or a scheduler that only the folder names raises `UsageError`.
    """
    about = StudyFolder(folder).read()
    if about and not about.get("file"):
        raise StoreError(f"a Python program runs the study of {folder}; that program goes on")
    if not about:
        runs = ". `flexband run` with the study's file and this folder uses the runs that are there"
        raise StoreError(
            f"folder must be that of a study that `flexband run` began; there is no study.json in "
            f"{str(folder)!r}{runs if StudyFolder(folder).has_runs_or_record else ''}"
        )
    with usage():
        plan = Plan.from_content(about, **changes)
    if trust:
        return plan
    if not is_near(Path(plan.file), folder):
        raise UsageError(
            f"the study of {folder} is {plan.file}, which is neither below the working "
            "directory nor beside the folder. If you know this file, give --trust to run it, or "
            "use `flexband run` with the file"
        )
    if changes.get("executor") is None and plan.has_remote_executor:
        raise UsageError(
            f"the executor of {folder} is {plan.executor}, on another host. If you know "
            "it, give --trust to connect to it, or --executor"
        )
    return plan


def is_near(file: Path, folder: Path) -> bool:
    """Return whether a file is below the working directory or beside a folder.

    A file in the folder may have come with it. It counts only where that is the working directory,
    or above.
    """
    file = file.resolve()
    folder = folder.resolve()
    current = Path.cwd()
    if file.is_relative_to(folder) and not current.is_relative_to(folder):
        return False
    return file.is_relative_to(current) or file.parent == folder.parent
