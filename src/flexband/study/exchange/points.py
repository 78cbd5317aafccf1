"""Points that are run elsewhere, and the results that come back."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import xarray as xr

from flexband.basics.files import read_unlinked, replace_file
from flexband.errors import InputError, RunsNeeded, StoreError
from flexband.execution.names import FileName
from flexband.study.exchange.columns import column_names, read_csv, write_csv
from flexband.uncertainty.inputs.constants import Constant
from flexband.uncertainty.inputs.evaluation import align_batch
from flexband.uncertainty.inputs.fields.random_field import RandomField
from flexband.uncertainty.inputs.unfolding import GivenInputs, cases


@dataclass
class RequestedPoints:
    """All points of a study that were ever asked for; each keeps its number.

    `asked` has the setting and the numbers, named by `names`, of every point; the first one has the
    number 1.
    """

    folder: Path
    names: list[str]
    asked: list[tuple[str, tuple[float, ...]]]

    @classmethod
    def from_folder(cls, folder: Path) -> RequestedPoints:
        """Return the points in a folder; raise `StoreError` if the file is damaged."""
        file = folder / FileName.LEDGER
        try:
            content = json.loads(read_unlinked(file))
            asked = [(str(setting), tuple(map(float, row))) for setting, row in content["asked"]]
            return cls(folder, list(content["names"]), asked)
        except FileNotFoundError:
            return cls(folder, [], [])
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise StoreError(f"{file} is damaged: {error}") from None

    def ask(self, missing_runs: RunsNeeded, inputs: GivenInputs) -> Path:
        """Write the points that are needed as a table, and keep them; return its path.

        Raise `InputError` if an input is neither a number nor a text.
        """
        if any(isinstance(uncertain, RandomField) for uncertain in inputs.values()):
            raise InputError("a response elsewhere takes numbers and texts; got a RandomField")
        if self.names != list(missing_runs.names):
            self.names = list(missing_runs.names)
            self.asked = []
        point_numbers = {point: k for k, point in enumerate(self.asked, start=1)}
        options = _options(inputs, missing_runs.setting)
        rows = []
        for row in missing_runs.points.tolist():
            point = missing_runs.setting, tuple(row)
            if point not in point_numbers:
                self.asked.append(point)
                point_numbers[point] = len(self.asked)
            rows.append([point_numbers[point], *row, *options.values()])
        with replace_file(self.folder / FileName.LEDGER) as partial:
            content = {"names": self.names, "asked": self.asked}
            partial.write_text(json.dumps(content), encoding="utf-8")
        file = self.folder / FileName.POINTS
        write_csv(file, ["number", *self.names, *options], rows)
        return file

    def read(self, file: Path, labels: xr.DataArray) -> list[Result]:
        """Return the results in a file; see `docs/how-to/studies.md`.

        Raise `InputError` if it is no table of results of points that were asked for.
        """
        entries = _netcdf(file, labels) if file.suffix == ".nc" else self._table(file, labels)
        numbers = [number for number, _, _ in entries]
        wrong = [k for k in numbers if not 1 <= k <= len(self.asked)]
        if wrong:
            raise InputError(
                f"{file}: number must be that of an exported point, 1 to "
                f"{len(self.asked)}; got {wrong[0]}"
            )
        if len(set(numbers)) < len(numbers):
            twice = next(k for k in numbers if numbers.count(k) > 1)
            raise InputError(f"{file} must have each number once; {twice} is there twice")
        results = []
        for number, values, reason in entries:
            setting, inputs = self.asked[number - 1]
            is_finite = bool(np.isfinite(values).all())
            why = "" if is_finite else reason or f"{file.name} has no values for it"
            results.append(Result(setting, np.array(inputs), values if is_finite else None, why))
        return results

    def _table(self, file: Path, labels: xr.DataArray) -> list[tuple[int, np.ndarray, str]]:
        header, rows = read_csv(file)
        columns = column_names(labels)
        missing = [name for name in ("number", *columns) if name not in header]
        if missing:
            raise InputError(
                f"{file} must have the columns number and {_some(columns)}; {missing[0]!r} is "
                "missing"
            )
        entries = []
        for k, row in enumerate(rows, start=2):
            place = f"{file}, row {k}"
            number = _number(f"{place}: number", row["number"])
            if number != round(number):
                raise InputError(f"{place}: number must be a whole number; got {number!r}")
            if 1 <= number <= len(self.asked):
                self._check_inputs(place, row, int(number))
            values = [_number(f"{place}: {name}", row[name], blank=True) for name in columns]
            shaped = np.reshape(values, labels.shape[1:])
            entries.append((int(number), shaped, row.get("reason", "").strip()))
        return entries

    def _check_inputs(self, place: str, row: Mapping[str, str], number: int) -> None:
        """Refuse a row whose inputs are those of another point."""
        for name, value in zip(self.names, self.asked[number - 1][1], strict=True):
            if name in row:
                cell = _number(f"{place}: {name}", row[name])
                if abs(cell - value) > 1e-6 * max(abs(value), abs(cell)):  # programs drop digits
                    raise InputError(
                        f"{place}: {name} must be {value!r}, as point {number} has it; got {cell!r}"
                    )


@dataclass(frozen=True)
class Result:
    """What came back for a point: inputs, (inputs,), and values, None if it failed for a reason."""

    setting: str
    inputs: np.ndarray
    values: np.ndarray | None
    reason: str


def _options(inputs: GivenInputs, setting: str) -> dict[str, str]:
    """Return the inputs of a combination of options that are texts."""
    case = cases(inputs).get(setting, {})
    return {
        name: option.constant
        for name, option in case.items()
        if isinstance(option, Constant) and isinstance(option.constant, str)
    } | {name: option for name, option in case.items() if isinstance(option, str)}


def _netcdf(file: Path, labels: xr.DataArray) -> list[tuple[int, np.ndarray, str]]:
    try:
        with xr.open_dataset(file, engine="scipy", decode_timedelta=False) as opened:
            dataset = opened.load()
        outputs = dataset["outputs"]
        numbers = dataset["number"].values
        aligned_outputs = align_batch(
            outputs.rename({str(dataset["number"].dims[0]): "sample"}), labels
        )
        aligned_outputs = aligned_outputs.transpose(*labels.dims)
    except InputError:
        raise
    except Exception as error:  # whatever the reader raises for other files
        raise InputError(
            f"{file} must be a NetCDF 3 file with the variables number and outputs: {error}"
        ) from None
    return [
        (int(number), row, "") for number, row in zip(numbers, aligned_outputs.values, strict=True)
    ]


def _number(name: str, text: str, *, blank: bool = False) -> float:
    try:
        return float("nan") if blank and not text.strip() else float(text)
    except ValueError:
        raise InputError(f"{name} must be a number; got {text!r}") from None


def _some(names: Sequence[str]) -> str:
    excerpt = ", ".join(names[:3])
    return excerpt if len(names) <= 3 else f"{excerpt}, … ({len(names)} of them)"
