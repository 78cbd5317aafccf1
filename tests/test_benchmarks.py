"""Every benchmark runs, at a tiny size."""

import subprocess
import sys
from pathlib import Path

import pytest

FOLDER = Path(__file__).parents[1] / "benchmarks"
BENCHMARKS = [p for p in sorted(FOLDER.glob("*.py")) if "main()\n" in p.read_text("utf-8")]


@pytest.mark.parametrize("program", BENCHMARKS, ids=lambda p: p.stem)
def test_benchmark_runs(program, tmp_path):
    command = [sys.executable, str(program), "--samples", "9", "--repeats", "1"]
    run = subprocess.run(
        [*command, "--output", str(tmp_path)], capture_output=True, text=True, check=False
    )
    assert run.returncode == 0, run.stderr
    assert "| case |" in run.stdout
    assert list(tmp_path.glob("*.json"))
