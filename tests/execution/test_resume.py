"""Studies that go on where they were stopped, at every level of discretization."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

import flexband as fb

INPUTS = {"a": fb.Interval(1.0, 2.0), "b": fb.Normal(0.0, 1.0)}


@dataclass(frozen=True)
class Stepwise:
    """A response whose error is the square of a step that the method chooses."""

    made: list = field(default_factory=list)
    step: float = 0.8
    most: float = np.inf

    def __call__(self, a, b):
        if len(self.made) >= self.most:
            raise KeyboardInterrupt
        self.made.extend((self.step, *point) for point in zip(a, b, strict=True))
        return np.exp(a * np.sin(b)) * (1.0 + self.step**2 * a)

    def left_out(self, **values):
        return ["step"]

    def refinements(self, **values):
        return {"step": replace(self, step=self.step / 2)}

    @property
    def identity(self):
        return self.step


def test_a_study_that_chooses_its_step_repeats_no_run_at_any_step(tmp_path):
    method = fb.AdaptivePCCI(0.1)
    whole = Stepwise()
    exact = fb.propagate(whole, INPUTS, method)
    assert len({step for step, *_ in whole.made}) > 3
    made = []
    for most in (20, 45, np.inf):
        part = Stepwise(made, most=most)
        try:
            found = fb.propagate(part, INPUTS, method, store=tmp_path, batch=4)
        except KeyboardInterrupt:
            assert most < np.inf
    assert set(made) == set(whole.made)
    assert len(made) <= len(whole.made) + 2 * 2  # two are made again by every session
    assert found.drop_attrs().identical(exact.drop_attrs())
    again = []
    fb.propagate(Stepwise(again), INPUTS, method, store=tmp_path)
    assert len(again) == 2


@pytest.mark.parametrize(("correct", "levels"), [(False, 1), (True, 2)])
def test_verification_is_recorded_too(tmp_path, correct, levels):
    """It has the step of the expansion, which is twice, or four times, that of the finest runs."""
    response = Stepwise()
    other = Stepwise()
    method = fb.AdaptivePCCI(0.02, correct=correct)
    surrogate = fb.expand(response, INPUTS, method, store=tmp_path)
    first = fb.verify(surrogate, other, store=tmp_path, runs=8).verification
    assert len(other.made) == 8
    assert {step for step, *_ in other.made} == {min(response.made)[0] * 2**levels}
    again = fb.verify(surrogate, other, store=tmp_path, runs=8).verification
    assert len(other.made) == 8
    assert first.identical(again)
