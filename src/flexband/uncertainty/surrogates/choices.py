"""Bands over all combinations of options, and the surrogate of a response with choices."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import xarray as xr

from flexband.basics.words import value_text
from flexband.errors import InputError
from flexband.remarks.collection import merge_remarks
from flexband.uncertainty.inputs.choices import Choice
from flexband.uncertainty.inputs.unfolding import GivenInputs, choices_of, in_words
from flexband.uncertainty.surrogates.bands import VARIABLES, BandRecord, with_names_and_units
from flexband.uncertainty.surrogates.surrogate import Surrogate
from flexband.uncertainty.surrogates.verification_verdict import VerificationRecord

PLACES = {"mean": "mean_at", "error_bar": "error_bar_at"}


def over_choices(inputs: GivenInputs, bands_by_label: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Return bands over all combinations of options, each with bands by its label.

    These are the lowest of all lower and the highest of all upper bounds, and the largest of the
    errors expected. `mean_choice` and `error_bar_choice` tell which combination a bound is due to;
    `mean_by_choice` and `error_bar_by_choice` have all bands; ``attrs["choice_runs"]`` counts runs.
    Other attributes are those of the combination with the largest expected error.
    """
    names = list(bands_by_label)
    bands = list(bands_by_label.values())
    worst = max(bands, key=lambda dataset: BandRecord.read(dataset).expected_error or 0.0)
    result = worst.copy()
    # Take the outermost bounds, with the places and the combinations that they are due to.
    for name in sorted(VARIABLES - set(PLACES.values())):
        values = np.stack([case_bands[name].values for case_bands in bands])
        best = np.stack([values[:, 0].argmin(axis=0), values[:, 1].argmax(axis=0)])
        result[name] = worst[name].dims, _choose(values, best)
        if name in PLACES:
            dims = worst[name].dims
            result[f"{name}_choice"] = dims, np.array(names)[best]
            result[f"{name}_by_choice"] = ("choice", *dims), values
            at = PLACES[name]
            if at in worst:
                places = np.stack([case_bands[at].values for case_bands in bands], axis=1)
                parts = np.stack([_choose(input_places, best) for input_places in places])
                result[at] = worst[at].dims, parts
    # Take the worst of the diagnostics.
    for name in set(worst.data_vars) - VARIABLES:
        if all(name in case_bands for case_bands in bands):
            values = np.stack([case_bands[name].values for case_bands in bands])
            takes_minimum = values.dtype == bool or str(name).endswith("_least")
            result[name] = worst[name].dims, values.min(0) if takes_minimum else values.max(0)
    attrs: dict[str, Any] = {
        "choice_runs": [BandRecord.read(case_bands).runs for case_bands in bands]
    }
    attrs["inputs"] = in_words(inputs)
    # Add up numbers of runs, and keep the largest errors.
    for name, value in worst.attrs.items():
        case_values = [case_bands.attrs.get(name, 0) for case_bands in bands]
        if name == "runs_generic":  # what one combination hides, the others do not show
            attrs["runs_generic"] = min(case_values)
        elif str(name).startswith("runs"):
            attrs[str(name)] = sum(case_values)
        elif isinstance(value, float) and str(name).endswith("_error"):
            attrs[str(name)] = max(v if isinstance(v, float) else 0.0 for v in case_values)
    for name in ("carrier_frequencies", "steps_per_period"):
        if name in worst.attrs:
            attrs[name] = [v for case_bands in bands for v in case_bands.attrs.get(name, [])]
    # Join the doubts of all combinations.
    doubts = {
        label: BandRecord.read(case_bands).not_trusted
        for label, case_bands in bands_by_label.items()
    }
    if any(doubts.values()):
        texts = (f"{doubt} with {label}" for label, doubt in doubts.items() if doubt)
        attrs["not_trusted"] = "; ".join(texts)
    attrs |= merge_remarks(*(case_bands.attrs for case_bands in bands))
    return with_names_and_units(result.assign_coords(choice=names).assign_attrs(attrs))


def verified_choices(verifications: Mapping[str, xr.Dataset]) -> xr.Dataset:
    """Return the results of `verify` of every combination of options, along the dim "choice"."""
    joint = xr.concat(list(verifications.values()), "choice", combine_attrs="drop", join="exact")
    first = next(iter(verifications.values())).attrs
    confirmations = [
        VerificationRecord.read(verification).confirmed for verification in verifications.values()
    ]
    counts = {
        name: [v.attrs[name] for v in verifications.values() if name in v.attrs]
        for name in ("runs", "runs_failed")
    }
    attrs = {name: sum(of_cases) for name, of_cases in counts.items() if of_cases} | {
        "confirmed": next(
            (word for word in ("no", "yes") if word in confirmations), confirmations[0]
        ),
        "verdict": ". ".join(f"{k}: {v.attrs['verdict']}" for k, v in verifications.items()),
    }
    attrs |= merge_remarks(*(verification.attrs for verification in verifications.values()))
    return joint.assign_coords(choice=list(verifications)).assign_attrs(first | attrs)


