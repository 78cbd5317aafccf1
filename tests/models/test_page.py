"""The code of docs/how-to/models.md runs."""

import re
from pathlib import Path

import numpy as np

PAGE = Path(__file__).parents[2] / "docs" / "how-to" / "models.md"


def test_the_code_runs():
    names = {}
    means = []
    for code in re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL):
        exec(code, names)
        if "bands" in names:
            means.append(names["bands"]["mean"].values)
    first, throw, program, served = means
    np.testing.assert_allclose(first[:, 0], [90.0, 110.0])
    assert 0.0 < np.ptp(throw) < 3.0  # m
    assert 10.0 < throw.min() < throw.max() < 20.4  # less than 2 v²/g without drag
    np.testing.assert_allclose(program, served[:, 0, :26], atol=1e-8)
