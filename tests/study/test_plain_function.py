"""What a study of a plain function runs through."""

import sys
import traceback
from pathlib import Path

import numpy as np

import flexband as fb

SOURCE = Path(fb.__file__).parent
INPUTS = {"a": fb.Interval(1.0, 2.0), "b": fb.Normal(1.0, 0.1)}


def product(a, b):
    return a[:, None] * b[:, None] * np.linspace(0.5, 1.0, 20)


def test_from_propagate_to_the_response_are_six_frames():
    stacks = []

    def response(a, b):
        stacks.append([Path(frame.filename) for frame in traceback.extract_stack()])
        return product(a, b)

    fb.propagate(response, INPUTS, fb.PCCI(2, 2))
    assert sum(file.is_relative_to(SOURCE) for file in stacks[0]) <= 6


def test_no_file_of_mechanics_is_entered(tmp_path):
    requirement = fb.Requirement("force", below=3.5)
    study = fb.Study(product, INPUTS, fb.PCCI(2, 2), requirements=[requirement])
    study.run_in(tmp_path / "first")  # imports what it needs
    files = set()

    def note(frame, event, _):
        if event == "call":
            files.add(frame.f_code.co_filename)

    sys.setprofile(note)
    try:
        study.run_in(tmp_path / "second")
    finally:
        sys.setprofile(None)
    rooms = {Path(f).relative_to(SOURCE).parts[0] for f in files if Path(f).is_relative_to(SOURCE)}
    assert "uncertainty" in rooms
    assert "mechanics" not in rooms
