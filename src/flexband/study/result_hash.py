"""What the result of a study depends on, as a hash."""

from __future__ import annotations

import hashlib
import re
from typing import TYPE_CHECKING

import numpy as np

from flexband.basics.computation import NUMBERING, source_hash
from flexband.execution.fingerprint import fingerprint
from flexband.execution.store import versions
from flexband.requirements.requirement import requirement_tuple
from flexband.uncertainty.inputs.fields.field import Field
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.inputs.unfolding import first_case, in_words

if TYPE_CHECKING:
    from flexband.study.definition import StudyDefinition

COMPUTING = "mechanics", "uncertainty", "requirements", "analysis", "models", "study"
"""Folders of flexband whose code results depend on."""


def identity(study: StudyDefinition, *options: object) -> str:
    """Return a hash of a study and of further options that change its result."""
    inputs = study.inputs
    texts = re.sub(r" at 0x[0-9a-fA-F]+", "", f"{in_words(inputs)} {study.method!r}")
    requirements = requirement_tuple(study.requirements)
    limits = tuple(map(str, requirements))
    limits += tuple(repr(requirement.criterion) for requirement in requirements)
    settings = (
        texts,
        study.sigmas,
        limits,
        repr(study.scatter),
        options,
        versions(),
        NUMBERING,
        source_hash(*COMPUTING),
    )
    digest = hashlib.sha256(repr(settings).encode())
    sorted_inputs = tuple(sorted(inputs.items()))
    for part in (study.response, study.method, sorted_inputs, study.requirements):
        digest.update(fingerprint(part).encode())
    digest.update(_values(study).tobytes())
    return digest.hexdigest()[:32]


def _values(study: StudyDefinition) -> np.ndarray:
    """Return some values of all inputs but fields: objects of other packages show no parameters."""
    inputs = {
        k: uncertain_input
        for k, uncertain_input in first_case(study.inputs).items()
        if not isinstance(uncertain_input, Field)
    }
    space = Space(inputs)
    rng = np.random.default_rng(0)
    points = (
        rng.uniform(-1, 1, (3, n)) for n in (space.random_dimension, space.interval_dimension)
    )
    values = list(space.recorded_at(*points).values())
    return np.array(values)
