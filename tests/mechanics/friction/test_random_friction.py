"""A sample of benchmarks/friction/friction.py: mechanisms against an event-driven solver."""

import pytest

from benchmarks.friction.friction import judge_mechanism


@pytest.mark.parametrize("seed", [10, 23])
def test_random_mechanisms_stick_and_slide_when_they_should(seed):
    kind, outcome, text, _ = judge_mechanism(seed, 1e-10)
    assert outcome == "right", f"{kind}: {text}"
