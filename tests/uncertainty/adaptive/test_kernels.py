"""The adaptive method makes the same runs with every kernel of OpenBLAS: rounding decides nothing.

In these cases it did: bounds that are equally wide, places of bounds that no interval moves, signs
of singular vectors, slopes and terms that are nothing but rounding, and fits that are equally good.
"""

import json
import os
import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest

import flexband as fb
from benchmarks.honesty.cases import draw
from tests.kernels import other_kernels

NORMAL = fb.Normal(0.0, 1.0)
INTERVAL = fb.Interval(-1.0, 1.0)
BANDS = "mean", "error_bar"
DRAWN = ("friction", 500), ("veering", 500), ("stops", 501)


def numbers_of_cases() -> list[list]:
    """Return runs, expected error, interval mean and error bar of each case."""
    three = {"x": NORMAL, "y": NORMAL, "z": NORMAL, "e": INTERVAL}
    cases = [
        (lambda x, e: np.abs(x + e - 0.2), {"x": NORMAL, "e": INTERVAL}),
        (lambda x, y, z, e: x * y * z + e, three),
        (lambda e, f: (1 - e**2) * (1 - f**2), {"e": INTERVAL, "f": INTERVAL}),
    ]
    cases += [(case.response, case.inputs) for case in (draw(name, seed) for name, seed in DRAWN)]
    with warnings.catch_warnings(action="ignore"):
        results = [fb.propagate(f, inputs, fb.AdaptivePCCI()) for f, inputs in cases]
    return [
        [
            bands.attrs["runs"],
            bands.attrs["expected_error"],
            *(bands[k].values.tolist() for k in BANDS),
        ]
        for bands in results
    ]


@pytest.mark.parametrize("kernel", other_kernels()[:1])
def test_bands_differ_by_rounding_only(kernel):
    root = Path(__file__).parents[3]
    paths = os.pathsep.join([str(root), str(root / "benchmarks")])
    process = subprocess.run(
        [sys.executable, __file__],
        env=os.environ | {"OPENBLAS_CORETYPE": kernel, "PYTHONPATH": paths},
        capture_output=True, text=True, check=True,
    )  # fmt: skip
    for ours, reference in zip(numbers_of_cases(), json.loads(process.stdout), strict=True):
        assert ours[0] == reference[0]
        assert ours[1] == pytest.approx(reference[1], rel=1e-6, abs=1e-14)
        for band, other in zip(ours[2:], reference[2:], strict=True):
            np.testing.assert_allclose(band, other, rtol=0, atol=1e-10 * np.ptp(ours[3]))


if __name__ == "__main__":
    print(json.dumps(numbers_of_cases()))
