"""A rough search for probabilities, for tests of what does not depend on their values."""

from functools import partial

import pytest

from flexband.analysis.probability import failure
from flexband.analysis.probability.ends import EndOptions
from flexband.analysis.probability.estimates import ImportanceOptions
from flexband.analysis.probability.subset import SubsetOptions

FEW = SubsetOptions(level_samples=200, min_probability=1e-4, scouts=60, scout_chains=20)
ROUGH_SEARCH = EndOptions(
    samples=64, compared_samples=500, scatter_samples=8, inside_points=4, starts=1,
    importance=ImportanceOptions(subset=FEW),
)  # fmt: skip


def search_roughly(patch: pytest.MonkeyPatch) -> None:
    """Let probabilities of leaving limits be searched with few samples."""
    first_passage = partial(failure.first_passage, search=ROUGH_SEARCH)
    patch.setattr(failure, "first_passage", first_passage)
