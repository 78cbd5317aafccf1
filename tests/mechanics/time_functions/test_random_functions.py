"""A sample of benchmarks/numerics/time_functions.py: motions under random functions of time."""

import warnings

import numpy as np
import pytest

import flexband as fb
from benchmarks.numerics.time_functions import trial
from benchmarks.numerics.time_functions_draws import DRIVES, LOADS

CASES = [("load", name) for name in LOADS if name not in ("sines", "vibrations", "waves")]
CASES += [("drive", name) for name in DRIVES if name != "cycloids"]
SEEDS = {"pulses": (32, 44)}  # the latter of one time, quick, and with chords that are off


@pytest.mark.parametrize(("kind", "family"), CASES)
def test_motions_under_random_functions_are_followed(kind, family):
    """Most to 1e-3; pulses of a few steps, whose chords are off, to 1 %."""
    trials = [trial(kind, family, seed) for seed in SEEDS.get(family, (31, 32))]
    assert max(result.error for result in trials) < 1e-2
    if family == "smooth":
        assert not any(result.needless for result in trials)


def test_a_load_of_few_steps_per_period_is_warned_of_with_its_frequency():
    mass = fb.PointMass(mass=1.0)
    for steps, expected in ((6, True), (40, False)):
        mechanism = fb.Mechanism(
            bodies={"p": mass},
            loads={"f": fb.Force("p", x=lambda t: np.sin(2 * np.pi * 100.0 * t))},
            sensors={"p": fb.Position("p")},
        )
        with warnings.catch_warnings(record=True) as records:
            warnings.simplefilter("always")
            fb.simulate(mechanism, duration=0.2, step=0.01 / steps)
        texts = [str(w.message) for w in records if "do not resolve" in str(w.message)]
        assert bool(texts) == expected
        frequencies = [float(text.split(" has about ")[1].split()[0]) for text in texts]
        assert frequencies == [pytest.approx(100.0, rel=0.1)] * expected


def test_no_rate_near_the_end_is_taken_from_values_beyond_a_breakpoint():
    """The last breakpoint is 1.2 steps before the end; differences there reach 3 steps."""
    assert trial("drive", "trapezoids", 700003).error < 1e-6
