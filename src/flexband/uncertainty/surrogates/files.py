"""Surrogates as files: NumPy's .npz of arrays, with a text that says what they are."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from flexband.errors import InputError
from flexband.uncertainty.expansions.expansion import Expansion
from flexband.uncertainty.inputs.correlation import exponential, squared_exponential
from flexband.uncertainty.inputs.inputs import Input, Interval, Normal, RandomField, Uniform
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.surrogates.surrogate import Surrogate

KINDS = {one.__name__: one for one in (Interval, Normal, Uniform, RandomField)}
EXPANSIONS = {
    "DirectExpansion": "flexband.uncertainty.expansions.direct",
    "PhaseExpansion": "flexband.uncertainty.phases.expansion",
}
"""The module of each kind of expansion that a file may hold, imported only if it does."""
CORRELATIONS = {one.__name__: one for one in (squared_exponential, exponential)}


def save_surrogate(surrogate: Surrogate, file: str | Path) -> None:
    """Write a surrogate to a file, complete or not at all.

    Raises
    ------
    InputError
        Where an input is none of flexband's own, a field's correlation is the user's function, or
        the name is that of a folder.
    """
    labels, told, arrays = surrogate.labels, surrogate.diagnostics, {}
    coords = {str(k): c for k, c in labels.coords.items() if "sample" not in c.dims}
    named = {f"coords/{k}": c for k, c in coords.items()}
    named |= {f"told/{k}": v for k, v in told.variables.items()}
    for name, values in named.items():
        text = values.dtype == object
        arrays[name] = values.values.astype(str) if text else values.values
    for k, expansion in enumerate(surrogate.expansions):
        arrays |= {f"expansions/{k}/{name}": v for name, v in expansion.arrays().items()}
    about = {
        "inputs": {name: _described(name, one) for name, one in surrogate.space.inputs.items()},
        "dims": labels.dims,
        "shape": labels.shape,
        "named": {name: (values.dims, values.attrs) for name, values in named.items()},
        "attributes": told.attrs,
        "expansions": [type(expansion).__name__ for expansion in surrogate.expansions],
    }
    file = Path(file)
    if file.is_dir():
        raise InputError(f"{file} is a folder; give the name of a file")
    file.parent.mkdir(parents=True, exist_ok=True)
    partial = file.with_suffix(".partial")
    with partial.open("wb") as opened:
        np.savez_compressed(opened, about=np.array(json.dumps(about)), **arrays)
    partial.replace(file)


def load_surrogate(file: str | Path) -> Surrogate:
    """Return the surrogate that `Surrogate.save` has written. Nothing in the file is executed.

    Raises
    ------
    InputError
        Where the file is not there or is none of a surrogate.
    """
    file = Path(file)
    if not file.is_file():
        raise InputError(f"there is no file {file}")
    try:
        with np.load(file, allow_pickle=False) as opened:
            arrays = dict(opened.items())
        about = json.loads(str(arrays["about"]))
        inputs = {name: _made(one) for name, one in about["inputs"].items()}
        named = {k: (dims, arrays[k], attrs) for k, (dims, attrs) in about["named"].items()}
        expansions = tuple(
            _restored(kind, _under(f"expansions/{k}/", arrays))
            for k, kind in enumerate(about["expansions"])
        )
        labels = xr.DataArray(
            np.zeros(about["shape"]), dims=about["dims"], coords=_under("coords/", named)
        )
        told = xr.Dataset(_under("told/", named), attrs=about["attributes"])
    except (KeyError, TypeError, ValueError, OSError, zipfile.BadZipFile):
        raise InputError(f"{file} holds no surrogate; save_surrogate writes one") from None
    return Surrogate(Space(inputs), labels, expansions, told)


def _under(start: str, named: Mapping[str, Any]) -> dict[str, Any]:
    return {k.removeprefix(start): v for k, v in named.items() if k.startswith(start)}


def _restored(kind: str, arrays: Mapping[str, np.ndarray]) -> Expansion:
    """Return an expansion of a registered kind, whose module is imported here."""
    return getattr(import_module(EXPANSIONS[kind]), kind).of_arrays(**arrays)


def _described(name: str, one: Input) -> dict[str, Any]:
    """Return an input as text and numbers."""
    if type(one).__name__ not in KINDS:
        raise InputError(f"{name}: {one!r} cannot be saved; it is none of {', '.join(KINDS)}")
    values = dict(vars(one))
    values.pop("expansion", None)  # of a field, made anew
    if isinstance(one, RandomField):
        values["correlation"] = one.correlation.__name__
        if CORRELATIONS.get(one.correlation.__name__) is not one.correlation:
            raise InputError(
                f"{name}: a RandomField is saved with the correlations "
                f"{', '.join(CORRELATIONS)}; got {one.correlation!r}"
            )
    return {"kind": type(one).__name__} | values


def _made(described: dict[str, Any]) -> Input:
    """Return the input of `_described`."""
    values = dict(described)
    kind = KINDS[values.pop("kind")]
    if "correlation" in values:
        values["correlation"] = CORRELATIONS[values["correlation"]]
        values["domain"] = tuple(values["domain"])
    return kind(**values)
