"""What the result of a study depends on, as a hash."""

from __future__ import annotations

import hashlib
import re
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from flexband.execution.fingerprint import PACKAGE, fingerprint
from flexband.execution.store import versions
from flexband.uncertainty.inputs.choices import first_case
from flexband.uncertainty.inputs.fields.field import Field
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.inputs.unfolding import in_words

if TYPE_CHECKING:
    from flexband.study.study import Study


def identity(study: Study, *options: object) -> str:
    """Return a hash of a study and of further options that change its result."""
    inputs = study.inputs
    texts = re.sub(r" at 0x[0-9a-fA-F]+", "", f"{in_words(inputs)} {study.method!r}")
    limits = tuple(map(str, study.limits))
    told = texts, study.sigmas, limits, options, versions(), _program()
    found = hashlib.sha256(repr(told).encode())
    named = tuple(sorted(inputs.items()))
    for one in (study.response, study.method, named, study.limits):
        found.update(fingerprint(one).encode())
    found.update(_values(study).tobytes())
    return found.hexdigest()[:32]


def _values(study: Study) -> np.ndarray:
    """Return some values of all inputs but fields: objects of other packages show no parameters."""
    inputs = {k: one for k, one in first_case(study.inputs).items() if not isinstance(one, Field)}
    space = Space(inputs)
    rng = np.random.default_rng(0)
    points = (
        rng.uniform(-1, 1, (3, n)) for n in (space.random_dimension, space.interval_dimension)
    )
    values = list(space.recorded_at(*points).values())
    return np.array(values)


@cache
def _program() -> str:
    """Return a hash of flexband's own files."""
    found = hashlib.sha256()
    for file in sorted(PACKAGE.rglob("*.py")):
        found.update(file.read_bytes())
    return found.hexdigest()
