"""Studies of motions that impacts make unpredictable: they sample the parts by themselves."""

import numpy as np
import pytest
import xarray as xr

import flexband as fb
from flexband.report.text.parts import parts_line, parts_table
from flexband.study.results.verdicts import Verdict
from flexband.study.run import RunOptions

TIME = np.arange(0.0, 5.0, 0.05)


class Colliding:
    """A triangular wave of x e^(2t), from 0 to 1, which is predictable until 2.56 s."""

    def __init__(self, rate=2.0, runs=10_000, *, impacts=True):
        self.rate, self.runs, self.hits, self.made = rate, runs, impacts, 0

    def __call__(self, x):
        if self.made + len(x) > self.runs:
            raise KeyboardInterrupt
        self.made += len(x)
        phase = np.exp(self.rate * TIME) * x[:, None]
        values = 2 * np.abs(phase - np.round(phase))[:, None]
        coords = {"output": ["y"], "unit": ("output", ["m"]), "time": TIME}
        return xr.DataArray(values, coords, ("sample", "output", "time"))

    def __getstate__(self):
        return {"rate": self.rate}

    def impacts(self, x):
        return self.hits


def study_of(response, **options):
    inputs = {"x": fb.Interval(0.0, 3.0)}
    return fb.Study(response, inputs, fb.AdaptivePCCI(max_runs=8), **options)


def test_the_parts_are_sampled_where_small_changes_grow_after_impacts(tmp_path):
    uniform, share = fb.Uniform(0.0, 3.0), fb.analysis.ShareOfParts
    limits = [
        fb.Requirement("late", below=0.5, during=(4.9, 4.92), criterion=share(0.3)),
        fb.Requirement("early", above=-1.0, criterion=share(0.02)),
    ]
    study = study_of(Colliding(), requirements=limits, scatter={"x": uniform})
    result = study.run_in(tmp_path)
    parts = result.parts
    assert parts.attrs["samples"] == 292
    assert 2.5 < parts["horizon_low"].item() <= parts["horizon_high"].item() < 2.7
    assert float(parts["failing"][0]) == pytest.approx(0.5, abs=0.08)
    assert parts["failing_low"][0] < 0.5 < parts["failing_high"][0]
    assert [verdict.verdict for verdict in result.verdicts] == [Verdict.FAIL, Verdict.PASS]
    assert result.verdicts[0].share[0] == float(parts["failing"][0])
    assert not parts["quantity_predictable"].any()
    line = parts_line(parts)
    assert line.startswith("Impacts make single motions unpredictable after ")
    assert "those of 292 sampled parts (x: Uniform(lower=0.0, upper=3.0))" in line
    assert "(y): peaks and counts" in line
    assert [row[:2] for row in parts_table(parts)[1]] == [["largest y", "m"], ["smallest y", "m"]]
    again = study_of(Colliding(), requirements=limits, scatter={"x": uniform}).run_in(tmp_path)
    assert again.reused
    xr.testing.assert_identical(again.parts, parts)


def test_samples_of_a_killed_study_are_not_made_again(tmp_path):
    whole = Colliding()
    expected = study_of(whole).run_in(tmp_path / "whole").parts
    killed = Colliding(runs=whole.made - 100)
    options = RunOptions(batch=50)
    with pytest.raises(KeyboardInterrupt):
        study_of(killed).run_in(tmp_path / "killed", options)
    resumed = Colliding()
    parts = study_of(resumed).run_in(tmp_path / "killed", options).parts
    assert killed.made > whole.made - 200
    assert resumed.made < 200
    xr.testing.assert_equal(parts, expected)
    assert "x: Uniform(lower=0.0, upper=3.0), assumed" in parts.attrs["scatter"]


@pytest.mark.parametrize(("rate", "impacts"), [(2.0, False), (0.0, True)])
def test_predictable_motions_and_those_without_impacts_are_not_sampled(tmp_path, rate, impacts):
    result = study_of(Colliding(rate, impacts=impacts)).run_in(tmp_path)
    assert result.doubts
    assert result.parts is None
    assert not (tmp_path / "parts.nc").exists()
