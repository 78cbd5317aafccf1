"""The examples, each with a number asserted."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import flexband as fb
from flexband.study.comparison import compare

EXAMPLES = Path(__file__).parents[1] / "examples"


def test_slider_crank():
    """Relative errors [%] as an independent implementation of the paper found them.

    It was written on another engine (dense tangents, 5 × 3 Gauss points) with other samples; the
    seed of the reference moves the numbers by some tenths.
    """
    study = runpy.run_path(str(EXAMPLES / "slider_crank.py"))["study"]
    expected = {
        fb.ImprovedPCCI(1, 1): (5.0, 6.5, 6.5, 8.1),
        fb.ImprovedPCCI(2, 2): (2.1, 2.3, 5.5, 6.1),
        fb.ImprovedPCCI(3, 3): (0.7, 0.8, 2.5, 3.0),
        fb.PCCI(1, 1): (5.6, 7.3, 7.8, 9.5),
    }
    reference, *found = compare(study, fb.LHSScanning(100, 10, seed=0), list(expected))
    assert reference.runs == 10_000
    assert [r.runs for r in found] == [16, 81, 256, 16]
    for result in found:
        assert result.errors is not None
        percent = [100 * float(result.errors[v].sel(output=o))
                   for v in ("mean", "error_bar") for o in ("F_X", "F_Y")]  # fmt: skip
        assert percent == pytest.approx(expected[result.method], abs=0.3)
    widest = np.ptp(reference.bands["error_bar"].values, axis=0).max()
    assert widest > 100.0  # N: the study's uncertainty is there to be seen


def test_the_readmes_quickstart(capsys):
    readme = (EXAMPLES.parent / "README.md").read_text(encoding="utf-8")
    code = readme.split("```python\n")[1].split("```")[0]
    assert len(code.splitlines()) < 20
    names = {}
    exec(code, names)
    low, high = names["bands"]["error_bar"].sel(output="tip_X", time=0.25)
    assert capsys.readouterr().out.split() == f"[{float(low):.8f} {float(high):.8f}]".split()
    # a soft pendulum of 0.5 m at t = 0.25 s is at 0.3240 (converged mesh, published)
    assert float(low) < 0.3240 < float(high)
    assert float(high - low) < 0.05
