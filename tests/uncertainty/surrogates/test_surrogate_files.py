"""Files of surrogates: what is damaged or made to do harm is refused."""

import io
import json
import tracemalloc
import zipfile
from contextlib import suppress
from functools import cache

import numpy as np
import pytest
import xarray as xr

import flexband as fb
from flexband.uncertainty.surrogates import archive

TIMES = np.linspace(0.0, 1.0, 64)
METHODS = {
    "plain": fb.ImprovedPCCI(2, 1),
    "phases": fb.methods.PhaseResolvedPCCI(1, 1),
    "adaptive": fb.AdaptivePCCI(1e-3, max_runs=24),
}


def ringing(x, e, f):
    a = f(np.array([0.0, 0.5])).sum(axis=1)[:, None]
    u = np.cos(2 * np.pi * (8 + 0.2 * (x + e))[:, None] * TIMES)
    return xr.DataArray(
        np.stack([u, a + 0 * u], axis=1),
        dims=("sample", "output", "time"),
        coords={
            "output": ["u", "ü"],
            "unit": ("output", ["m", "N"]),
            "time": ("time", TIMES, {"units": "s"}),
        },
        attrs={"source": object()},
    )


INPUTS = {
    "x": fb.Normal(0.0, 1.0),
    "e": fb.Interval(-1.0, 1.0),
    "f": fb.RandomField(1.0, 0.1, 2.0, domain=(0.0, 0.5), terms=1),
}


@pytest.fixture(scope="module")
def file_contents(tmp_path_factory):
    """Return the bytes of the file of each method, which loads as it was saved."""
    contents = {}
    for name, method in METHODS.items():
        surrogate = fb.expand(ringing, INPUTS, method)
        file = tmp_path_factory.mktemp("saved") / "s.npz"
        fb.save_surrogate(surrogate, file)
        xr.testing.assert_identical(fb.load_surrogate(file).bands(), surrogate.bands())
        contents[name] = file.read_bytes()
    return contents


def members(content):
    with zipfile.ZipFile(io.BytesIO(content)) as container:
        return {name: container.read(name) for name in container.namelist()}


def archive_of(parts, compression=zipfile.ZIP_STORED):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", compression) as container:
        for name, content in parts.items():
            container.writestr(name, content)
    return buffer.getvalue()


def with_digest(parts):
    """Return a file with a digest that is right, as harm would be done on purpose."""
    with suppress(Exception):  # arrays that cannot be read
        arrays = {name: load_array(content) for name, content in parts.items()}
        arrays = {name.removesuffix(".npy"): array for name, array in arrays.items()}
        arrays.pop(archive.DIGEST, None)
        parts = parts | {f"{archive.DIGEST}.npy": npy(np.array(archive.digest(arrays)))}
    return archive_of(parts)


@cache
def load_array(content):
    return np.load(io.BytesIO(content))


def npy(array):
    buffer = io.BytesIO()
    np.save(buffer, array)
    return buffer.getvalue()


def check_refusal(file, content, text=r"\.npz"):
    """Load a file that must be refused, by name."""
    file.write_bytes(content)
    with pytest.raises(fb.errors.InputError, match=text) as error:
        fb.load_surrogate(file)
    assert str(file) in str(error.value)


