"""Growing arrays and the journal: whatever happens, what was acknowledged is there."""

import shutil
import tempfile
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from hypothesis import given
from hypothesis import strategies as st

from flexband.errors import StoreError
from flexband.execution import chunks, growing
from flexband.execution.chunks import Array
from flexband.execution.growing import GrowingArrays
from flexband.execution.journal import Finished, Journal

STEPS = st.lists(
    st.one_of(
        st.tuples(st.just("append"), st.integers(1, 9)),
        st.tuples(st.sampled_from(["reopen", "fail", "fail to commit"]), st.integers(0, 3)),
    ),
    max_size=12,
)


def new_arrays(folder):
    arrays = GrowingArrays(folder)
    arrays.add("x", Array("float64", ("run", "place"), (0, 3), {}))
    arrays.add("text", Array("string", ("run",), (0,), {}))
    arrays.add("name", Array("string", ("place",), (3,), {}), np.array(["a", "ß", ""], object))
    arrays.commit()
    return arrays


@given(steps=STEPS, rows=st.integers(1, 7))
def test_arrays_keep_what_was_appended(steps, rows):
    folder = Path(tempfile.mkdtemp())
    expected = []
    max_rows = chunks.Array.most_rows
    write = growing.write_synced
    chunks.Array.most_rows = rows
    try:
        arrays = new_arrays(folder)
        for action, number in steps:
            first = len(expected)
            new = [(float(k), "" if k % 3 else f"µ{k}") for k in range(first, first + number)]
            if action == "append":
                append(arrays, new)
                expected += new
            elif action == "reopen":
                arrays = GrowingArrays(folder)
            else:  # a disk that is full after so many writings; other values are there then
                remaining = [1 if action == "fail to commit" else 0]

                def failing(files, remaining=remaining):
                    remaining[0] -= 1
                    if remaining[0] < 0:
                        raise OSError
                    write(files)

                growing.write_synced = failing
                with pytest.raises(OSError):  # noqa: PT011
                    append(arrays, [(-1.0, "other")] * (number + 1))
                growing.write_synced = write
        for reader in (arrays, GrowingArrays(folder)):
            assert reader.runs == len(expected)
            np.testing.assert_array_equal(reader.read("x")[:, 1], [x for x, _ in expected])
            assert list(reader.read("text")) == [text for _, text in expected]
            assert list(reader.read("name")) == ["a", "ß", ""]
        with xr.open_zarr(folder, chunks=None) as dataset:
            assert dataset.sizes == {"run": len(expected), "place": 3}
            assert list(dataset["text"].values) == [text for _, text in expected]
            np.testing.assert_array_equal(dataset["x"][:, 2], [x for x, _ in expected])
    finally:
        chunks.Array.most_rows = max_rows
        growing.write_synced = write
        shutil.rmtree(folder)


def append(arrays, new):
    x, texts = zip(*new, strict=True)
    columns = {"x": np.repeat(x, 3).reshape(-1, 3), "text": np.array(texts, object)}
    arrays.append(columns)


@given(data=st.data())
def test_any_flipped_bit_is_found_or_harmless(data):
    folder = Path(tempfile.mkdtemp())
    try:
        append(new_arrays(folder), [(float(k), f"{k}") for k in range(5)])
        files = sorted(f for f in folder.rglob("*") if f.is_file())
        file = data.draw(st.sampled_from(files))
        content = bytearray(file.read_bytes())
        place = data.draw(st.integers(0, len(content) - 1))
        content[place] ^= 1 << data.draw(st.integers(0, 7))
        file.write_bytes(content)
        arrays = GrowingArrays(folder)
        bad_rows, chunks = arrays.find_damage()
        assert bad_rows.all() == bool(chunks)
        for name, values in (("x", np.arange(5.0)), ("text", list("01234"))):
            if not chunks or chunks[0][0] != name:
                array = arrays.read(name)
                assert list(array if name == "text" else array[:, 0]) == list(values)
            else:
                with pytest.raises(StoreError, match="damaged"):
                    arrays.read(name)
        assert list(arrays.read("name")) == ["a", "ß", ""]
    finally:
        shutil.rmtree(folder)


def record(k, count=2):
    values = None if k % 4 == 3 else np.full((count, 3), float(k))
    return Finished(f"s{k}", np.full((count, 1), float(k)), values, "why" * k, 0.1, 1e9)


@given(
    steps=st.lists(st.sampled_from(["append", "reopen", "rotate"]), max_size=12),
    cut=st.integers(0, 200),
    flip=st.integers(0, 10_000),
)
def test_a_journal_keeps_what_was_appended(steps, cut, flip):
    folder = Path(tempfile.mkdtemp())
    count = 0
    journal = Journal(folder)
    journals = [journal]
    try:
        for action in steps:
            if action == "append":
                journal.append(2 * count, record(count), sync=False)
                count += 1
            elif action == "reopen":
                journal = Journal(folder)  # as after a kill: the one before is not closed
                journals.append(journal)
            else:
                journal.rotate()
        records = Journal(folder).read(0)
        assert len(records) == count
        for k, entry in enumerate(records):
            for actual, expected in zip(entry, record(k), strict=True):
                np.testing.assert_array_equal(actual, expected)
        assert len(Journal(folder).read(4)) == max(0, count - 2)
        files = sorted(folder.glob("journal-*"))
        if files:  # of the last file, only the records that are whole remain
            content = files[-1].read_bytes()
            files[-1].write_bytes(content[: max(0, len(content) - cut)])
            intact = Journal(folder).read(0)
            assert [entry.setting for entry in intact] == [f"s{k}" for k in range(len(intact))]
            corrupt = bytearray(content)
            corrupt[flip % len(content)] ^= 4
            files[-1].write_bytes(corrupt)
            by_setting = {record(k).setting: record(k) for k in range(count)}
            for entry in Journal(folder).read(0):
                np.testing.assert_array_equal(entry.inputs, by_setting[entry.setting].inputs)
    finally:
        for journal in journals:
            journal.rotate()
        shutil.rmtree(folder)
