"""The store of a study: every run that was made, in a folder, so that none is made twice."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

import numpy as np
import xarray as xr

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_flag
from flexband.basics.computation import NUMBERING, source_hash
from flexband.basics.files import refuse_links
from flexband.basics.response import ResponseFunction
from flexband.basics.words import value_text
from flexband.errors import InputError, StoreError
from flexband.execution.fingerprint import fingerprint
from flexband.execution.names import FileName

OTHER_FOLDER = "Take another folder, or delete its runs (`flexband run --replace` does)"
ALLOW_MISMATCH = "allow_mismatch=True of the Store uses them; on the command line, --allow-mismatch"
"""What can be done about a store that is refused."""

PACKAGES = ("flexband", "numpy", "scipy", "numba", "xarray")
"""Those whose versions are told in results."""


@cache
def versions() -> str:
    """Return the versions of the packages that compute, as text."""
    return ", ".join(f"{name} {version(name)}" for name in PACKAGES)


@frozen()
class Store:
    """A folder in which every run is recorded as soon as it is finished.

    A study with the same store does not make these runs again, whatever its method and the limits
    of its intervals. They are in ``folder/runs.zarr``, which `open_runs` and xarray open at any
    moment.

    Parameters
    ----------
    folder : path of the folder, which is made if it is missing.
    version : text of yours that belongs to the response, such as the revision of an external
        program: with another one, the store is refused.
    allow_mismatch : whether to use a store whose runs come from another response, version or
        program, or disagree with new ones.

    Raises
    ------
    InputError
        If an argument is not as stated.
    StoreError
        In `propagate` and the like, if the folder belongs to another response or is in use by
        another process, cannot be written to, or is damaged beyond the chunks of runs.

    Examples
    --------
    >>> import tempfile
    >>> inputs, doubled = {"a": fb.Interval(0.0, 1.0)}, lambda a: 2 * a
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     store = fb.execution.Store(folder)
    ...     bands = fb.propagate(doubled, inputs, fb.ImprovedPCCI(0, 2), store=store)
    ...     runs = fb.execution.open_runs(folder)["outputs"].values
    ...
    >>> np.sort(runs)
    array([0., 1., 2.])
    """

    folder: str | os.PathLike[str]
    version: str = ""
    allow_mismatch: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.folder, str | os.PathLike) or not str(self.folder):
            raise InputError(f"folder must be the path of a folder; got {self.folder!r}")
        if not isinstance(self.version, str):
            raise InputError(f"version must be a text; got {self.version!r}")
        allow_mismatch = check_flag("allow_mismatch", self.allow_mismatch)
        object.__setattr__(self, "allow_mismatch", allow_mismatch)
        object.__setattr__(self, "folder", Path(self.folder))

    @property
    def runs(self) -> Path:
        """Folder of the recorded runs."""
        return Path(self.folder) / FileName.RUNS


StoreLike = Store | str | os.PathLike[str] | None
"""Where runs are recorded, as users give it."""


def as_store(store: StoreLike) -> Store | None:
    """Return a store, or that of a folder; None for None."""
    if store is None or isinstance(store, Store):
        return store
    if not isinstance(store, str | os.PathLike):
        raise InputError(f"store must be the path of a folder, or a Store; got {value_text(store)}")
    return Store(store)


def mechanics_hash() -> str:
    """Return a text that another one replaces wherever runs of mechanisms may be others."""
    return f"{NUMBERING.runs}: {source_hash('mechanics')[:16]}"


class Owner(NamedTuple):
    """What the runs of a store belong to; each is a text."""

    response: str
    mechanics: str
    version: str
    inputs: str
    fields: str

    @classmethod
    def from_response(
        cls, response: ResponseFunction, version: str, inputs: Sequence[str], fields: str
    ) -> Owner:
        """Return the owner for a response, the names of the numbers it takes, and its fields."""
        return cls(fingerprint(response), mechanics_hash(), version, ", ".join(inputs), fields)

    def check(self, owner: Mapping[str, str] | None, store: Store) -> None:
        """Raise `StoreError` if the runs of a store belong to another response."""
        if owner is None or (store.allow_mismatch and owner["inputs"] == self.inputs):
            return
        differ = [name for name in Owner._fields if owner.get(name) != getattr(self, name)]
        if differ:
            details = "; ".join(
                f"{name}: {owner.get(name)!r} before, {getattr(self, name)!r} now"
                for name in ("version", "inputs")
                if name in differ
            )
            remedy = f". If its runs are valid still, {ALLOW_MISMATCH}"
            changed = " and ".join(WORDS[name] for name in differ) + (
                f" ({details})" if details else ""
            )
            raise StoreError(
                f"{store.folder} has runs of another response: {changed} changed. "
                f"{OTHER_FOLDER}{remedy * ('inputs' not in differ)}"
            )


WORDS = {
    "response": "the code or the data of the response",
    "mechanics": "flexband's mechanics",
    "version": "the version",
    "inputs": "the names of the inputs",
    "fields": "the fields among the inputs",
}


def open_runs(folder: str | os.PathLike[str]) -> xr.Dataset:
    """Return the recorded runs of a study, whether it is finished, stopped or still going on.

    Parameters
    ----------
    folder : of the `Store`.

    Returns
    -------
    Dataset with the variables `outputs`, dims ("run", …); `inputs`, dims ("run", "input");
    `status`, whose values ``status.flag_meanings`` explains; `reason`, why a run failed; `seconds`,
    its wall time [s]; `finished`, when; `setting`, the options of a `Choice` and what is finer in
    the discretization; and `session`, a number in the JSON text ``attrs["sessions"]``, which tells
    versions. It can be written with ``to_netcdf``.

    Raises
    ------
    InputError
        If the folder is no path.
    StoreError
        If the folder has no runs, or they have a symbolic link among their files.
    """
    if not isinstance(folder, str | os.PathLike):
        raise InputError(f"folder must be the path of a folder; got {value_text(folder)}")
    path = Path(folder) / FileName.RUNS
    try:
        present = (path / "zarr.json").exists()
    except (OSError, ValueError) as error:
        raise InputError(
            f"folder must be the path of a folder; got {value_text(folder)}"
        ) from error
    if not present:
        raise StoreError(f"folder must have the runs of a study; there are none in {str(folder)!r}")
    refuse_links(path)
    runs = xr.open_zarr(path, chunks=None, consolidated=True)
    texts = {
        name: (variable.dims, np.array(variable.values.tolist(), dtype=str), variable.attrs)
        for name, variable in runs.variables.items()
        if variable.dtype.kind == "T"  # which cannot be compared with names, nor converted
    }
    plain = {k: v if isinstance(v, str) else json.dumps(v) for k, v in runs.attrs.items()}
    runs = runs.drop_encoding().assign(texts).assign_attrs(plain)
    runs["finished"].encoding = {"units": "seconds since 1970-01-01", "dtype": "float64"}
    return runs
