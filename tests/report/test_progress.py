"""Progress where there is no terminal: lines, which count runs."""

import numpy as np
import pytest
import xarray as xr

import flexband as fb
import flexband.report.progress as shown
from flexband.progress import Budget


def lines_of(capsys, tell):
    with fb.progress_bar("throw") as progress:
        tell(progress)
    return capsys.readouterr().err.splitlines()


def test_a_study_in_a_script_tells_its_runs(capsys):
    inputs = {"a": fb.Interval(0.0, 1.0), "b": fb.Normal(0.0, 1.0)}

    def study(progress):
        fb.propagate(lambda a, b: a * b, inputs, fb.LHSScanning(10, 5), progress=progress)

    lines = lines_of(capsys, study)
    assert lines == ["throw: 0 of 51 runs", "throw: 51 of 51 runs"]  # one is made again alone


class Oscillator:
    """e^{−at} with a step of time whose error is the square of it; or one without a step."""

    def __init__(self, step=0.1):
        self.step, self.refined = step, lambda: Oscillator(step / 2)

    def __call__(self, a, b):
        t = np.linspace(0, 1, 30)
        y = np.exp(-np.outer(a, t)) * (1 + self.step**2) + b[:, None]
        return xr.DataArray(y, {"time": t}, ("sample", "time"))


def test_no_number_is_promised_that_is_exceeded(capsys, monkeypatch):
    monkeypatch.setattr(shown, "PERIOD", 0.0)
    inputs, method = {"a": fb.Interval(0.5, 2.0), "b": fb.Normal(0.0, 0.1)}, fb.AdaptivePCCI()
    for response, told in (
        (Oscillator(), "0 runs, at most 201 on each discretization"),
        (Oscillator().__call__, "0 of at most 201 runs"),
    ):
        found = []
        lines = lines_of(
            capsys,
            lambda p, r=response, f=found: f.append(fb.propagate(r, inputs, method, progress=p)),
        )
        runs = found[0].attrs["runs"]
        assert lines[0] == f"throw: {told}"
        assert lines[-1] == f"throw: {runs} of {runs} runs"
        assert len(lines) == len(set(lines))


@pytest.mark.parametrize("each", [None, 0, 201])
def test_the_time_left_is_told_once_it_is_known(capsys, monkeypatch, each):
    """The first batch compiles for 60 s; a thousand batches of 8 runs follow, each in 0.5 s."""
    clock = [1000.0]
    monkeypatch.setattr(shown.time, "monotonic", lambda: clock[0])
    whole = 8008 if each is None else Budget.of(8008, each)

    def tell(progress):
        progress(0, whole)
        clock[0] += 60
        for k in range(1, 1001):
            progress(8 * k, whole)
            clock[0] += 0.5
        progress(8008, 8008)
        progress(8008, 8008)

    lines = lines_of(capsys, tell)
    assert len(lines) == 2 + 1 + 49  # at most one in 10 s
    assert lines[0].endswith({None: "0 of 8008 runs", 0: "0 of at most 8008 runs",
                              201: "0 runs, at most 201 on each discretization"}[each])  # fmt: skip
    assert "left" not in lines[1]
    if each == 201:
        assert not any("left" in line for line in lines)
    else:  # 8008 − 168 runs in 0.5 s for 8
        word = "about" if each is None else "at most"
        assert lines[2].endswith(f"168 of {'at most ' * (each == 0)}8008 runs, {word} 8.2 min left")
    assert lines[-1] == "throw: 8008 of 8008 runs"
