"""Display units: the one place where results leave the units in which they are computed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import Any, TypeVar

import numpy as np
import xarray as xr

from flexband.basics.checks import check_instance, check_option
from flexband.basics.rounding import rounding_attributes, rounding_levels, unit_of_variable
from flexband.basics.words import value_text
from flexband.errors import InputError
from flexband.requirements.requirement import Requirement
from flexband.requirements.units import factor, unit_of
from flexband.uncertainty.inputs.correlated import Correlated

Data = TypeVar("Data", xr.DataArray, xr.Dataset)

ONLY_OUTPUT = "response"
"""What the output of a response without names is called."""

OF_INPUTS = {"tolerance": "name", "largest": "name", "size": "sizing"}
"""Variables that are values of inputs, besides those along dim "input", and the dim of names."""

UNCHANGED = frozenset(
    ("relative_expected_error", "mean_share", "share_at_widest", "shapley_mean_share",
     "shapley_share_at_widest", "at_most", "deviations", "margin_between_after", "run_weight",
     "probability", "first_order", "total", "distribution", "factor", "cost", "saving", "direction",
     "elasticity", "confidence_low", "confidence_high", "run_probability", "run_confidence_low",
     "run_confidence_high", "surrogate_probability", "at_each_time")
)  # fmt: skip
"""Variables without a unit of an output that have no attribute "units" of 1."""


@dataclass(frozen=True)
class Display:
    """In which units numbers are shown.

    Attributes
    ----------
    display_units : units to show numbers in, by names of outputs and inputs.
    units : units of the numbers that the builder takes, by names of inputs.
    """

    display_units: Mapping[str, str] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)

    @staticmethod
    def from_units(display_units: Any, units: Any, inputs: Mapping[str, Any]) -> Display:
        """Return display units after a check; raise `InputError` unless they fit the inputs."""
        names = names_of_inputs(inputs)
        check_instance("units", units, Mapping, 'names with units, such as {"crank_length": "m"}')
        for name, unit in units.items():
            check_option("units", name, names)
            check_instance(f"units[{name!r}]", unit, str, 'a text, "mm" say')
        example = 'names with units, such as {"angle": "deg"}'
        check_instance("display_units", display_units, Mapping, example)
        display = Display(dict(display_units), dict(units))
        for name, unit in display.display_units.items():
            unit_of(_label(name), unit)
            if name in names and not units.get(name):
                raise InputError(
                    f"{_label(name)} requires units[{name!r}], the unit of the number that the "
                    f"builder takes; got {value_text(unit)} alone"
                )
            display.scale(name)
        return display

    def check_fits(self, labels: xr.DataArray, inputs: Iterable[str]) -> None:
        """Raise `InputError` if a name is neither an input nor an output with such a unit."""
        units = names_and_units(labels)
        for name, unit in self.display_units.items():
            if name in inputs:
                continue
            if name not in units:
                allowed = ", ".join(dict.fromkeys([*units, *inputs]))
                raise InputError(f"display_units must be of {allowed}; got {name!r}")
            if not units[name]:
                raise InputError(
                    f"{_label(name)} requires an output with a unit, from which numbers are "
                    f"converted; got {unit!r}"
                )
            factor(_label(name), unit, units[name])

    def requirements(
        self, requirements: Sequence[Requirement], labels: xr.DataArray
    ) -> list[Requirement]:
        """Return requirements with their numbers in the display units of their outputs."""
        display_requirements = []
        units = names_and_units(labels)
        for requirement in requirements:
            named = requirement.name if requirement.name in units else ONLY_OUTPUT
            name = requirement.output or named
            output_unit = name in self.display_units and units.get(name)
            display_requirements.append(
                requirement.in_unit(self.display_units[name], output_unit)
                if output_unit
                else requirement
            )
        return display_requirements

    def scale(self, name: str) -> float:
        """Return by what values of an input are multiplied to be shown."""
        if name not in self.display_units or not self.units.get(name):
            return 1.0
        return 1 / factor(_label(name), self.display_units[name], self.units[name])

    def input_units(self) -> dict[str, str]:
        return {name: self.display_units.get(name, unit) for name, unit in self.units.items()}

    def data(self, data: Data) -> Data:
        """Return a result in display units, with these in its coordinate "unit"."""
        if not self.display_units and not self.units:
            return data
        if isinstance(data, xr.DataArray):
            name = "error_bar"
            return self.data(data.to_dataset(name=name))[name].rename(data.name)
        data = self._inputs(data)
        if "x" in data and "output" in data["x"].attrs:
            return self._path(data)
        return self._outputs(data) if "unit" in data.coords else data

    def _inputs(self, data: xr.Dataset) -> xr.Dataset:
        """Return a result whose values of inputs are in display units."""
        new = {}
        for name, variable in data.data_vars.items():
            dim = OF_INPUTS.get(str(name), "input")
            if variable.dtype.kind == "f" and dim in variable.dims and dim in data.coords:
                factors = [self.scale(str(k)) for k in data[dim].values]
                new[name] = _scale_variable(variable, xr.DataArray(factors, dims=dim))
        if "tolerance" in data and "name" in data["tolerance"].dims:
            units = [self.input_units().get(str(k), "") for k in data["name"].values]
            data = data.assign_coords(tolerance_unit=("name", units))
        if "input" in data.coords:
            units = [self.input_units().get(str(k), "") for k in data["input"].values]
            data = data.assign_coords(input_unit=("input", units))
        return data.assign(new)

    def _path(self, data: xr.Dataset) -> xr.Dataset:
        """Return a path in the display unit of both coordinates; as it is if they differ."""
        data_unit = unit_of_variable(data["x"])
        names = [data[k].attrs["output"] for k in "xy"]
        unit, other = (self.display_units.get(str(name), data_unit) for name in names)
        if not data_unit or unit != other:
            return data
        scale = xr.DataArray(1 / factor(_label(str(names[0])), unit, data_unit))
        lengths = {k: v for k, v in data.data_vars.items() if unit_of_variable(v) == data_unit}
        lengths |= {k: data[k] for k in ("expected_error",) if k in data}
        new = {k: _scale_variable(v, scale).assign_attrs(units=unit) for k, v in lengths.items()}
        return data.assign(new)

    def _outputs(self, data: xr.Dataset) -> xr.Dataset:
        """Return a result whose values of outputs are in display units."""
        # The factor of each output, and the rounding levels of the new units.
        output = data.coords.get("output", xr.DataArray(ONLY_OUTPUT))
        pair = xr.broadcast(output.reset_coords(drop=True), data["unit"].reset_coords(drop=True))
        shape = pair[1].shape
        dims = pair[1].dims
        names, units = (np.ravel(values.values.astype(str)).tolist() for values in pair)
        into = [self.display_units.get(k, u) if u else u for k, u in zip(names, units, strict=True)]
        factors = [
            1 / factor(_label(k), new, u) if new != u else 1.0
            for k, u, new in zip(names, units, into, strict=True)
        ]
        scale = xr.DataArray(np.reshape(factors, shape), dims=dims)
        levels = rounding_levels(data["unit"])
        shown_levels: dict[str, float] = {}
        for unit, new, s in zip(units, into, factors, strict=True):
            shown_levels[new] = max(shown_levels.get(new, 0.0), levels.get(unit, 0.0) * s)
        # Scale what is a value of outputs, with its units.
        of_shares = {"distribution", "total"} & set(data)
        scaled = {
            name: _scale_variable(variable, scale)
            for name, variable in data.data_vars.items()
            if _is_of_outputs(str(name), variable)
            and set(dims) <= set(variable.dims)
            and not (of_shares and str(name).endswith("_error"))
        }
        if "stated_unit" in data:  # that of the output where a requirement states none
            unit_mask = data["stated_unit"] != ""
            in_new_units = _scale_variable(data["stated_scale"], scale)
            scaled["stated_scale"] = data["stated_scale"].where(~unit_mask, in_new_units)
        for variable in scaled.values():
            if "units" in variable.attrs:
                variable.attrs["units"] = into[0]
        unit = xr.DataArray(np.reshape(np.array(into, dtype=str), shape), dims=dims)
        if levels:
            unit.attrs = rounding_attributes(shown_levels)
        result = data.assign(scaled).assign_coords(unit=unit)
        # Values on an axis are outputs, too.
        if "value" in data.indexes and not dims:
            value = data["value"] * factors[0]
            result = result.assign_coords(value=value.assign_attrs(units=into[0]))
        return result


def _is_of_outputs(name: str, variable: xr.DataArray) -> bool:
    return (
        variable.dtype.kind == "f"
        and "input" not in variable.dims
        and unit_of_variable(variable) != "1"
        and name not in UNCHANGED | {"stated_scale", *OF_INPUTS}
        and not name.endswith("_at")
    )


def _scale_variable(variable: xr.DataArray, scale: xr.DataArray) -> xr.DataArray:
    """Return a variable times a factor, with its dims and attributes."""
    values = (variable.variable * scale.variable).transpose(*variable.dims).values
    return variable.copy(data=values)


def names_and_units(data: xr.DataArray | xr.Dataset) -> dict[str, str]:
    """Return the units of the outputs of a response or a result, "" if unknown, by name."""
    names = data.coords["output"].values if "output" in data.coords else [ONLY_OUTPUT]
    unit = data.coords["unit"].values if "unit" in data.coords else ""
    pairs = np.broadcast_arrays(np.asarray(names, dtype=str), np.asarray(unit, dtype=str))
    return dict(zip(*(np.ravel(values).tolist() for values in pairs), strict=True))


def names_of_inputs(inputs: Mapping[str, Any]) -> list[str]:
    """Return the names of inputs, and of the members of correlated ones."""
    members = (
        uncertain_input.members
        for uncertain_input in inputs.values()
        if isinstance(uncertain_input, Correlated)
    )
    return [*inputs, *chain.from_iterable(members)]


def _label(name: str) -> str:
    return f"display_units[{name!r}]"
