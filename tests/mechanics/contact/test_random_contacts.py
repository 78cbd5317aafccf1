"""A sample of benchmarks/numerics/contacts.py: mechanisms against an event-driven solver."""

import pytest

from benchmarks.numerics.contacts import judge_mechanism


@pytest.mark.parametrize("seed", [3727, 3728])
def test_random_mechanisms_have_their_impacts_when_they_should(seed):
    kind, outcome, text, _ = judge_mechanism(seed, 1e-10)
    assert outcome == "right", f"{kind}: {text}"
