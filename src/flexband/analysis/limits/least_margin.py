"""The least margin of a requirement, and whether it is met, as data."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import xarray as xr

from flexband.analysis.labelled_answers import NOT_JUDGED
from flexband.basics.rounding import unit_of_variable
from flexband.requirements.corridors import FOR_CONSTANT_OFFSETS
from flexband.uncertainty.surrogates.bands import AttributeRecord


@dataclass(frozen=True)
class MarginRecord(AttributeRecord):
    """What a result of `check_requirements` says beside its numbers.

    Attributes
    ----------
    error : the variable of the bands that tells the error, or `NOT_JUDGED` if none does.
    sigmas : k of the error bar, if it is that of all requirements.
    random : whether inputs are random.
    runs, runs_recorded : numbers of runs at worst tolerances, and of those that were looked at.
    of : whose requirements these are, in limits.nc: "the study" or "a question".
    kept : the worst verdict.
    verdict : all verdicts in words.
    """

    error: str = ""
    sigmas: float = 3.0
    random: int = 1
    runs: int = 0
    runs_recorded: int = 0
    of: str = ""
    kept: str = ""
    verdict: str = ""


class LimitVerdict(StrEnum):
    """Whether a requirement is met for all values of the interval inputs; the words of files."""

    KEPT = "kept"
    NOT_KEPT = "not kept"
    UNDECIDED = "undecided"

    @property
    def word(self) -> str:
        """What is printed: "met", "violated" or "undecided"."""
        return {LimitVerdict.KEPT: "met", LimitVerdict.NOT_KEPT: "violated"}.get(self, self.value)


WORST_FIRST = LimitVerdict.NOT_KEPT, LimitVerdict.UNDECIDED, LimitVerdict.KEPT


@dataclass(frozen=True)
class LeastMargin:
    """A verdict on a requirement with its numbers, of which all texts are made."""

    limit: str  # in words
    verdict: LimitVerdict
    margin: float  # the least one
    error: float  # expected of it
    unit: str  # of both
    dim: str  # the last dimension of the output, such as time; "" if there is none
    dim_unit: str
    place: float | str  # of the least margin along this dimension
    margin_between: float  # the least margin between the times, at least
    at_most: float  # the least margin at and between the times, at most
    place_before: float | str  # the time before it
    inputs: list[str]  # values of the inputs there, in words

    @staticmethod
    def from_result(result: xr.Dataset) -> LeastMargin:
        """Return that of one requirement, of what `check_requirements` returns."""
        dim = ""
        places = ("", "")
        if "least_margin_at" in result:
            dim = str(result["margin"].dims[-1])
            positions = result["least_margin_at"], result["margin_between_after"]
            is_number = positions[0].dtype.kind in "iuf"
            places = tuple(float(k) if is_number else str(k.values) for k in positions)
        unit = str(result["unit"].values) if "unit" in result.coords else ""
        inputs = [str(result["worst_choice"].values)] if "worst_choice" in result else []
        if "worst_inputs" in result:
            inputs += inputs_in_words(result, "worst_inputs")
        constant = "constant_offsets" in result and bool(result["constant_offsets"])
        limit = str(result["limit"].values)
        return LeastMargin(
            f"{limit}, {FOR_CONSTANT_OFFSETS}" if constant else limit,
            LimitVerdict(str(result["verdict"].values)),
            float(result["least_margin"]),
            float(result["least_margin_error"]),
            unit,
            dim,
            unit_of_variable(result[dim]) if dim in result.coords else "",
            places[0],
            float(result["margin_between"]),
            float(result["margin_at_most"]),
            places[1],
            inputs,
        )

    @property
    def decided_between(self) -> bool:
        """Whether it is the least margin between the times that may be below zero."""
        return bool(self.dim) and self.margin_between - self.error < 0 <= self.margin

    def in_words(
        self, number: Callable[[float], str] = "{:.4g}".format, *, with_error: bool = False
    ) -> str:
        """Return the least margin, and where it is: "least margin 0.2 N at time 0.1 s"."""
        error = f" ± {self.error:.2g}" if self.error and with_error else ""
        unit = f" {self.unit}" if self.unit else ""
        text = f"least margin {number(self.margin)}{error}{unit}"
        if not self.dim:
            return text
        places = [
            f"{k if isinstance(k, str) else number(k)} {self.dim_unit}".rstrip()
            for k in (self.place, self.place_before)
        ]
        text += f" at {self.dim} {places[0]}"
        if self.decided_between:
            where = "output times" if self.dim == "time" else f"values of {self.dim}"
            text += f"; {self.margin_between:.4g}{unit} between the {where}, after {places[1]}"
        return text


def inputs_in_words(result: xr.Dataset, variable: str) -> list[str]:
    """Return values of the interval inputs, dim "input", with their units if these are known."""
    names = result["input"].values
    values = result[variable].values
    units = result["input_unit"].values if "input_unit" in result.coords else [""] * len(names)
    triples = zip(names, values, units, strict=True)
    return [f"{name} = {value:.6g} {unit}".rstrip() for name, value, unit in triples]


def margins_in_words(result: xr.Dataset) -> str:
    """Return whether requirements are met, of what `check_requirements` returns, as sentences."""
    verdicts = [LeastMargin.from_result(result.isel(limit=k)) for k in range(result.sizes["limit"])]
    words = [
        f"{verdict.limit}: {verdict.verdict.word}, {verdict.in_words(with_error=True)}"
        + (f", with {', '.join(verdict.inputs)}" if verdict.inputs else "")
        for verdict in verdicts
    ]
    unknown = MarginRecord.read(result).error == NOT_JUDGED
    return ". ".join(words) + (f". The surrogate is {NOT_JUDGED}" if unknown else "")
