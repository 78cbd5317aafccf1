"""Arrays in a page are those that were packed."""

import json
from importlib import resources

import numpy as np
import pytest

from flexband.report.page.arrays import pack

SCRIPT = resources.files("flexband.report.page").joinpath("assets/arrays.js").read_text()


@pytest.mark.parametrize(("quantum", "size"), [(None, 8), (1e-3, 2), (1e-8, 4), (1e-12, 8)])
def test_arrays_are_read_as_they_were_packed(open_page, tmp_path, quantum, size):
    values = np.random.default_rng(0).normal(size=(3, 4, 5))
    record = pack(values, quantum)
    assert record["bytes"] == size
    file = tmp_path / "page.html"
    file.write_text(f"<!doctype html><script>{SCRIPT}</script>", encoding="utf-8")
    result = open_page(file).evaluate(
        "async (tree) => { const one = (await flexband.unpackedTree({ list: [tree] })).list[0];"
        " return { shape: one.shape, values: Array.from(one.values) }; }",
        json.loads(json.dumps(record)),
    )
    round_trip = np.array(result["values"]).reshape(result["shape"])
    rounded = (quantum / 2) * (1 + 1e-6) if size < 8 else 0
    np.testing.assert_allclose(round_trip, values, rtol=0, atol=rounded)


def test_numbers_that_no_multiple_can_be_keep_all_digits():
    assert pack([np.nan, 1.0], 1e-3)["bytes"] == pack([1e300], 1e-3)["bytes"] == 8
    assert pack(np.zeros((0, 3)))["shape"] == [0, 3]
