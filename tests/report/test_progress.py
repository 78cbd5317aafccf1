"""Progress where there is no terminal: lines, which count runs."""

import numpy as np
import pytest
import xarray as xr

import flexband as fb
import flexband.report.progress as shown
from flexband.basics.progress import Budget


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


class Halved:
    """Two outputs that step and mesh change, "fine" more than "coarse"; both are left out."""

    def __init__(self, step=0.4, elements=4):
        self.step = step
        self.elements = elements

    def left_out(self, **_):
        return ["step", "elements"]

    def discretization(self, **_):
        return {"step": self.step, "elements of bar": self.elements}

    def refinements(self, **_):
        return {
            "step": Halved(self.step / 2, self.elements),
            "elements": Halved(self.step, 2 * self.elements),
        }

    def __call__(self, a, b):
        t = np.linspace(0, 1, 30)
        y = np.exp(-np.outer(a, t)) + b[:, None]
        coarse = y * (1 + 0.1 * self.elements**-2.0)
        fine = y * (1 + self.step**2)
        values = np.stack([coarse, fine], axis=1)
        return xr.DataArray(
            values, {"output": ["coarse", "fine"], "time": t}, ("sample", "output", "time")
        )


def test_what_is_halved_is_told_with_the_output_that_asks_for_it(capsys, monkeypatch):
    monkeypatch.setattr(shown, "PERIOD", 0.0)
    inputs = {"a": fb.Interval(0.5, 2.0), "b": fb.Normal(0.0, 0.1)}
    lines = lines_of(
        capsys,
        lambda p: fb.propagate(Halved(), inputs, fb.AdaptivePCCI(0.02, correct=False), progress=p),
    )
    messages = [line for line in lines if ": finer " in line]
    assert messages[0] == (
        "throw: finer step and elements (step 0.05, elements of bar 8), since the error of the "
        "step is 15 % of the error bar of fine and the error of the elements is 0.69 % of the "
        "error bar of coarse, and 0.5 % is allowed"
    )
    for ending in (
        "; now the first runs (step 0.4, elements of bar 4)",
        " runs that tell the error of the step",
        " runs that tell the error of the elements",
        "; now the first runs (step 0.05, elements of bar 8)",
    ):
        assert any(line.endswith(ending) for line in lines), ending
    last = messages[-1].split(" (")[1].split(")")[0]
    assert any(f"; now runs until the expansion meets its tolerance ({last})" in k for k in lines)
    assert not any("left" in line for line in lines)


class Oscillator:
    """e^{−at} with a step of time whose error is the square of it; or one without a step."""

    def __init__(self, step=0.1):
        self.step = step
        self.refined = lambda: Oscillator(step / 2)

    def __call__(self, a, b):
        t = np.linspace(0, 1, 30)
        y = np.exp(-np.outer(a, t)) * (1 + self.step**2) + b[:, None]
        return xr.DataArray(y, {"time": t}, ("sample", "time"))


def test_no_number_is_promised_that_is_exceeded(capsys, monkeypatch):
    monkeypatch.setattr(shown, "PERIOD", 0.0)
    inputs = {"a": fb.Interval(0.5, 2.0), "b": fb.Normal(0.0, 0.1)}
    method = fb.AdaptivePCCI()
    for response, text in (
        (Oscillator(), "0 runs so far, at most 201 with the same step and elements"),
        (Oscillator().__call__, "0 of at most 201 runs"),
    ):
        results = []
        lines = lines_of(
            capsys,
            lambda p, r=response, f=results: f.append(fb.propagate(r, inputs, method, progress=p)),
        )
        runs = results[0].attrs["runs"]
        assert lines[0] == f"throw: {text}; now the first runs"
        assert lines[-1] == f"throw: {runs} of {runs} runs"
        assert len(lines) == len(set(lines))


@pytest.mark.parametrize("per_level", [None, 0, 201])
def test_the_time_left_is_told_once_it_is_known(capsys, monkeypatch, per_level):
    """The first batch compiles for 60 s; a thousand batches of 8 runs follow, each in 0.5 s."""
    clock = [1000.0]
    monkeypatch.setattr(shown.time, "monotonic", lambda: clock[0])
    total = 8008 if per_level is None else Budget.from_levels(8008, per_level)

    def tell(progress):
        progress(0, total)
        clock[0] += 60
        for k in range(1, 1001):
            progress(8 * k, total)
            clock[0] += 0.5
        progress(8008, 8008)
        progress(8008, 8008)

    lines = lines_of(capsys, tell)
    assert len(lines) == 2 + 1 + 49  # at most one in 10 s
    assert lines[0].endswith({None: "0 of 8008 runs", 0: "0 of at most 8008 runs",
                              201: "0 runs so far, at most 201 with the same step and elements",
                              }[per_level])  # fmt: skip
    assert "left" not in lines[1]
    if per_level == 201:
        assert not any("left" in line for line in lines)
    else:  # 8008 − 168 runs in 0.5 s for 8
        word = "about" if per_level is None else "at most"
        assert lines[2].endswith(
            f"168 of {'at most ' * (per_level == 0)}8008 runs, {word} 8.2 min left"
        )
    assert lines[-1] == "throw: 8008 of 8008 runs"
