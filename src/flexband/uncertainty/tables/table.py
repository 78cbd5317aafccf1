"""Runs that exist: values of inputs and outputs, row by row, checked and without contradictions."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import xarray as xr

from flexband.errors import InputError
from flexband.uncertainty.inputs.evaluation import check_labels, label_result
from flexband.uncertainty.surrogates.axes import series


@dataclass(frozen=True)
class RunTable:
    """Values of inputs by name, (rows,) each, and the response there, first dim "sample"."""

    inputs: Mapping[str, np.ndarray]
    response: xr.DataArray

    @staticmethod
    def from_response(inputs: Mapping[str, np.ndarray], response: xr.DataArray) -> RunTable:
        """Return a table; raise `InputError` unless all values are finite and there are enough."""
        rows = len(response)
        response = label_result(response, rows)
        check_labels(response[:0])
        for name, values in inputs.items():
            if values.shape != (rows,):
                raise InputError(f"table: {name} must have shape ({rows},); got {values.shape}")
            if values.dtype.kind in "biuf" and not np.isfinite(values).all():
                row = int(np.flatnonzero(~np.isfinite(values))[0])
                raise InputError(f"table: {name} must be finite; row {row + 1} has {values[row]}")
        finite_mask = np.isfinite(series(response)).all(axis=(1, 2))
        if not finite_mask.all():
            row = int(np.flatnonzero(~finite_mask)[0])
            raise InputError(
                f"table: outputs must be finite; row {row + 1} is not: leave the row out, if the "
                "run failed"
            )
        return RunTable(inputs, response)

    @cached_property
    def group(self) -> np.ndarray:
        """The number of the different inputs that each row has, in the order of rows, (rows,)."""
        columns = [np.unique(values, return_inverse=True)[1] for values in self.inputs.values()]
        codes = np.stack([np.zeros(len(self.response), int), *columns], axis=1)
        _, first, group = np.unique(codes, axis=0, return_index=True, return_inverse=True)
        order = np.argsort(np.argsort(first))
        return order[group.ravel()]

    @property
    def groups(self) -> int:
        """The number of different rows."""
        return int(self.group.max(initial=-1)) + 1

    @cached_property
    def first(self) -> np.ndarray:
        """The first row of each group, (groups,)."""
        return np.unique(self.group, return_index=True)[1]

    @cached_property
    def means(self) -> np.ndarray:
        """Means of repeated rows, (groups, outputs, times)."""
        values = series(self.response)
        total = np.zeros((self.groups, *values.shape[1:]))
        np.add.at(total, self.group, values)
        return total / np.bincount(self.group)[:, None, None]

    @cached_property
    def noise(self) -> np.ndarray:
        """Standard deviation of repeated rows, (outputs, times); 0 if none is repeated."""
        values = series(self.response)
        spare = len(values) - self.groups
        square = np.sum((values - self.means[self.group]) ** 2, axis=0)
        return np.sqrt(square / max(spare, 1))

    def check(self, names: list[str]) -> None:
        """Raise `InputError` if rows are too few for the inputs, or contradict each other."""
        min_rows = 4 + 2 * len(names)
        if self.groups < min_rows:
            raise InputError(
                f"table must have {min_rows} different rows or more for {', '.join(names)}; "
                f"got {self.groups}"
            )
        values = series(self.response)
        scatter = np.sqrt(np.mean((values - values.mean(axis=0)) ** 2, axis=(0, 2)))
        noise = np.sqrt(np.mean(self.noise**2, axis=1))
        contradicted = noise > 0.7 * scatter
        if contradicted.any() and noise.max() > 0:
            deviation = np.abs(values - self.means[self.group])[:, contradicted].max(axis=(1, 2))
            row = int(deviation.argmax())
            others = np.flatnonzero(self.group == self.group[row])
            rows = ", ".join(str(k + 1) for k in others[:4])
            raise InputError(
                f"table: rows with equal inputs must have about equal outputs; rows {rows} differ "
                "as much as rows with other inputs: an input is missing, or a value is wrong"
            )
