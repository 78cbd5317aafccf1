"""A sample of benchmarks/time_functions.py: motions under random functions of time."""

import pytest
from time_functions import trial
from time_functions_draws import DRIVES, LOADS

FOLLOWED = [("load", name) for name in LOADS if name not in ("sines", "vibrations", "waves")]
FOLLOWED += [("drive", name) for name in DRIVES if name != "cycloids"]


@pytest.mark.parametrize(("kind", "family"), FOLLOWED)
def test_motions_under_random_functions_are_followed(kind, family):
    """Most to 1e-3; pulses of a few steps, whose chords are off, to 1 %."""
    trials = [trial(kind, family, seed) for seed in (31, 32, 33)]
    assert max(each.error for each in trials) < 1e-2
    if family == "smooth":
        assert not any(each.needless for each in trials)
