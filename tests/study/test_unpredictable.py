"""Studies of motions that impacts make unpredictable: they sample the parts by themselves."""

import numpy as np
import pytest
import xarray as xr

import flexband as fb
from flexband.report.page.charts import chart_data
from flexband.report.study_report import headline_of, remarks
from flexband.report.text.band_tables import before_horizon, predictable_part
from flexband.report.text.parts import (
    horizon_line,
    parts_table,
    sampling_line,
)
from flexband.report.text.requirement_verdicts import verdict_line
from flexband.requirements.verdict import Reason, Verdict
from flexband.study.run import RunOptions

TIME = np.arange(0.0, 5.0, 0.05)


class Colliding:
    """A triangular wave of x e^(2t), from 0 to 1, which is predictable until 2.56 s."""

    def __init__(self, rate=2.0, runs=10_000, *, impacts=True):
        self.rate = rate
        self.runs = runs
        self.hits = impacts
        self.made = 0

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
    uniform = fb.Uniform(0.0, 3.0)
    share = fb.analysis.ShareOfParts
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
    # What is said and shown of it: the sentences, the bands before the horizon, the table.
    line = horizon_line(parts)
    assert line.startswith("Impacts make the motion of a single part unpredictable: y after 2.")
    assert "292 sampled parts show how peaks" in line
    assert sampling_line(parts) == "292 sampled parts with x: Uniform(lower=0.0, upper=3.0)"
    assert headline_of(study, result)[0] == line
    assert not remarks(study, result)
    assert predictable_part(result.bands, parts) is None
    mean = before_horizon(result.bands, "time", parts)["mean"].dropna("time")
    assert mean["time"].values == pytest.approx(TIME[parts["horizon_low"].item() >= TIME])
    assert chart_data(before_horizon(result.bands, "time", parts))["outputs"][0]["name"] == "y"
    assert [row[:2] for row in parts_table(parts)[1]] == [["largest y", "m"], ["smallest y", "m"]]
    second = study_of(Colliding(), requirements=limits, scatter={"x": uniform}).run_in(tmp_path)
    assert second.reused
    xr.testing.assert_identical(second.parts, parts)


def test_samples_of_a_killed_study_are_not_made_again(tmp_path):
    complete = Colliding()
    expected = study_of(complete).run_in(tmp_path / "whole").parts
    first_part = Colliding(runs=complete.made - 100)
    options = RunOptions(batch=50)
    with pytest.raises(KeyboardInterrupt):
        study_of(first_part).run_in(tmp_path / "killed", options)
    second_part = Colliding()
    parts = study_of(second_part).run_in(tmp_path / "killed", options).parts
    assert first_part.made > complete.made - 200
    assert second_part.made < 200
    xr.testing.assert_equal(parts, expected)
    assert "x: Uniform(lower=0.0, upper=3.0), assumed" in parts.attrs["scatter"]


@pytest.mark.parametrize(("rate", "impacts"), [(2.0, False), (0.0, True)])
def test_predictable_motions_and_those_without_impacts_are_not_sampled(tmp_path, rate, impacts):
    result = study_of(Colliding(rate, impacts=impacts)).run_in(tmp_path)
    assert result.doubts
    assert result.parts is None
    assert not (tmp_path / "parts.nc").exists()


def test_shares_that_the_bands_withhold_are_counted_in_the_samples(tmp_path):
    """The motion is predictable, but 8 runs do not resolve the two triangles of its output."""
    share = fb.analysis.ShareOfParts
    limits = [
        fb.Requirement(f"{100 * p:g} %", below=0.5, criterion=share(p)) for p in (0.3, 0.5, 0.6)
    ]
    scatter = {"x": fb.Uniform(0.0, 3.0)}
    study = study_of(Colliding(0.0), requirements=limits, scatter=scatter)
    result = study.run_in(tmp_path)
    assert [v.verdict.value for v in result.verdicts] == ["FAIL", "UNDECIDED", "PASS"]
    assert result.parts["predictable"].all()
    assert not result.unpredictable
    assert remarks(study, result)
    assert not any("unpredictable" in line for line in headline_of(study, result))
    first, *_ = result.verdicts
    assert first.share[1] < 0.5 < first.share[2]


class Shaken(Colliding):
    """The same with a force that moves it a little."""

    def __call__(self, x, force):
        return super().__call__(x) + 1e-3 * force[:, None, None]

    def impacts(self, x, force):
        return True


