"""Progress where there is no terminal: lines, which count runs."""

import flexband as fb


def test_a_study_in_a_script_tells_its_runs(capsys):
    inputs = {"a": fb.Interval(0.0, 1.0), "b": fb.Normal(0.0, 1.0)}
    with fb.progress_bar("throw") as progress:
        fb.propagate(lambda a, b: a * b, inputs, fb.LHSScanning(10, 5), progress=progress)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0].startswith("throw: 0 of at most 51 runs")
    assert lines[-1] == "throw: 51 of 51 runs"  # one is made again alone
