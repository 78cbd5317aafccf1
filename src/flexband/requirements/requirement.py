"""Requirements: bounds of an output, with a name, a unit, and what it takes to meet them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, replace

import numpy as np
import xarray as xr

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_instance, check_numbers, check_positive
from flexband.basics.words import value_text
from flexband.errors import InputError
from flexband.requirements.corridors import (
    ALWAYS,
    Bound,
    Corridor,
    checked_bound,
    chosen_output,
    curve,
    times_of_window,
)
from flexband.requirements.criteria import Criterion, WorstCase
from flexband.requirements.units import factor, unit_of

NOMINAL = "nominal"
"""The `of` of a requirement around the response at the nominal values of all inputs."""


@frozen(eq=False)
class Requirement:
    """Bounds of an output: below or above a limit, between two, or near a curve.

    Parameters
    ----------
    name : of the requirement, as in a specification.
    output : name of the output. It may be left out if the response has one output only, or if the
        requirement has the name of an output: ``fb.Requirement("F_X", below=5.0)``.
    below, above : a number; an array, one per value of the last dim (time) or of the shape of the
        output; a DataArray with dims and coordinates of the output; or a function of the times,
        shape (times,), which returns as many numbers, or one.
    within : half the width of a band around `of`, in place of `below` and `above`.
    of : "nominal", the response with all inputs at their nominal values, or a bound like `below`.
    during : first and last time, or value of the last dim, between which it holds, ends included;
        always unless given.
    criterion : how it is decided whether it is met: `analysis.WorstCase(sigmas)`,
        `analysis.Probability` or `analysis.ShareOfParts`; the worst case of μ ± 3σ unless given.
    unit : of all its numbers, such as "deg"; that of the output unless given.
    identifier, source : where it comes from, such as "REQ-12" and the title of a document.

    Attributes
    ----------
    nominal : the output at the nominal values by combination of options, "" without choices, in
        the output's unit; None before `around`.

    Raises
    ------
    InputError
        If no bound is given, the upper bound is not above the lower one, a number is not real and
        finite, or a text or the criterion is of another type.

    Examples
    --------
    >>> fb.Requirement("wiper angle", output="wiper", within=0.5, of="nominal", unit="deg")
    Requirement('wiper angle', output='wiper', within=0.5, unit='deg')
    >>> str(fb.Requirement("F_X", above=-1600.0, below=1600.0))
    'F_X between -1600 and 1600'
    >>> gap = fb.Requirement("gap", above=lambda t: 10 + 100 * t, during=(0.0, 0.5), unit="mm")
    >>> str(gap)
    'gap above a curve [mm] from 0 to 0.5'
    """

    name: str
    output: str | None = None
    below: Bound = None
    above: Bound = None
    within: float | None = None
    of: Bound | str = NOMINAL
    during: tuple[float, float] | None = None
    criterion: Criterion = WorstCase()
    unit: str = ""
    identifier: str = ""
    source: str = ""
    nominal: Mapping[str, xr.DataArray] | None = None

    def __post_init__(self) -> None:
        # Check the texts.
        for field in ("name", "identifier", "source", "unit"):
            check_instance(f"Requirement {field}", getattr(self, field), str, "a text")
        if not self.name.strip():
            raise InputError(f"Requirement name must be a text; got {value_text(self.name)}")
        if self.output is not None:
            check_instance("Requirement output", self.output, str, "the name of an output")
        check_instance(f"{self.label} criterion", self.criterion, Criterion, "WorstCase(3.0)")
        if self.unit:
            unit_of(f"{self.label} unit", self.unit)
        # Check the bounds, and that they leave room between them.
        if self.within is not None:
            self._check_within(self.within)
        elif self.below is None and self.above is None:
            raise InputError(f"{self.label} must have below, above or both, or within; got none")
        elif not (isinstance(self.of, str) and self.of == NOMINAL):
            raise InputError(f"{self.label} of requires within, half the width of the band")
        for end in ("below", "above"):
            bound = checked_bound(f"{self.label} {end}", getattr(self, end))
            object.__setattr__(self, end, bound)
        ends = self.above, self.below
        if not any(isinstance(end, xr.DataArray) or callable(end) for end in ends):
            self._check_ends(*(np.asarray(np.nan if e is None else e) for e in ends))
        # Check the window.
        if self.during is not None:
            first, last = map(float, check_numbers(f"{self.label} during", self.during, 2))
            if first > last:
                raise InputError(
                    f"{self.label} during must be first and last time; got {self.during}"
                )
            object.__setattr__(self, "during", (first, last))

    def __repr__(self) -> str:
        arguments = [
            f"{field.name}={value!r}"
            for field in fields(self)[1:]
            if field.name not in ("criterion", "nominal")
            and (value := getattr(self, field.name)) is not None
            and not (isinstance(value, str) and value in ("", NOMINAL))
        ]
        if self.criterion != WorstCase():
            arguments.append(f"criterion={self.criterion!r}")
        return f"Requirement({', '.join([repr(self.name), *arguments])})"

    def __str__(self) -> str:
        """Return the requirement in words: wiper angle (nominal ± 0.5°).

        One that is named after its output reads: F between -5 and 5 from 0.1 to 0.2. Without an
        output, a name without a blank may be that of one.
        """
        if self.name == self.output or (self.output is None and " " not in self.name):
            return f"{self.name} {self.bounds}"
        identifier = f"{self.identifier} " if self.identifier else ""
        return f"{identifier}{self.name} ({self.bounds})"

    @property
    def label(self) -> str:
        """What error messages call it."""
        return f"Requirement {self.name!r}"

    @property
    def bounds(self) -> str:
        """Its bounds in words: between -5 and 5 mm from 0.1 to 0.2."""
        low, high = (self._in_words(end) for end in (self.above, self.below))
        if self.within is not None:
            middle = self.of if isinstance(self.of, str) else self._in_words(self.of, bare=True)
            text = f"{middle} ± {self._in_words(self.within)}"
        elif low and high:
            bounds = self._in_words(self.above, bare=True), self._in_words(self.below, bare=True)
            text = f"between {bounds[0]} and {high}"
            if bounds[0] == bounds[1] == "a curve":
                text = "between two curves" + (f" [{self.unit}]" if self.unit else "")
        else:
            text = f"below {high}" if high else f"above {low}"
        if self.during is not None:
            text += f" from {self.during[0]:g} to {self.during[1]:g}"
        return text

    @property
    def needs_nominal(self) -> bool:
        """Whether it is around the nominal response, which is not known yet."""
        around = self.within is not None and isinstance(self.of, str)
        return around and self.nominal is None

    def around(self, nominal: xr.DataArray | Mapping[str, xr.DataArray]) -> Requirement:
        """Return the requirement around a nominal response; any other as it is.

        Parameters
        ----------
        nominal : the response at the nominal values, dims of the response, such as
            ``study.nominal()`` returns; with choices, that of each combination by its label.
        """
        if not self.needs_nominal:
            return self
        cases = {"": nominal} if isinstance(nominal, xr.DataArray) else dict(nominal)
        curves = {}
        for label, values in cases.items():
            check_instance(f"{self.label} nominal", values, xr.DataArray, "study.nominal()")
            number = self.output_in(values.expand_dims("sample"))[1]
            output = values if number is None else values.isel(output=number)
            curves[label] = output.drop_vars([k for k in output.coords if k not in values.dims])
        return replace(self, nominal=curves)

    def in_unit(self, unit: str, known: str) -> Requirement:
        """Return a requirement in the unit of its output, `known`, with its numbers in another.

        One with a unit of its own, or with curves, is returned as it is.
        """
        scale = factor(f"{self.label} unit", known, unit)
        bounds = {end: getattr(self, end) for end in ("below", "above", "within", "of")}
        numbers = {end: scale * bound for end, bound in bounds.items() if isinstance(bound, float)}
        curves = [b for b in bounds.values() if not (b is None or isinstance(b, float | str))]
        return self if self.unit or curves else replace(self, unit=unit, **numbers)

    def output_in(self, labels: xr.DataArray) -> tuple[str, int | None]:
        """Return the name of its output in a response, (runs, …), and its number, if there is one.

        Raise `InputError` if the response has no such output.
        """
        return chosen_output(self.label, self.output, labels, requirement=self.name)

    def check_fits(self, labels: xr.DataArray) -> None:
        """Raise `InputError` if it does not fit a response, as `corridor` does."""
        zeros = xr.zeros_like(labels[:0].sum("sample"))
        (self.around(zeros) if self.needs_nominal else self).corridor(labels)

    def corridor(self, labels: xr.DataArray, case: str = "") -> Corridor:
        """Return where a response, (runs, …), must be, with a combination of options.

        Raise `InputError` if the response has no such output, a curve does not fit it, no time is
        within `during`, the unit is not one of the output, or bounds leave nothing between them.
        """
        name, number = self.output_in(labels)
        output_labels = labels
        where = (...,)
        if number is not None:
            output_labels = labels.isel(output=number)
            where = (*[slice(None)] * (labels.dims.index("output") - 1), number)
        times = None
        window = ALWAYS if self.during is None else self.during
        if self.during is not None:
            times = times_of_window(self.label, self.during, output_labels)
        ends = self._ends(output_labels, case, self.scale(output_labels))
        curves = np.stack(
            [np.full(labels.shape[1:], fill_value) for fill_value in (-np.inf, np.inf)]
        )
        curves[(slice(None), *where)] = ends
        corridor = Corridor(name, curves, where, window, times)
        self._check_ends(corridor.lower[where], corridor.upper[where])
        return corridor

    def scale(self, output_labels: xr.DataArray) -> float:
        """Return the unit of the requirement in units of its output.

        Raise `InputError` if the output has no unit, or one of another dimension.
        """
        if not self.unit:
            return 1.0
        units = set(np.ravel(output_labels.coords.get("unit", [])).tolist())
        if len(units) != 1:
            raise InputError(
                f"{self.label} unit requires an output with a unit, by which numbers are "
                f"converted; got unit={self.unit!r}. Leave it out, and give the numbers in the "
                "output's unit"
            )
        return factor(f"{self.label} unit", self.unit, str(units.pop()))

    def _ends(
        self, output_labels: xr.DataArray, case: str, scale: float
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the lower and the upper bound of an output, of its shape, in its unit."""
        if self.within is None:
            low, high = (
                scale * curve(f"{self.label} {end}", getattr(self, end), output_labels, fill_value)
                for end, fill_value in (("above", -np.inf), ("below", np.inf))
            )
            return low, high
        if not isinstance(self.of, str):
            middle = scale * curve(f"{self.label} of", self.of, output_labels, np.nan)
        elif self.nominal is None:
            raise InputError(
                f"{self.label} is around the nominal response, which only a study knows: use "
                "requirement.around(study.nominal())"
            )
        else:
            nominal_curve = self.nominal.get(case, self.nominal.get(""))
            if nominal_curve is None:
                raise InputError(f"{self.label} nominal must have that of {case}")
            middle = curve(f"{self.label} nominal", nominal_curve, output_labels, np.nan)
        half = scale * self.within
        return middle - half, middle + half

    def _check_within(self, within: float) -> None:
        label = self.label
        if self.below is not None or self.above is not None:
            raise InputError(f"{label} must have either within, or below and above; got both")
        width = float(check_positive(f"{label} within", check_numbers(f"{label} within", within)))
        object.__setattr__(self, "within", width)
        if self.of is not None and not isinstance(self.of, str):
            object.__setattr__(self, "of", checked_bound(f"{label} of", self.of))
        elif self.of != NOMINAL:
            raise InputError(f"{label} of must be {NOMINAL!r} or a bound; got {self.of!r}")

    def _check_ends(self, low: np.ndarray, high: np.ndarray) -> None:
        """Raise `InputError` if nothing is left between two ends, where both have a value."""
        if low.shape and high.shape and low.shape != high.shape:
            return  # which one of them fits is known with the response
        wrong = np.atleast_1d(low >= high)
        if wrong.any():
            place = np.unravel_index(wrong.argmax(), wrong.shape)
            above, below = (np.broadcast_to(end, wrong.shape)[place] for end in (low, high))
            raise InputError(
                f"{self.label} above, which the output must stay above, must be less than below; "
                f"got above={above:g} and below={below:g}"
            )

    def _in_words(self, bound: Bound, *, bare: bool = False) -> str:
        if bound is None or isinstance(bound, str):
            return ""
        if not isinstance(bound, float):
            return "a curve" + (f" [{self.unit}]" if self.unit and not bare else "")
        return f"{bound:g}" if bare else with_unit(f"{bound:g}", self.unit)