def test_a_probability_is_counted_in_the_samples(tmp_path):
    limits = [
        fb.Requirement(name, during=(4.9, 4.92), criterion=fb.analysis.Probability(p), below=below)
        for name, below, p in (("often", 0.5, 0.3), ("rarely", 2.0, 0.02))
    ]
    random = fb.Study(
        Colliding(), {"x": fb.Uniform(0.0, 3.0)}, fb.AdaptivePCCI(max_runs=18), requirements=limits
    ).run_in(tmp_path / "random")
    assert [verdict.verdict for verdict in random.verdicts] == [Verdict.FAIL, Verdict.PASS]
    assert random.verdicts[0].share[0] == pytest.approx(0.5, abs=0.08)
    assert random.limits.probability is None
    inputs = {"x": fb.Interval(0.0, 3.0), "force": fb.Normal(0.0, 1.0)}
    worst = fb.Study(Shaken(), inputs, fb.AdaptivePCCI(max_runs=18), requirements=limits).run_in(
        tmp_path / "worst"
    )
    assert [verdict.verdict for verdict in worst.verdicts] == [Verdict.FAIL, Verdict.UNDECIDED]
    assert worst.verdicts[1].reason is Reason.OF_PARTS
    assert "Require a share of the parts" in verdict_line(worst.verdicts[1])


class Geared(Colliding):
    """The same after a gear: a wave that is not predictable, or a triangle that is."""

    def __call__(self, x, gear):
        waves = super().__call__(x)
        return waves if gear[0] == "high" else waves * 0 + 0.1 * x[:, None, None]

    def impacts(self, x, gear):
        return True


def test_parts_are_sampled_with_every_choice(tmp_path):
    inputs = {"x": fb.Interval(0.0, 3.0), "gear": fb.Choice("low", "high")}
    share = fb.analysis.ShareOfParts(0.3)
    limits = [
        fb.Requirement("late", below=below, during=(4.9, 4.92), criterion=share)
        for below in (0.5, 1.5)
    ]
    study = fb.Study(
        Geared(), inputs, fb.AdaptivePCCI(max_runs=8), requirements=limits,
        scatter={"x": fb.Uniform(0.0, 3.0)},
    )  # fmt: skip
    result = study.run_in(tmp_path)
    assert result.parts["choice"].values.tolist() == ["low", "high"]
    assert np.isinf(result.parts["horizon_low"].values).tolist() == [[True], [False]]
    assert result.parts["failing"].values[0, 0] == 0.0
    assert [verdict.verdict for verdict in result.verdicts] == [Verdict.FAIL, Verdict.PASS]
    assert parts_table(result.parts)[1][0][0] == "largest y, low"
    assert ": y after 2." in horizon_line(result.parts)


class Spiked(Colliding):
    """The same with a spike of the height x between two output times."""

    def __init__(self, parts=1):
        super().__init__()
        self.parts = parts

    def __getstate__(self):
        return {"parts": self.parts}

    def __call__(self, x):
        waves = super().__call__(x)
        time = np.linspace(0.0, TIME[-1], self.parts * (len(TIME) - 1) + 1)
        spike = np.where(np.abs(time - 1.012) < 0.01, x[:, None], 0.0)
        spikes = xr.DataArray(spike[:, None], {"output": ["z"], "time": time}, waves.dims)
        return xr.concat([waves.interp(time=time).drop_vars("unit"), spikes], "output")

    def at_more_times(self):
        return Spiked(self.parts * 4)


def test_samples_tell_what_is_between_the_output_times(tmp_path):
    """Half of the spikes are higher than 1.5, the highest ones are nearly 3."""
    share = fb.analysis.ShareOfParts(0.4)
    limits = [
        fb.Requirement("spikes", "z", below=1.5, criterion=share),
        fb.Requirement("curve", "z", below=lambda t: 0.4875 + t, criterion=share),
        fb.Requirement("nominal", "z", within=1.5, criterion=share),
        fb.Requirement("before", "z", below=1.5, during=(0.0, 1.0), criterion=share),
        fb.Requirement("worst", "z", below=2.9),
    ]
    study = study_of(Spiked(), requirements=limits, scatter={"x": fb.Uniform(0.0, 3.0)})
    result = study.run_in(tmp_path)
    assert result.parts["failing"][:3].values == pytest.approx(0.5, abs=0.08)
    assert [str(v.verdict) for v in result.verdicts] == ["FAIL", "FAIL", "FAIL", "PASS", "FAIL"]
    assert result.verdicts[-1].reason is Reason.RUN
    assert result.verdicts[-1].margin == pytest.approx(-0.1, abs=0.05)
    assert "z" not in fb.execution.open_runs(tmp_path)["outputs"].dims
    assert fb.execution.open_runs(tmp_path / "samples").sizes["time"] == 4 * (len(TIME) - 1) + 1
    study_of(Colliding(0.0, impacts=False)).run_in(tmp_path, RunOptions(replace=True))
    assert not (tmp_path / "samples").exists()
