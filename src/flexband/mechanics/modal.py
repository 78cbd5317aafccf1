"""Natural frequencies of a mechanism as a function of its parameters, modes followed by shape.

Modes in order of their frequencies jump where two frequencies cross, and an expansion of them would
have a kink. Here a mode keeps its number: it is the one whose shape agrees most with that of the
mode at nominal values, by the modal assurance criterion |φᴴMφ₀|². If the agreement is not clear,
the mode is followed on the straight line from the nominal values in smaller steps.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import scipy
import xarray as xr

from flexband.basics.checks import (
    check_function,
    check_instance,
    check_integer,
    check_numbers,
    check_option,
)
from flexband.basics.warning import warn
from flexband.basics.words import number_of
from flexband.errors import InputError
from flexband.mechanics.equilibrium import check_steps
from flexband.mechanics.model.mechanism import Mechanism
from flexband.mechanics.modes import sample_modes
from flexband.mechanics.response import Argument
from flexband.mechanics.static_response import AtRest


class ModeTracking(NamedTuple):
    """How modes are followed from the nominal values."""

    clear: float = 0.6
    """Agreement of shapes above which no other mode can agree as much."""
    halvings: int = 6
    """Of the way from the nominal values; then the best agreement is taken."""
    extra_modes: int = 6
    """Modes beside those asked for, among which these are looked for."""
    equal: float = 1e-6
    """Relative difference of frequencies below which shapes are arbitrary."""


class Followed(NamedTuple):
    """Frequencies [Hz], shapes φ and momenta Mφ of samples: (n, modes), (n, coordinates, modes)."""

    frequency: np.ndarray
    vectors: np.ndarray
    momenta: np.ndarray

    def take(self, samples: np.ndarray) -> Followed:
        """Return those of some samples."""
        return Followed(*(array[samples] for array in self))


@dataclass(frozen=True)
class ModalResponse(AtRest):
    """The natural frequencies of `modes` that are followed from nominal values."""

    modes: int = 1
    nominal: Mapping[str, Argument] = field(default_factory=dict)
    about: str = "equilibrium"
    tracking: ModeTracking = field(default_factory=ModeTracking)

    @property
    def identity(self) -> tuple[object, ...]:
        """What the frequencies depend on."""
        nominal = tuple(sorted(self.nominal.items(), key=lambda entry: entry[0]))
        settings = self.modes, nominal, self.about
        return "modal", self.builder, self.steps, self.element_parts, *settings

    def outputs(self, mechanism: Mechanism, values: Mapping[str, Argument]) -> xr.DataArray:
        """Return the frequencies, dims (sample, output)."""
        if values.keys() != self.nominal.keys():
            raise InputError(
                f"nominal must name the arguments {', '.join(values) or 'of the builder'}; got "
                f"{', '.join(self.nominal) or 'none'}"
            )
        # The modes at the nominal values, all of different frequencies.
        start = self._modes(self.mechanism(self.nominal))
        if start.frequency.shape[1] < self.modes:
            raise InputError(
                f"modes must be {start.frequency.shape[1]} or less, the modes that the mechanism "
                f"has; got {self.modes}"
            )
        first = start.frequency[0, : self.modes + 1]
        close = np.flatnonzero(np.diff(first) <= self.tracking.equal * np.abs(first[1:]))
        if len(close):
            raise InputError(
                f"the frequencies of modes {close[0] + 1} and {close[0] + 2} are the same at the "
                f"nominal values, {first[close[0]]:g} Hz, so that their shapes are arbitrary; "
                "choose other nominal values"
            )
        # Follow them to the modes at the values.
        modes = self._modes(mechanism)
        reference = start.take(np.zeros(len(modes.frequency), dtype=int))
        reference = Followed(*(array[..., : self.modes] for array in reference))
        start_values = {k: _broadcast(v, len(modes.frequency)) for k, v in self.nominal.items()}
        end_values = {k: _broadcast(v, len(modes.frequency)) for k, v in values.items()}
        result, lost_count = self._follow_modes(
            start_values, reference, end_values, modes, self.tracking.halvings
        )
        if lost_count:
            warn(
                f"modes of {lost_count} of {number_of(len(modes.frequency), 'run')} agree with "
                "none by shape; the frequencies of the nearest ones are taken"
            )
        names = [f"frequency {k + 1}" for k in range(self.modes)]
        return xr.DataArray(
            result.frequency,
            dims=("sample", "output"),
            coords={"output": names, "unit": ("output", ["Hz"] * self.modes)},
        )

    def _modes(self, mechanism: Mechanism) -> Followed:
        if mechanism.model.state.rule < mechanism.model.state.gap:
            raise InputError("modes of force laws with states are not followed; use fb.modes")
        count = self.modes + self.tracking.extra_modes
        _, samples, unbalanced = sample_modes(mechanism, count, self.about, self.steps)
        if unbalanced:
            raise InputError("about must be 'equilibrium' where loads are not in balance")
        mode_count = min(sample.modes.vectors.shape[1] for sample in samples)
        return Followed(
            np.stack([sample.modes.frequency[:mode_count] for sample in samples]),
            np.stack([sample.modes.vectors[:, :mode_count] for sample in samples]),
            np.stack([sample.momenta[:, :mode_count] for sample in samples]),
        )

    def _follow_modes(
        self,
        start_values: Mapping[str, Argument],
        reference: Followed,
        end_values: Mapping[str, Argument],
        candidates: Followed,
        halvings: int,
    ) -> tuple[Followed, int]:
        """Follow a reference to modes at `end_values`; return these, and how many are lost."""
        matches, clear = _match_modes(reference, candidates, self.tracking)
        result = Followed(
            np.take_along_axis(candidates.frequency, matches, axis=1),
            np.take_along_axis(candidates.vectors, matches[:, None], axis=2),
            np.take_along_axis(candidates.momenta, matches[:, None], axis=2),
        )
        unclear = np.flatnonzero(~clear)
        if not len(unclear) or not halvings:
            return result, len(unclear)
        # Follow unclear modes over the middle of the way.
        ends = [
            {k: _part(v, unclear) for k, v in values.items()}
            for values in (start_values, end_values)
        ]
        middle = {k: _middle(ends[0][k], ends[1][k]) for k in end_values}
        middle_modes = self._modes(self.mechanism(middle))
        if len(middle_modes.frequency) < len(unclear):
            middle_modes = middle_modes.take(np.zeros(len(unclear), dtype=int))
        half, _ = self._follow_modes(
            ends[0], reference.take(unclear), middle, middle_modes, halvings - 1
        )
        unclear_modes, lost_count = self._follow_modes(
            middle, half, ends[1], candidates.take(unclear), halvings - 1
        )
        for joint, part in zip(result, unclear_modes, strict=True):
            joint[unclear] = part
        return result, lost_count


def _match_modes(
    reference: Followed, candidates: Followed, tracking: ModeTracking
) -> tuple[np.ndarray, np.ndarray]:
    """Return which modes agree most with a reference, (n, modes), and where that is clear, (n,)."""
    agreement = np.abs(np.einsum("nck,ncl->nkl", reference.momenta.conj(), candidates.vectors)) ** 2
    sizes = np.abs(np.einsum("nck,nck->nk", reference.momenta.conj(), reference.vectors))
    agreement = agreement / sizes[:, :, None]
    matches = np.stack([scipy.optimize.linear_sum_assignment(-matrix)[1] for matrix in agreement])
    frequency = np.take_along_axis(candidates.frequency, matches, axis=1)
    same = np.abs(candidates.frequency[:, None] - frequency[..., None]) <= tracking.equal * np.abs(
        frequency[..., None]
    )
    return matches, np.all((agreement * same).sum(axis=2) > tracking.clear, axis=1)


def _broadcast(value: Argument, samples: int) -> Argument:
    """Return one value per sample; functions of position stay as they are."""
    return value if callable(value) else np.broadcast_to(np.asarray(value, dtype=float), samples)


def _part(value: Argument, samples: np.ndarray) -> Argument:
    if not callable(value):
        return np.asarray(value)[samples]

    def of_part(x: np.ndarray) -> np.ndarray:
        values = np.asarray(value(x))
        return values[samples] if values.ndim > np.ndim(x) else values

    return of_part


def _middle(a: Argument, b: Argument) -> Argument:
    """Return the mean of two values, or of two functions of position."""
    if not callable(a) and not callable(b):
        return (np.asarray(a) + np.asarray(b)) / 2

    def mean(x: np.ndarray) -> np.ndarray:
        values = [v(x) if callable(v) else np.asarray(v)[:, None] for v in (a, b)]
        return (np.asarray(values[0]) + np.asarray(values[1])) / 2

    return mean


def modal_response(
    builder: Callable[..., Mechanism],
    modes: int,
    *,
    nominal: Mapping[str, Argument],
    about: str = "equilibrium",
    steps: int = 1,
) -> ModalResponse:
    """Return natural frequencies of ``builder(**values)`` as a function of the values.

    The outputs "frequency 1", "frequency 2", … [Hz] are those of the modes of lowest frequency at
    the nominal values. A mode keeps its number where frequencies cross: it is followed by its
    shape.

    Parameters
    ----------
    builder : as in `dynamic_response`.
    modes : number of modes.
    nominal : value of every argument of the builder at which modes are numbered, such as the
        midpoints of intervals and the means of random inputs: numbers, or functions of position.
    about : "equilibrium" or "start", as in `modes`.
    steps : as in `equilibrium`.

    Raises
    ------
    InputError
        If the builder is no function or an argument is out of its range. A call of the response
        raises it if there are fewer modes, or two of them have the same frequency at the nominal
        values.
    """
    check_function("builder", builder, " that returns a Mechanism")
    modes = check_integer("modes", modes, 1)
    steps = check_steps(steps)
    check_instance("nominal", nominal, Mapping, "a mapping from arguments to values")
    check_option("about", about, ["start", "equilibrium"])
    for name, value in nominal.items():
        if not callable(value):
            check_numbers(f"nominal {name}", value)
    return ModalResponse(builder, steps, modes=modes, nominal=dict(nominal), about=about)
