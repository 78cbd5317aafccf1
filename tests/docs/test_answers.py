"""The page on answers: its code runs, and what it says is so."""

import re
from pathlib import Path

import numpy as np

PAGE = (Path(__file__).parents[2] / "docs" / "how-to" / "answers.md").read_text(encoding="utf-8")


def test_samples_find_as_much_of_the_worst_sum_as_the_page_says():
    """Means over draws of what 1000 samples find of the worst sum of equal tolerances."""
    sentence = re.search(r"draws are (\d+), (\d+), (\d+) and (\d+) %", PAGE)
    assert sentence is not None
    rng = np.random.default_rng(1)
    for count, percent in zip((3, 5, 10, 20), sentence.groups(), strict=True):
        sums = rng.uniform(-1.0, 1.0, (200, 1000, count)).sum(axis=2).max(axis=1) / count
        assert abs(100 * sums.mean() - int(percent)) < 1.5


ROUGHER = {
    'Peak("height"))': 'Peak("height"), probability=0.9, samples=256)',
    "response=crank)\nruns[": "response=crank, accuracy=0.1)\nruns[",
}
"""Calls of which no number is compared, with fewer samples than by default."""


def test_the_code_runs(capsys):
    names = {}
    page = PAGE
    for call, cheap in ROUGHER.items():
        assert call in page
        page = page.replace(call, cheap)
    for code in re.findall(r"```python\n(.*?)```", page, re.DOTALL):
        exec(code, names)
    percents = re.findall(r"tolerances: (\d+)%", capsys.readouterr().out)
    assert f"# {', '.join(percents[:3])} and {percents[3]} %" in PAGE
    assert names["shares"]["name"].values.tolist() == ["length", "stiffness"]
    width = names["narrower"].bands()["error_bar"].diff("bound").mean()
    assert 0.4 < width / names["shares"]["width"].mean() < 0.6
    assert np.allclose(names["highest"]["mean"], [[0.199], [0.201]], rtol=0, atol=1e-7)
    low, high = names["frequencies"]["mean"].values[:, 0]
    assert abs(low / (80 / 1.5) ** 0.5 * 6.2832 - 1) < 2e-3
    assert abs(high / (120 / 1.5) ** 0.5 * 6.2832 - 1) < 2e-3
    assert names["checked"].attrs["kept"] == "kept"
    lower, upper = names["found"]["probability"].values[:, 0]
    assert 0 <= lower < 1e-6
    assert 1e-4 < upper < 1e-2
    assert names["chosen"].attrs["confirmed"] == "yes"
    assert (names["chosen"]["tolerance"] < names["chosen"]["largest"]).all()
    assert abs(names["chosen"]["slack"].item()) < 1e-4
    assert names["chosen_grades"]["grade"].item() == "medium"
    assert names["shaft"].tolerances.tolist() == [0.0095, 0.015, 0.023]
    # 0.1 of clearance for both, about
    assert names["design"].attrs["confirmed"] == "yes"
    assert abs(names["design"]["size"].sel(sizing="width") - 9.8) < 0.02
    assert abs(names["design"]["tolerance"] - 0.05).max() < 2e-3
    assert abs(names["adjusted"]["least_margin"].item() + 0.02 * np.sin(1.0)) < 1e-6
    assert names["adjusted"]["worst_inputs"].values.ravel().tolist() == [20.2, 19.5, 0.5]
    assert abs(names["shimmed"]["tolerance"] - [0.1 - 0.02 * np.sin(1.0), 0.05]).max() < 1e-5
    assert 8e-4 < names["likely"]["probability"] < 1e-3
