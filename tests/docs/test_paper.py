"""docs/evidence/paper.md: its text is that of the stored numbers, and these are the code's."""

import json
import runpy
from pathlib import Path

import numpy as np
import pytest

import flexband as fb
from benchmarks.accuracy.mechanisms import slider_crank
from benchmarks.paper.page import page
from benchmarks.paper.studies import PHASES, cosine, errors, mean_widths
from benchmarks.paper.verdicts import cell_of, where

ROOT = Path(__file__).parents[2]
NUMBERS = json.loads((ROOT / "docs" / "evidence" / "paper.json").read_text(encoding="utf-8"))


def test_the_page_is_made_of_the_stored_numbers():
    text = (ROOT / "docs" / "evidence" / "paper.md").read_text(encoding="utf-8")
    assert page(NUMBERS) == text
    pictures = {line.split("(")[1].rstrip(")") for line in text.splitlines() if line[:2] == "!["}
    assert {f"../images/paper/{p.name}" for p in (ROOT / "docs/images/paper").iterdir()} == pictures
    for name in pictures:
        assert (ROOT / "docs" / "evidence" / name).stat().st_size < 100_000


def test_the_stored_numbers_are_those_of_the_code():
    assert np.allclose(list(cosine().values()), list(NUMBERS["cosine"].values()), rtol=1e-4)
    cell = cell_of(NUMBERS["sweep"])
    case = slider_crank(0.7)
    reference, coarse = (
        fb.propagate(case.response, case.inputs, method)
        for method in (fb.methods.PhaseResolvedPCCI(*PHASES), fb.ImprovedPCCI(1, 1))
    )
    third = mean_widths(reference, (0.4, 0.6))
    assert third == pytest.approx(cell["widths"][2], rel=1e-3)
    assert errors(coarse, reference) == pytest.approx(cell["improved PCCI 1"], rel=1e-3)
    row = next(m for m in NUMBERS["reactions"]["methods"] if m["label"] == "improved PCCI (1, 1)")
    assert errors(coarse, reference) == pytest.approx(row["against truth"], rel=0.01)


def test_where_a_statement_holds_is_told_by_step_and_element():
    cells = [
        {"element": element, "step": step, "radius": radius}
        for element in ("plain", "selective")
        for step in (1e-3, 2e-4)
        for radius in (0.5, 0.7)
    ]
    assert where(cells, lambda cell: True) == "every ρ∞, step and element of the sweep"
    assert where(cells, lambda cell: False) == "no ρ∞, step or element of the sweep"
    assert where(cells, lambda cell: cell["radius"] < 0.6) == "ρ∞ = 0.5 at 1 ms; ρ∞ = 0.5 at 0.2 ms"
    odd = where(cells, lambda cell: cell["element"] == "plain" and cell["step"] == 1e-3)
    assert odd == "ρ∞ = 0.5, 0.7 at 1 ms (plain element)"


def test_the_soft_link_bends_little_about_the_rigid_mechanism():
    study = runpy.run_path(str(ROOT / "examples" / "paper" / "soft_link.py"))["study"]
    motion = study.nominal()
    angle = 4 * np.pi * motion.time.values
    crank = 0.2 * np.array([np.cos(angle), np.sin(angle)])
    tilt = -np.arcsin(crank[1] / 0.45)
    rigid = crank + 0.225 * np.array([np.cos(tilt), np.sin(tilt)])
    deviation = np.abs(motion.values - rigid).max()
    assert 1e-4 < deviation < 1e-2  # m: it bends, but little
