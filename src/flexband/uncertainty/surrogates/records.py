"""What the attributes of bands and of their verification say, with types: one place for the names.

Users read attributes of datasets. The house reads these records, made of the attributes.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Self

import xarray as xr


@dataclass(frozen=True)
class Record:
    """Fields that are attributes of a dataset; those that it does not have keep their default."""

    @classmethod
    def read(cls, source: xr.Dataset | Mapping[Any, Any]) -> Self:
        """Return the record of a dataset, or of its attributes."""
        attributes = source.attrs if isinstance(source, xr.Dataset) else source
        known = (f.name for f in fields(cls) if f.name in attributes)
        return cls(**{name: attributes[name] for name in known})


@dataclass(frozen=True)
class BandRecord(Record):
    """What bands, and the diagnostics of a surrogate, say beside their numbers.

    Attributes
    ----------
    sigmas : k of the error bar.
    runs, runs_failed, … : numbers of runs; None where the method counts none of a kind.
    method, inputs, versions, discretization : texts.
    tolerance, expected_error : in parts of the error bar's width; None without one.
    expected_error_of_runs : that of the intervals that were run, where these are narrowed.
    expansion_error, discretization_error : its parts; a text says if one is not estimated.
    refined, halved : what was made finer: to estimate its error, and to reduce it.
    corrected, not_trusted, not_refined, advice, largest_miss, remark : texts, "" without one.
    impacts : whether bodies may hit each other.
    constant_offsets : outputs whose bounds hold for plays that are constant in each run only.
    offsets_stated : whether all plays are stated to be so.
    """

    sigmas: float = 1.0
    runs: int = 0
    runs_failed: int = 0
    runs_repeated: int = 0
    runs_fitted: int = 0
    runs_checked: int = 0
    runs_generic: int | None = None
    runs_refined: int = 0
    runs_coarser: int = 0
    runs_nominal: int = 0
    method: str = ""
    inputs: str = ""
    versions: str = ""
    discretization: str = ""
    tolerance: float | None = None
    expected_error: float | None = None
    expected_error_of_runs: float | None = None
    expansion_error: Any = None
    discretization_error: Any = None
    refined: Any = ()
    halved: Any = None
    corrected: str = ""
    not_trusted: str = ""
    not_refined: str = ""
    advice: str = ""
    largest_miss: str = ""
    remark: str = ""
    stop_reason: str = ""
    orders_used: Any = None
    small_components: str = ""
    same_counts: str = ""
    carrier_frequencies: Any = ()
    steps_per_period: Any = ()
    impacts: int = 0
    constant_offsets: Any = ()
    offsets_stated: int = 0

    @property
    def error_of_runs(self) -> float | None:
        """The expected error of the intervals that were run; None without one."""
        known = self.expected_error is None
        return self.expected_error_of_runs if known else self.expected_error

    @property
    def tolerance_missed(self) -> bool:
        """Whether the expected error of these bands is above the tolerance."""
        tolerance, error = self.tolerance, self.expected_error
        return tolerance is not None and error is not None and error > tolerance


@dataclass(frozen=True)
class VerificationRecord(Record):
    """What a result of `verify` says beside its numbers.

    Attributes
    ----------
    runs, runs_failed : numbers of runs.
    sigmas : k of the error bar that is verified.
    confirmed : "yes", "no" or "no error was expected", see `Confirmation`.
    inferred_share : error that the runs imply, in parts of the error bar's width.
    verdict : the same in words.
    """

    runs: int = 0
    runs_failed: int = 0
    sigmas: float = 1.0
    confidence: float = 0.95
    confirmed: str = ""
    inferred_share: float = 0.0
    verdict: str = ""
