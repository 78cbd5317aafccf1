"""The surrogate of runs that exist, from files, data frames, datasets and stores."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import xarray as xr

from flexband.basics.checks import check_instance, check_integer
from flexband.basics.words import value_text
from flexband.errors import InputError
from flexband.study.exchange.run_tables import Columns, columns_of, inputs_and_response
from flexband.uncertainty.inputs.choices import Chosen
from flexband.uncertainty.inputs.fields.field import Field
from flexband.uncertainty.inputs.inputs import Interval
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.inputs.unfolding import GivenInputs, cases
from flexband.uncertainty.surrogates.choices import SurrogateOfChoices
from flexband.uncertainty.surrogates.surrogate import Surrogate
from flexband.uncertainty.tables.regression import surrogate_of_rows
from flexband.uncertainty.tables.table import RunTable


def surrogate_of(
    table: Any,
    inputs: GivenInputs,
    outputs: Sequence[str] | None = None,
    *,
    time: str | None = None,
    units: Mapping[str, str] | None = None,
    seed: int = 0,
) -> Surrogate | SurrogateOfChoices:
    """Return a surrogate of existing runs, which were computed or measured elsewhere.

    Terms are chosen by sparse regression, for vibrating outputs those of phases and envelopes. From
    16 different rows on, cross-validation judges the surrogate as check runs judge others: terms
    are chosen again in every fold, and equal inputs are in one fold. Rows that are denser in a part
    of the inputs count less there. Outputs of equal inputs that differ are noise, of which the mean
    is taken; ``attrs["noise"]`` tells its standard deviation.

    Parameters
    ----------
    table : path of a .csv or .nc file, or of a folder with runs (`Store`); a DataFrame; a mapping
        of columns; or a Dataset. Columns have the names of inputs and outputs, maybe with a unit
        as ``length [mm]``; ``u[time=0.5]`` is an output at a time. Variables of a Dataset have the
        dim of the runs first, and that of time last.
    inputs : as in `propagate`. Rows may lie beyond intervals, but not only within a part of them:
        verdicts are undecided where no row is near.
    outputs : names of the outputs; all columns that are no inputs by default.
    time : column of the time, if a table has a row for each run and time: rows of a run follow each
        other, and all runs have the same times.
    units : that of inputs and outputs by name, which the table must not contradict.
    seed : of the folds.

    Raises
    ------
    InputError
        If the table lacks a column, has values that are not finite, too few rows, or rows with
        equal inputs that contradict each other; or if an input is a field or a `Play`.

    Examples
    --------
    >>> rng = np.random.default_rng(0)
    >>> force, play = rng.uniform(9.0, 11.0, 40), rng.normal(0.0, 0.1, 40)
    >>> table = {"force": force, "play": play, "u": 0.2 * force + play**2}
    >>> inputs = {"force": fb.Interval(9.0, 11.0), "play": fb.Normal(0.0, 0.1)}
    >>> fb.surrogate_of(table, inputs).bands()["mean"].values.round(3).ravel()
    array([1.81, 2.21])
    """
    check_instance("inputs", inputs, Mapping, "a dict of names and inputs")
    check_instance("time", time, str | None, "the name of a column")
    check_instance("units", units, Mapping | None, "a dict of names and units")
    names = [] if outputs is None else outputs
    if not isinstance(names, list | tuple) or not all(isinstance(name, str) for name in names):
        raise InputError(f"outputs must be a list of names; got {value_text(outputs)}")
    seed = check_integer("seed", seed, 0)
    for name, input_ in inputs.items():
        if isinstance(input_, Field):
            raise InputError(f"{name} must be a number for each row; got {value_text(input_)}")
    columns = columns_of(table, set(inputs), outputs, units or {})
    input_columns, response = inputs_and_response(columns, inputs, outputs, time)
    surrogates = {
        label: _of_case(input_columns, response, case, label, seed)
        for label, case in cases(inputs).items()
    }
    return surrogates[""] if "" in surrogates else SurrogateOfChoices(inputs, surrogates)


def _of_case(
    input_columns: Columns,
    response: xr.DataArray,
    case: GivenInputs,
    label: str,
    seed: int,
) -> Surrogate:
    """Return the surrogate of one combination of options, of the rows that have it."""
    space = Space(case)
    rows = np.full(len(response), True)
    for name, constant in space.constants.items():
        if name in input_columns:
            rows &= input_columns[name] == constant.constant
            if not rows.any():
                of = f" with {label}" if label else ""
                raise InputError(f"table must have rows with {name} = {constant!r}{of}; got none")
    case_columns = {name: input_columns[name][rows] for name in space.uncertain}
    wide = dict(case)
    narrow = {}
    for name, input_ in space.uncertain.items():
        if isinstance(input_, Interval | Chosen):
            covered = input_ if isinstance(input_, Interval) else input_.full_interval
            ends = case_columns[name].min(), case_columns[name].max()
            if ends[0] < covered.lower or ends[1] > covered.upper:
                low = min(ends[0], covered.lower)
                high = max(ends[1], covered.upper)
                wide[name] = Interval(float(low), float(high))
                narrow[name] = covered
    surrogate = surrogate_of_rows(
        RunTable.from_response(case_columns, response[rows]), Space(wide), seed
    )
    return surrogate.narrowed(**narrow) if narrow else surrogate
