"""The paper's figures, numbers and statements, computed again (`make paper`).

At full size it writes docs/evidence/paper.md, the numbers in it to docs/evidence/paper.json, and
its pictures. With fewer samples only the numbers are written, to the output folder, and the sweep
has one setting.
"""

from __future__ import annotations

import itertools
import json
import time
import warnings
from pathlib import Path

import numpy as np
from matplotlib import rc_context
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

import flexband as fb
from benchmarks.accuracy.mechanisms import slider_crank
from benchmarks.harness import ROOT, machine, options
from benchmarks.paper import studies
from benchmarks.paper.figures import drawings
from benchmarks.paper.page import page

NUMBERS = ROOT / "docs" / "evidence" / "paper.json"
PAGE = ROOT / "docs" / "evidence" / "paper.md"
IMAGES = ROOT / "docs" / "images" / "paper"
FULL = 100
"""Samples of LHS–Scanning in the paper."""

DIGITS = 5
COLOURS = 32
"""Digits of the numbers that are stored, and colours of a picture."""


def round_numbers(value: object) -> object:
    """Return numbers in lists and mappings with few digits."""
    if isinstance(value, float):
        return float(f"{value:.{DIGITS}g}")
    if isinstance(value, dict):
        return {str(name): round_numbers(entry) for name, entry in value.items()}
    return [round_numbers(entry) for entry in value] if isinstance(value, list | tuple) else value


def save(figure: Figure, file: Path) -> None:
    """Write a picture with few colours, which takes little space."""
    canvas = FigureCanvasAgg(figure)
    figure.set_dpi(72)
    canvas.draw()
    picture = Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")
    picture.quantize(COLOURS, dither=Image.Dither.NONE).save(file, optimize=True)


def compute_numbers(samples: int) -> dict:
    """Return all numbers of the page; at full size, draw its pictures."""

    def print_time(what: str) -> None:
        print(f"{what}: {time.process_time():.0f} s of processor time", flush=True)

    stiff = studies.full_study(slider_crank(), samples)
    print_time("reactions")
    soft = studies.full_study(slider_crank(**studies.SOFT), samples)
    print_time("soft link")
    if samples >= FULL:
        IMAGES.mkdir(parents=True, exist_ok=True)
        with rc_context({"font.size": 9.0}):
            for name, figure in drawings(stiff, soft):
                save(figure, IMAGES / f"{name}.png")
        print_time("pictures")
    true = studies.converged_bands()
    print_time("converged answer")
    sweep = []
    for cell in itertools.islice(studies.sweep(true), None if samples >= FULL else 1):
        sweep.append(cell)
        print_time(f"{cell['element']}, {cell['step']:g} s, ρ∞ = {cell['radius']:g}")
    return {
        "machine": machine(),
        "cosine": studies.cosine(),
        "cost": studies.cost(stiff.case, samples),
        "field": stiff.case.inputs["youngs_modulus"].largest_variance_error(),
        "reactions": stiff.numbers(),
        "soft link": soft.numbers(),
        "converged": [studies.mean_widths(true, window) for window in studies.WINDOWS],
        "sweep": sweep,
        "seconds": time.process_time(),
    }


def main() -> None:
    arguments = options(
        __doc__, FULL, page="any text: write the page from the stored numbers alone"
    )
    full_size = arguments.samples >= FULL
    numbers_file = NUMBERS if full_size else arguments.output / "paper.json"
    if not arguments.page:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", fb.errors.FlexbandWarning)
            text = json.dumps(
                round_numbers(compute_numbers(arguments.samples)), indent=1, ensure_ascii=False
            )
        numbers_file.parent.mkdir(parents=True, exist_ok=True)
        numbers_file.write_text(text + "\n", encoding="utf-8")
    if full_size:
        PAGE.write_text(
            page(json.loads(numbers_file.read_text(encoding="utf-8"))), encoding="utf-8"
        )


if __name__ == "__main__":
    main()
