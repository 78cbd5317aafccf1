"""Files of all kinds of inputs, damaged at random: equal surrogates, or an `InputError`."""

import functools
import io
import json
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
import scipy.stats as ss
from hypothesis import given, settings
from hypothesis import strategies as st

import flexband as fb
from tests.uncertainty.surrogates.test_surrogate_files import (
    archive_of,
    members,
    npy,
    paths,
    with_digest,
    with_entry,
)

X = np.linspace(0.0, 1.0, 3)
DATA = np.random.default_rng(0).gamma(9.0, 0.1, 40)
SPRING = fb.LogNormal(fb.Interval(1.0, 1.2), cv=0.2)
KINDS = {
    "distributions": {"a": fb.Beta(2.0, 3.0), "b": ss.gamma(4.0), "c": fb.Weibull(1.0, 4.0)},
    "bounded": {"a": fb.Triangular(0.0, 1.0, 3.0), "b": fb.TruncatedNormal(1.0, 0.5, 0.2)},
    "samples": {"a": fb.Samples(DATA), "b": fb.Gumbel(1.0, 0.1), "c": 2.5},
    "p-boxes": {"a": SPRING, "b": fb.Normal(1.0, std=fb.Interval(0.1, 0.2))},
    "correlated": {"both": fb.Correlated({"a": SPRING, "b": fb.Uniform(0.0, 1.0)}, 0.5)},
    "choice": {"a": fb.Choice(1.0, 2.0), "b": fb.Interval.around(1.0, percent=5)},
    "random field": {
        "a": fb.RandomField(
            1.0, 0.1, 1.0, (0.0, 1.0), 2, correlation=fb.fields.Matern(1.5),
            distribution="lognormal", discretization=fb.fields.karhunen_loeve,
        )
    },
    "interval field": {"a": fb.IntervalField(0.9, 1.1, 1.0, (0.0, 1.0), smooth=True)},
}  # fmt: skip
VALUES = [None, True, -1, 0, 2.5, 1e300, 10**18, "Ω", "Weibull", "a", [], [[]], {}, ["a", 1.0]]


def response(**values):
    """Return the product of all inputs, of fields at three positions."""
    return np.prod([v(X) if callable(v) else v[:, None] * (1 + X) for v in values.values()], axis=0)


@functools.cache
def content_of(kind):
    """Return the bytes of the file of a surrogate."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "s.npz"
        fb.save_surrogate(fb.expand(response, KINDS[kind], fb.methods.RegressionPCCI(1)), file)
        return file.read_bytes()


def load_or_none(content, folder):
    """Return the surrogate that is loaded, or None if it is refused by the name of the file."""
    file = folder / "damaged.npz"
    file.write_bytes(content)
    try:
        return fb.load_surrogate(file)
    except fb.errors.InputError:
        return None


def damage(content, data):
    """Return a file that was cut, of which a bit was flipped, or whose members were changed."""
    parts = members(content)
    names = st.sampled_from(sorted(parts))
    action = data.draw(st.sampled_from(["cut", "flip", "drop", "swap", "number", "text"]))
    if action in ("cut", "flip"):
        place = data.draw(st.integers(0, len(content) - 1))
        bit = bytes([content[place] ^ 1 << data.draw(st.integers(0, 7))])
        return content[:place] + (bit + content[place + 1 :] if action == "flip" else b"")
    name = data.draw(names)
    second = data.draw(names)
    if action == "drop":
        del parts[name]
    elif action == "swap":
        parts[name], parts[second] = parts[second], parts[name]
    else:
        array = np.load(io.BytesIO(parts[name]))
        if array.dtype.kind == "f" and array.size:
            array.flat[data.draw(st.integers(0, array.size - 1))] *= 1 + 1e-15
        elif array.dtype.kind == "U" and array.ndim == 0:
            place = data.draw(st.integers(0, len(str(array)) - 1))
            array = np.array(str(array)[:place] + "3" + str(array)[place + 1 :])
        parts[name] = npy(array)
    return archive_of(parts)


@pytest.mark.parametrize("kind", KINDS)
def test_damaged_files_are_refused_or_equal(kind, tmp_path_factory):
    folder = tmp_path_factory.mktemp("damaged")
    content = content_of(kind)

    @settings(max_examples=6, deadline=None, database=None)
    @given(st.data())
    def check(data):
        surrogate = load_or_none(damage(content, data), folder)
        if surrogate is not None:
            fb.save_surrogate(surrogate, folder / "again.npz")
            assert members((folder / "again.npz").read_bytes()) == members(content)

    check()


@pytest.mark.parametrize("kind", KINDS)
def test_files_with_other_inputs_are_refused_or_can_be_evaluated(kind, tmp_path_factory):
    """Entries of the record are replaced on purpose, with a digest that is right."""
    folder = tmp_path_factory.mktemp("changed")
    parts = members(content_of(kind))
    about = json.loads(str(np.load(io.BytesIO(parts["about.npy"]))))
    places = [path for path in paths(about) if {"inputs", "given"} & set(path)]

    @settings(max_examples=6, deadline=None, database=None)
    @given(st.sampled_from(places), st.sampled_from(VALUES))
    def check(place, value):
        record = npy(np.array(json.dumps(with_entry(about, place, value))))
        surrogate = load_or_none(with_digest(parts | {"about.npy": record}), folder)
        for expansion in getattr(surrogate, "surrogates", {"": surrogate}).values():
            if expansion is not None:
                n = expansion.space.random_dimension
                m = expansion.space.interval_dimension
                assert np.isfinite(expansion.standard(np.zeros((1, n)), np.zeros((1, m)))).all()

    check()


def test_a_new_process_loads_all_kinds(tmp_path):
    """The modules of inputs are imported when they are needed."""
    for kind in KINDS:
        (tmp_path / f"{kind}.npz").write_bytes(content_of(kind))
    code = "import sys, flexband as fb\nfor file in sys.argv[1:]: fb.load_surrogate(file)"
    subprocess.run([sys.executable, "-c", code, *map(str, tmp_path.iterdir())], check=True)
