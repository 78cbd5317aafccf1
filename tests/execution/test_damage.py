"""Stores that are damaged, full, or too new: mended, or refused by a message that helps."""

import json
import multiprocessing
import os
import subprocess
import time
import warnings
from contextlib import contextmanager, suppress
from pathlib import Path
from threading import current_thread, main_thread

import numpy as np
import pytest
import xarray as xr

import flexband as fb
from flexband.execution import growing
from flexband.execution.journal import Finished, Journal
from tests.execution.responses import true_response, wrong

INPUTS = {"a": fb.Interval(1.0, 2.0), "b": fb.Normal(0.0, 1.0)}
LHS = fb.LHSScanning(10, 4)
TIMES = np.linspace(0.0, 1.0, 2)


def with_labels(a, b):
    """Return two times; some runs are not finite."""
    values = np.where(wrong(a, b)[:, None], np.nan, true_response(a, b))
    coords = {"time": TIMES, "name": ("time", ["first", "second"])}
    return xr.DataArray(values, dims=("sample", "time"), coords=coords)


def study(folder, response=with_labels, **options):
    return fb.propagate(response, INPUTS, LHS, store=folder, failed="skip", **options)


@pytest.fixture(scope="module")
def stored_study(tmp_path_factory):
    folder = tmp_path_factory.mktemp("finished")
    return folder, study(folder)


@pytest.fixture
def store_copy(stored_study, tmp_path):
    folder = tmp_path / "copy"
    subprocess.run(["cp", "-r", stored_study[0], folder], check=True)
    return folder


def calls_of(folder, **options):
    """Return the bands and how many runs were made."""
    batch_sizes = []

    def counting(a, b):
        batch_sizes.append(len(a))
        return with_labels(a, b)

    bands = study(fb.execution.Store(folder, allow_mismatch=True), counting, **options)
    return bands, sum(batch_sizes)


def truncate(file):
    file.write_bytes(file.read_bytes()[:-5])