def with_unit(number: str, unit: str) -> str:
    """Return a number with its unit: 0.5°, 20 N, 5."""
    return f"{number}°" if unit in ("deg", "°") else f"{number} {unit}".rstrip()


Requirements = Requirement | Sequence[Requirement]


def requirement_tuple(
    requirements: Requirements, name: str = "requirements"
) -> tuple[Requirement, ...]:
    """Return the tuple of one requirement, or of several; raise `InputError` if they are none."""
    sequence = [requirements] if isinstance(requirements, Requirement) else requirements
    is_sequence = isinstance(sequence, Sequence)
    if not is_sequence or not all(isinstance(requirement, Requirement) for requirement in sequence):
        raise InputError(
            f"{name} must be a Requirement or a list of them; got {value_text(requirements)}"
        )
    return tuple(sequence)


def by_name(requirements: Requirements) -> dict[str, Requirement]:
    """Return requirements by their words; raise `InputError` if there is none."""
    requirement_by_name: dict[str, Requirement] = {}
    for requirement in (sequence := requirement_tuple(requirements)):
        name = str(requirement)
        count = 2
        while name in requirement_by_name:
            name = f"{requirement} ({count})"
            count = count + 1
        requirement_by_name[name] = requirement
    if not sequence:
        raise InputError(
            f"requirements must be a Requirement or a list of them; got {value_text(requirements)}"
        )
    return requirement_by_name


def corridors(
    requirements: Requirements, labels: xr.DataArray, case: str = ""
) -> dict[str, Corridor]:
    """Return the corridor of each requirement, in words; raise `InputError` if one does not fit."""
    requirement_by_name = by_name(requirements)
    return {
        name: requirement.corridor(labels, case)
        for name, requirement in requirement_by_name.items()
    }