def _choose(values: np.ndarray, best: np.ndarray) -> np.ndarray:
    """Return of values (cases, bound, …) those of the cases `best`, both (bound, …)."""
    return np.take_along_axis(values, best[None], axis=0)[0]


@dataclass(frozen=True)
class SurrogateOfChoices:
    """The surrogates of all combinations of options, used as one."""

    user_inputs: GivenInputs  # the inputs, choices included
    surrogates: Mapping[str, Surrogate]  # label of the combination -> its surrogate

    def __repr__(self) -> str:
        return f"<Surrogate of {', '.join(self.user_inputs)}; choices {', '.join(self.surrogates)}>"

    @cached_property
    def choices(self) -> dict[str, Choice]:
        """The discrete inputs, in the order of their names."""
        return choices_of(self.user_inputs)

    @cached_property
    def verification(self) -> xr.Dataset | None:
        """What verification runs say of the surrogates, dim "choice"; None without such runs."""
        case_verifications = {label: case.verification for label, case in self.surrogates.items()}
        verifications = {
            label: verification
            for label, verification in case_verifications.items()
            if verification is not None
        }
        return (
            verified_choices(verifications)
            if len(verifications) == len(case_verifications)
            else None
        )

    def evaluate(self, **values: Any) -> xr.DataArray:
        """Return the response at values of the inputs, dims ("sample", …).

        Parameters and errors are those of `Surrogate.evaluate`; a choice is an option, or one per
        sample.
        """
        labels = self._labels(values)
        others = {name: v for name, v in values.items() if name not in self.choices}
        sizes = {len(v) for v in (*others.values(), labels) if np.ndim(v)} - {1}
        if len(sizes) > 1:
            raise InputError(f"values must be equally many; got {sorted(sizes)}")
        count = sizes.pop() if sizes else 1
        labels = np.broadcast_to(labels, count)
        parts = []
        order = []
        for label in dict.fromkeys(labels.tolist()):
            rows = np.flatnonzero(labels == label)
            row_values = {
                k: np.asarray(v)[rows] if np.shape(v)[:1] == (count,) else v
                for k, v in others.items()
            }
            part = self.surrogates[label].evaluate(**row_values)
            parts.append(part.isel(sample=np.zeros(len(rows), int)) if len(part) == 1 else part)
            order.append(rows)
        joint: xr.DataArray = xr.concat(parts, "sample")  # pyright: ignore
        return joint.isel(sample=np.argsort(np.concatenate(order), kind="stable"))

    def moments(self, **values: Any) -> xr.Dataset:
        """Return `mean` and `std` over the random inputs, at options and interval inputs.

        Parameters and errors are those of `Surrogate.moments`; a choice is one option.
        """
        labels = np.unique(self._labels(values))
        if len(labels) > 1:
            raise InputError(f"a choice must be one option here; got {', '.join(labels)}")
        others = {name: v for name, v in values.items() if name not in self.choices}
        return self.surrogates[str(labels[0])].moments(**others)

    def narrowed(self, **inputs: Any) -> SurrogateOfChoices:
        """Return the surrogate for tighter tolerances or less scatter; see `Surrogate.narrowed`.

        Choices stay as they are: `surrogates` has the surrogate of every combination.
        """
        for name in inputs:
            if name in self.choices:
                raise InputError(f"{name} is a Choice: take one of `surrogates`, by its label")
        surrogates = {
            label: surrogate.narrowed(**inputs) for label, surrogate in self.surrogates.items()
        }
        user_inputs = next(iter(surrogates.values())).space.user_inputs
        return SurrogateOfChoices({**user_inputs, **self.choices}, surrogates)

    def bands(self, sigmas: float = 1.0) -> xr.Dataset:
        """Return interval mean and interval error bar over all options; see `over_choices`."""
        bands_by_label = {
            label: surrogate.bands(sigmas) for label, surrogate in self.surrogates.items()
        }
        return over_choices(self.user_inputs, bands_by_label)

    def _labels(self, values: Mapping[str, Any]) -> np.ndarray:
        """Return the label of the combination of each sample, shape (samples,) or (1,)."""
        texts = []
        for name, choice in self.choices.items():
            if name not in values:
                raise InputError(f"values must be given for {name}; got {', '.join(values)}")
            options = np.atleast_1d(values[name])
            for option in np.unique(options):
                if option not in choice.options:
                    raise InputError(f"{name} must be one of {choice!r}; got {value_text(option)}")
            positions = [choice.options.index(option) for option in options.tolist()]
            texts.append([str(choice.options[k]) for k in positions])
        count = max(map(len, texts))
        columns = [column * count if len(column) == 1 else column for column in texts]
        if {len(column) for column in columns} != {count}:
            raise InputError(f"values must be equally many; got {sorted(map(len, texts))}")
        return np.array([", ".join(row) for row in zip(*columns, strict=True)])