def flip(file):
    data = bytearray(file.read_bytes())
    data[len(data) // 2] ^= 8
    file.write_bytes(data)


def remove(file):
    file.unlink()


GROWING = ("inputs", "setting", "status", "reason", "seconds", "finished", "session", "outputs")


@pytest.mark.parametrize("damage", [flip, remove])
@pytest.mark.parametrize("name", GROWING)
def test_runs_of_a_damaged_chunk_run_again(name, damage, store_copy, stored_study):
    file = next((store_copy / "runs.zarr" / name).glob("c*"))
    damage(file)
    with pytest.warns(fb.errors.FlexbandWarning, match="40 runs are damaged in"):
        bands, run_count = calls_of(store_copy)
    xr.testing.assert_identical(bands["mean"], stored_study[1]["mean"])
    assert run_count >= 40
    runs = fb.execution.open_runs(store_copy)
    assert len(runs.run) == 80
    assert (runs.status[40:] == fb.execution.open_runs(stored_study[0]).status).all()
    second, run_count = calls_of(store_copy)
    xr.testing.assert_identical(second["mean"], bands["mean"])
    assert run_count <= 2


@pytest.mark.parametrize("damage", [truncate, flip])
@pytest.mark.parametrize("name", ["input/c.0", "time/c.0", "name/c.0", "zarr.json"])
def test_what_cannot_be_run_again_is_there_twice(name, damage, store_copy, stored_study):
    damage(store_copy / "runs.zarr" / name)
    bands, run_count = calls_of(store_copy)
    assert run_count == 2  # those that a resume makes
    xr.testing.assert_identical(bands["mean"], stored_study[1]["mean"])
    assert (
        fb.execution.open_runs(store_copy)
        .load()
        .equals(fb.execution.open_runs(stored_study[0]).load())
    )


@pytest.mark.parametrize("damage", [truncate, flip, remove])
def test_both_copies_damaged_are_refused(damage, store_copy):
    for name in ("zarr.json", "zarr.json.copy"):
        damage(store_copy / "runs.zarr" / name)
    content = {f: f.read_bytes() for f in store_copy.rglob("*") if f.is_file()}
    with pytest.raises(fb.errors.StoreError, match="and its copy are missing or damaged"):
        study(store_copy)
    assert {f: f.read_bytes() for f in store_copy.rglob("*") if f.is_file()} == content


def test_a_kill_while_damage_is_mended_gives_no_run_another_value(store_copy, monkeypatch):
    flip(store_copy / "runs.zarr" / "outputs" / "c.0.0")
    write = growing.write_synced
    remaining = [0]

    def stopping(files):
        if current_thread() is main_thread():
            remaining[0] -= 1
            if remaining[0] < 0:
                raise KeyboardInterrupt
        write(files)

    monkeypatch.setattr(growing, "write_synced", stopping)
    for count in range(1, 20):
        remaining[0] = count
        with warnings.catch_warnings(), suppress(KeyboardInterrupt):
            warnings.simplefilter("ignore")
            study(store_copy)
            break
    assert count > 5
    with fb.execution.open_runs(store_copy) as runs:
        successes = runs.sel(run=runs.status == 1).load()
    np.testing.assert_array_equal(successes.outputs, with_labels(*successes.inputs.values.T))


def unfinished(folder):
    """Return the journal of a study that was killed before its runs were in the arrays."""
    process = CONTEXT.Process(target=killed_before_writing, args=(folder,))
    process.start()
    process.join()
    assert process.exitcode == 9
    return next((Path(folder) / "runs.zarr").glob("journal-*"))


def killed_before_writing(folder):
    from flexband.execution import record  # noqa: PLC0415

    record.RunRecorder.period = 1e9

    def response(a, b):
        if np.any(wrong(a, b, 0.0) & (a > 1.99)):
            os._exit(9)
        return true_response(a, b)

    fb.propagate(response, INPUTS, LHS, store=folder, batch=4)


CONTEXT = multiprocessing.get_context("forkserver")
CONTEXT.set_forkserver_preload(["flexband.uncertainty.propagate", "flexband.execution.record"])


def end_early(data):
    return data[:-3]


def flip_early(data):
    return data[:70] + bytes([data[70] ^ 1]) + data[71:]


def flip_length(data):
    return bytes([data[0] ^ 4]) + data[1:]


def zeros_at_end(data):
    return data + bytes(4096)


@pytest.mark.parametrize(
    ("damage", "intact_count"),
    [(bytes, 28), (end_early, 24), (flip_early, 24), (flip_length, 0), (zeros_at_end, 28)],
)
def test_a_damaged_journal_keeps_what_is_whole(damage, intact_count, tmp_path):
    file = unfinished(tmp_path)
    assert len(fb.execution.open_runs(tmp_path).run) == 0
    file.write_bytes(damage(file.read_bytes()))
    samples = []

    def response(a, b):
        samples.extend(a)
        return true_response(a, b)

    bands = fb.propagate(
        response, INPUTS, LHS, store=fb.execution.Store(tmp_path, allow_mismatch=True), batch=4
    )
    np.testing.assert_array_equal(bands["mean"], fb.propagate(true_response, INPUTS, LHS)["mean"])
    runs = fb.execution.open_runs(tmp_path)
    assert len(runs.run) == 40
    extra_runs = 2 if intact_count else 1
    assert len(samples) == 40 - intact_count + extra_runs
    np.testing.assert_array_equal(runs.outputs, true_response(*runs.inputs.values.T))


@pytest.mark.parametrize("damage", [truncate, flip, remove])
def test_both_copies_of_a_coordinate_damaged_are_refused(damage, store_copy):
    for name in ("time/c.0", "time/copy"):
        damage(store_copy / "runs.zarr" / name)
    with pytest.raises(fb.errors.StoreError, match=r"time/c\.0 is missing or damaged"):
        study(store_copy)


def test_a_newer_store_is_refused(store_copy):
    file = store_copy / "runs.zarr" / "zarr.json"
    metadata = json.loads(file.read_text())
    metadata["attributes"]["format"] = growing.FORMAT + 1
    file.write_text(json.dumps(metadata))
    with pytest.raises(fb.errors.StoreError, match="newer version of flexband"):
        study(store_copy)


def test_a_folder_that_cannot_be_written_to_is_refused(tmp_path):
    (tmp_path / "file").write_text("mine")
    for folder in (tmp_path / "file", tmp_path / "file" / "below", Path("/proc/flexband")):
        with pytest.raises(fb.errors.StoreError, match="must be a folder to write to"):
            study(folder)
    assert (tmp_path / "file").read_text() == "mine"
    with pytest.raises(fb.errors.StoreError, match="there are none"):
        fb.execution.open_runs(tmp_path)


def test_a_clock_that_goes_backwards_changes_nothing(tmp_path, stored_study, monkeypatch):
    clock = iter(np.linspace(2e9, 1e9, 10_000))
    monkeypatch.setattr(time, "time", lambda: float(next(clock)))
    bands = study(tmp_path, batch=3)
    xr.testing.assert_identical(bands["mean"], stored_study[1]["mean"])
    assert study(tmp_path)["mean"].equals(bands["mean"])
    assert (np.diff(fb.execution.open_runs(tmp_path).finished) <= 0).all()


@contextmanager
def small_disk(folder, size):
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(folder)]
    if subprocess.run(mount, check=False, capture_output=True).returncode:
        pytest.skip("a small disk cannot be mounted")
    try:
        yield
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


def wide(a, b):
    return (a * b)[:, None] * np.linspace(1.0, 2.0, 2000)


