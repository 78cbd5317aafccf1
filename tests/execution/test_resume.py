"""Studies that go on where they were stopped, at every level of discretization."""

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

import flexband as fb

INPUTS = {"a": fb.Interval(1.0, 2.0), "b": fb.Normal(0.0, 1.0)}


@dataclass(frozen=True)
class Stepwise:
    """A response whose error is the square of a step that the method chooses."""

    runs: list = field(default_factory=list)
    step: float = 0.8
    max_runs: float = np.inf

    def __call__(self, a, b):
        if len(self.runs) >= self.max_runs:
            raise KeyboardInterrupt
        self.runs.extend((self.step, *point) for point in zip(a, b, strict=True))
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
    complete = Stepwise()
    exact = fb.propagate(complete, INPUTS, method)
    assert len({step for step, *_ in complete.runs}) > 3
    runs = []
    for max_runs in (20, 45, np.inf):
        part = Stepwise(runs, max_runs=max_runs)
        try:
            bands = fb.propagate(part, INPUTS, method, store=tmp_path, batch=4)
        except KeyboardInterrupt:
            assert max_runs < np.inf
    assert set(runs) == set(complete.runs)
    assert len(runs) <= len(complete.runs) + 2 * 2  # two are made again by every session
    assert bands.drop_attrs().identical(exact.drop_attrs())
    repeats = []
    fb.propagate(Stepwise(repeats), INPUTS, method, store=tmp_path)
    assert len(repeats) == 2


@pytest.mark.parametrize(("correct", "levels"), [(False, 1), (True, 2)])
def test_verification_is_recorded_too(tmp_path, correct, levels):
    """It has the step of the expansion, which is twice, or four times, that of the finest runs."""
    response = Stepwise()
    verifier = Stepwise()
    method = fb.AdaptivePCCI(0.02, correct=correct)
    surrogate = fb.expand(response, INPUTS, method, store=tmp_path)
    first = fb.verify(surrogate, verifier, store=tmp_path, runs=8).verification
    assert len(verifier.runs) == 8
    assert {step for step, *_ in verifier.runs} == {min(response.runs)[0] * 2**levels}
    second = fb.verify(surrogate, verifier, store=tmp_path, runs=8).verification
    assert len(verifier.runs) == 8
    assert first.identical(second)