@pytest.mark.parametrize("kind", METHODS)
def test_a_file_that_is_cut_or_changed_is_refused(kind, file_contents, tmp_path):
    content = file_contents[kind]
    file = tmp_path / "s.npz"
    for end in range(0, len(content) - 1, len(content) // 20):
        check_refusal(file, content[:end])
    with zipfile.ZipFile(io.BytesIO(content)) as container:
        data = [
            (m.header_offset + 60 + len(m.filename), m.compress_size) for m in container.filelist
        ]
    for start, size in data:
        damage = bytearray(content)
        damage[start + size // 2] ^= 0x10
        check_refusal(file, bytes(damage))


def variants(array):
    """Yield arrays that may not stand in place of one."""
    if array.dtype.kind == "U":
        yield array.astype(bytes)
        yield np.full_like(array, "Chebyshev")
    else:
        yield array.astype(str)
        yield array.astype(complex)
    yield array[None]
    if array.size:
        yield np.concatenate([array, array]) if array.ndim else np.array([array, array])
    if array.dtype.kind == "f" and array.size:
        for value in (np.nan, np.inf, 1e200):
            variant = array.copy()
            variant.flat[-1] = value
            yield variant
    if array.dtype.kind in "iu" and array.size:
        for value in (-1, 10**9, 2**62):
            variant = array.astype(np.int64)
            variant.flat[-1] = value
            yield variant


@pytest.mark.parametrize("kind", METHODS)
def test_every_array_is_checked(kind, file_contents, tmp_path):
    parts = members(file_contents[kind])
    file = tmp_path / "s.npz"
    del parts["digest.npy"]
    check_refusal(file, archive_of(parts), "not as it was saved")
    for name, content in parts.items():
        check_refusal(file, with_digest({k: v for k, v in parts.items() if k != name}))
        check_refusal(file, with_digest(parts | {name: npy(np.array([{}], dtype=object))}))
        header = content[:10] + content[10:].replace(b"(", b"(99999999999, ", 1)
        check_refusal(file, with_digest(parts | {name: header[: len(content)]}))
        if name.startswith("expansions/"):
            for variant in variants(np.load(io.BytesIO(content))):
                if variant.dtype.kind == "f" and variant.size == 1 and variant.flat[0] == 1e200:
                    continue
                check_refusal(file, with_digest(parts | {name: npy(variant)}))
    check_refusal(file, with_digest(parts | {"more.npy": npy(np.zeros(3))}))


def with_entry(record, path, value):
    """Return a copy of a nested record with another value at a path."""
    copy = json.loads(json.dumps(record))
    at = copy
    for key in path[:-1]:
        at = at[key]
    at[path[-1]] = value
    return copy


def paths(record, before=()):
    """Yield the paths of all values in a nested record, but not inside attributes."""
    items = record.items() if isinstance(record, dict) else enumerate(record)
    for key, value in items:
        yield (*before, key)
        if isinstance(value, dict | list) and key != "attributes":
            yield from paths(value, (*before, key))


@pytest.fixture(scope="module")
def records(file_contents):
    """Return the record in the file of each method."""
    abouts = {kind: members(content)["about.npy"] for kind, content in file_contents.items()}
    return {kind: json.loads(str(np.load(io.BytesIO(about)))) for kind, about in abouts.items()}


def value_at(record, path):
    """Return the value at a path, or None if there is none."""
    for key in path:
        try:
            record = record[key]
        except (KeyError, IndexError, TypeError):
            return None
    return record


@pytest.mark.parametrize("kind", METHODS)
def test_every_entry_of_the_record_is_checked(kind, file_contents, records, tmp_path):
    """A changed entry is refused, or what is loaded can be evaluated.

    Files that have the same entry share the values that are tried in its place.
    """
    parts = members(file_contents[kind])
    file = tmp_path / "s.npz"
    about = records[kind]
    load_count = 0
    for number, path in enumerate(paths(about)):
        sharing = [k for k in METHODS if value_at(records[k], path) == value_at(about, path)]
        for turn, value in enumerate((None, 10**18, "Ω", []), number):
            if sharing[turn % len(sharing)] != kind:
                continue
            record = json.dumps(with_entry(about, path, value))
            file.write_bytes(with_digest(parts | {"about.npy": npy(np.array(record))}))
            try:
                surrogate = fb.load_surrogate(file)
            except fb.errors.InputError:
                continue
            load_count += 1
            space = surrogate.space
            middle = np.zeros((1, space.random_dimension)), np.zeros((1, space.interval_dimension))
            assert surrogate.standard(*middle).shape == (1, *surrogate.labels.shape[1:])
    assert load_count < 100  # means, names of outputs, units


@pytest.mark.parametrize("number", ["NaN", "Infinity", "1" * 5000])
def test_numbers_of_the_record_are_finite(number, file_contents, tmp_path):
    parts = members(file_contents["plain"])
    about = str(np.load(io.BytesIO(parts["about.npy"])))
    record = about.replace('["mean", 0.0]', f'["mean", {number}]')
    assert record != about
    check_refusal(tmp_path / "s.npz", with_digest(parts | {"about.npy": npy(np.array(record))}))


def test_the_format_has_a_version(file_contents, tmp_path):
    parts = members(file_contents["plain"])
    about = str(np.load(io.BytesIO(parts["about.npy"]))).replace('"format": 9', '"format": 5')
    content = with_digest(parts | {"about.npy": npy(np.array(about))})
    check_refusal(
        tmp_path / "s.npz", content, "the format of the surrogate is 5, not 9; save it again"
    )


def test_a_file_of_the_format_without_corrections_is_read(file_contents, tmp_path):
    parts = members(file_contents["adaptive"])
    file = tmp_path / "s.npz"
    about = str(np.load(io.BytesIO(parts["about.npy"]))).replace('"format": 9', '"format": 7')
    file.write_bytes(with_digest(parts | {"about.npy": npy(np.array(about))}))
    assert fb.load_surrogate(file).correction == ()


def test_the_polynomials_are_those_of_the_inputs(file_contents, tmp_path):
    parts = members(file_contents["plain"])
    (name,) = (name for name in parts if name.endswith("/families.npy"))
    names = np.load(io.BytesIO(parts[name]))
    families = npy(np.where(names == "Hermite", "Legendre", "Hermite"))
    text = "families of an expansion must be those of its inputs"
    check_refusal(tmp_path / "s.npz", with_digest(parts | {name: families}), text)


def test_a_small_file_cannot_fill_the_memory(file_contents, tmp_path):
    parts = members(file_contents["plain"])
    content = archive_of(parts | {"bomb.npy": npy(np.zeros(2**24))}, zipfile.ZIP_DEFLATED)
    about = str(np.load(io.BytesIO(parts["about.npy"])))
    records = [
        "[" * 100_000,
        about.replace('["nodes", null]', '["nodes", 100000]'),
        about.replace('["correlation_length", 2.0]', '["correlation_length", 1e-5]'),
    ]
    assert records[1] != about
    assert records[2] != about
    files = [content, *(with_digest(parts | {"about.npy": npy(np.array(r))}) for r in records)]
    tracemalloc.start()
    for content in files:
        check_refusal(tmp_path / "s.npz", content)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 1e8


@pytest.mark.filterwarnings("ignore:input .* changes no output:flexband.errors.FlexbandWarning")
def test_a_surrogate_that_compresses_well_is_saved_all_the_same(tmp_path, monkeypatch):
    monkeypatch.setattr(archive, "SMALL_SIZE", 2**20)
    zeros = np.zeros(2**17)
    surrogate = fb.expand(lambda x: x[:, None] * zeros, {"x": fb.Interval(0, 1)}, fb.PCCI(0, 1))
    fb.save_surrogate(surrogate, tmp_path / "s.npz")
    assert fb.load_surrogate(tmp_path / "s.npz").labels.shape == (0, len(zeros))


@pytest.mark.parametrize("file", [None, 3, b"s.npz", ["s.npz"], "\0", "s" * 5000])
def test_a_file_is_a_path(file):
    surrogate = fb.expand(lambda x: x, {"x": fb.Interval(0, 1)}, fb.PCCI(0, 1))
    for use in (fb.load_surrogate, lambda path: fb.save_surrogate(surrogate, path)):
        with pytest.raises(fb.errors.InputError, match="file must be a path"):
            use(file)