def test_a_full_disk_costs_no_results(tmp_path):
    folder = tmp_path / "disk"
    exact = fb.propagate(wide, INPUTS, LHS)
    with small_disk(folder, "700k"):
        with pytest.warns(fb.errors.FlexbandWarning) as records:
            bands = fb.propagate(wide, INPUTS, LHS, store=folder, batch=4)
        xr.testing.assert_equal(bands["mean"], exact["mean"])
        texts = [str(entry.message) for entry in records]
        assert "No space left on device" in texts[0]
        assert "runs could not be recorded" in texts[-1]
        with fb.execution.open_runs(folder) as runs:
            runs.load()
        assert (
            len(runs.run)
            + sum(len(entry.inputs) for entry in Journal(folder / "runs.zarr").read(len(runs.run)))
            > 0
        )
        np.testing.assert_array_equal(runs.outputs, wide(*runs.inputs.values.T))
        subprocess.run(["mount", "-o", "remount,size=20m", str(folder)], check=True)
        second = fb.propagate(wide, INPUTS, LHS, store=folder, batch=4)
        xr.testing.assert_equal(second["mean"], exact["mean"])
        with fb.execution.open_runs(folder) as runs:
            assert len(runs.run) == 40
            np.testing.assert_array_equal(runs.outputs, wide(*runs.inputs.values.T))


@pytest.mark.parametrize("end", [OSError("the disk is gone"), RuntimeError("a defect")])
@pytest.mark.parametrize("every_time", [False, True])
def test_a_journal_that_cannot_be_closed_stops_no_study(end, every_time, tmp_path, monkeypatch):
    """It waited for ever as soon as many runs waited to be written."""
    rotate = Journal.rotate
    calls = []

    def failing_rotate(journal):
        if current_thread() is not main_thread():
            calls.append(1)
            if every_time or len(calls) == 1:
                raise end
        return rotate(journal)

    monkeypatch.setattr(Journal, "rotate", failing_rotate)
    monkeypatch.setattr("flexband.execution.record.RunRecorder.most_waiting", 1e3)  # bytes
    exact = fb.propagate(wide, INPUTS, LHS)
    with pytest.warns(fb.errors.FlexbandWarning) as records:
        bands = fb.propagate(wide, INPUTS, LHS, store=tmp_path, batch=4)
    texts = " ".join(str(entry.message) for entry in records)
    assert str(end) in texts
    assert ("could not be recorded" in texts) == (every_time or isinstance(end, RuntimeError))
    xr.testing.assert_equal(bands["mean"], exact["mean"])
    monkeypatch.undo()
    second = fb.propagate(wide, INPUTS, LHS, store=tmp_path, batch=4)  # the journal has all runs
    xr.testing.assert_equal(second["mean"], exact["mean"])
    assert fb.execution.open_runs(tmp_path).sizes["run"] == 40


@pytest.mark.parametrize("seed", range(2))
def test_a_disk_that_is_full_at_times_loses_nothing(seed, tmp_path, monkeypatch):
    random = np.random.default_rng(seed)
    write = growing.write_synced
    append = Journal.append

    def writing(files):
        if random.random() < 0.5:
            raise OSError(28, "No space left on device")
        write(files)

    def appending(self, *args, **options):
        if random.random() < 0.5:
            raise OSError(28, "No space left on device")
        append(self, *args, **options)

    def progress(done, total):
        if done == 4:
            monkeypatch.setattr(growing, "write_synced", writing)
            monkeypatch.setattr(Journal, "append", appending)
            monkeypatch.setattr("flexband.execution.record.RunRecorder.period", 0.002)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fb.errors.FlexbandWarning)
        bands = fb.propagate(delay, INPUTS, LHS, store=tmp_path, batch=4, progress=progress)
    monkeypatch.undo()
    np.testing.assert_array_equal(bands["mean"], fb.propagate(true_response, INPUTS, LHS)["mean"])
    fb.propagate(delay, INPUTS, LHS, store=tmp_path)
    runs = fb.execution.open_runs(tmp_path)
    assert len(runs.run) == 40
    np.testing.assert_array_equal(runs.outputs, true_response(*runs.inputs.values.T))


def delay(a, b):
    time.sleep(0.005)
    return true_response(a, b)


def test_a_record_of_which_a_part_was_written_is_cut(tmp_path, monkeypatch):
    """What follows a record that a full disk has cut short could not be read."""
    journal = Journal(tmp_path)
    folder = tmp_path

    def finished_run(k):
        return Finished(f"s{k}", np.full((2, 1), k), np.full((2, 3), k), "", 0.1, 1e9)

    journal.append(0, finished_run(0.0), sync=False)
    stream = journal._file

    class Full:
        """A file on a disk that has room for some bytes only."""

        room = 40

        def write(self, data):
            part = bytes(data)[: self.room]
            if not part:
                raise OSError(28, "No space left on device")
            self.room -= len(part)
            return stream.write(part)

        def __getattr__(self, name):
            return getattr(stream, name)

    monkeypatch.setattr(journal, "_file", Full())
    with pytest.raises(OSError, match="No space left"):
        journal.append(2, finished_run(1.0), sync=False)
    monkeypatch.setattr(journal, "_file", stream)
    journal.append(2, finished_run(2.0), sync=False)
    assert [record.setting for record in Journal(folder).read(0)] == ["s0.0", "s2.0"]
    journal.rotate()
