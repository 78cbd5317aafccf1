"""What a response depends on: code and data count, comments and counters do not."""

import functools
import importlib
import sys
from enum import Enum

import numpy as np
import pytest

import flexband as fb
from flexband.execution.fingerprint import fingerprint

BEFORE = """
import math
from enum import Enum
import numpy as np
import {beside}

class Mode(Enum):
    FAST = 1
    SLOW = 2

STIFFNESS = 2.0
TABLE = np.array([1.0, 2.0])
MODE = Mode.FAST
SEEN = []
calls = 0

def helper(x):
    return x * STIFFNESS

def count():
    global calls
    calls += 1

def response(a, b):
    count()
    SEEN.append(calls)
    return helper(a) + {beside}.far(b) * TABLE[0] + math.pi + MODE.value
"""
BESIDE = '''
GAIN = 3.0

def near(x):
    return x * GAIN

def far(x):
    """Return it."""
    return near(x)
'''
CHANGES = {
    "comment": (0, "def helper(x):", "# a comment\n\n\ndef helper(x):  # more", True),
    "docstring": (0, "def helper(x):\n", 'def helper(x):\n    """Return a force."""\n', True),
    "other docstring": (1, "Return it.", "Return another thing.", True),
    "unused function": (0, "def count", "def unused():\n    pass\n\n\ndef count", True),
    "counter": (0, "calls = 0", "calls = 7", True),
    "list": (0, "SEEN = []", "SEEN = [1, 2]", True),
    "code": (0, "helper(a) +", "helper(a) -", False),
    "constant": (0, "STIFFNESS = 2.0", "STIFFNESS = 2.5", False),
    "number in code": (0, "x * STIFFNESS", "x * STIFFNESS * 1.01", False),
    "array": (0, "[1.0, 2.0]", "[1.5, 2.0]", False),
    "option": (0, "Mode.FAST\n", "Mode.SLOW\n", False),
    "attribute of a module": (0, "math.pi", "math.e", False),
    "helper": (0, "return x * S", "return x + S", False),
    "module beside": (1, "x * GAIN", "x + GAIN", False),
    "constant beside": (1, "GAIN = 3.0", "GAIN = 3.5", False),
}


@pytest.fixture
def write_study(tmp_path, monkeypatch):
    """Return a function that writes and imports a study of two modules."""
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr(sys, "dont_write_bytecode", True)

    def load(texts):
        for name, text in zip(("own_study", "own_beside"), texts, strict=True):
            (tmp_path / f"{name}.py").write_text(text)
            sys.modules.pop(name, None)
        importlib.invalidate_caches()
        return importlib.import_module("own_study").response

    yield load
    for name in ("own_study", "own_beside"):
        sys.modules.pop(name, None)


TEXTS = [BEFORE.format(beside="own_beside"), BESIDE]


@pytest.mark.parametrize("change", CHANGES)
def test_what_changes_the_fingerprint(change, write_study):
    place, old, new, same = CHANGES[change]
    texts = list(TEXTS)
    assert old in texts[place]
    first_hash = fingerprint(write_study(texts))
    assert fingerprint(write_study(texts)) == first_hash
    texts[place] = texts[place].replace(old, new)
    assert (fingerprint(write_study(texts)) == first_hash) is same


def test_calls_do_not_change_the_fingerprint(write_study):
    response = write_study(TEXTS)
    first_hash = fingerprint(response)
    response(1.0, 2.0)
    assert fingerprint(response) == first_hash


def test_functions_inside_of_objects_count():
    def first(x):
        return x + 1

    def second(x):
        return x + 2

    for wrapped in (np.vectorize, functools.lru_cache, fb.models.samplewise, functools.partial):
        assert fingerprint(wrapped(first)) == fingerprint(wrapped(first))
        assert fingerprint(wrapped(first)) != fingerprint(wrapped(second))
    assert fingerprint(functools.partial(first, x=1)) != fingerprint(functools.partial(first, x=2))

    class Kind(Enum):
        A = 1
        B = 2

    def response_of(kind):
        return lambda x: x if kind is Kind.A else -x

    assert fingerprint(response_of(Kind.A)) != fingerprint(response_of(Kind.B))
    assert fingerprint(response_of(2.0)) != fingerprint(response_of(2.5))


def test_a_store_is_refused_to_another_response(write_study, tmp_path):
    inputs = {"a": fb.Interval(1.0, 2.0), "b": fb.Normal(0.0, 1.0)}
    study = functools.partial(fb.propagate, inputs=inputs, method=fb.LHSScanning(5, 3))
    folder = tmp_path / "s"
    texts = list(TEXTS)
    exact = study(write_study(texts), store=folder)
    texts[1] = BESIDE.replace("GAIN = 3.0", "GAIN = 3.5")
    with pytest.raises(fb.errors.StoreError, match="the code or the data of the response changed"):
        study(write_study(texts), store=folder)
    with pytest.raises(
        fb.errors.StoreError,
        match="allow_mismatch=True of the Store uses them; on the command line, --allow-mismatch",
    ):  # the runs disagree
        study(lambda a, b: a + 2 * b, store=folder)
    with pytest.raises(fb.errors.StoreError, match="version: '' before, 'v2' now"):
        study(write_study(TEXTS), store=fb.execution.Store(folder, version="v2"))
    study(stateful(), store=tmp_path / "t")
    with pytest.raises(fb.errors.StoreError, match="made again and the response differs"):
        study(stateful(), store=tmp_path / "t")
    np.testing.assert_array_equal(study(write_study(TEXTS), store=folder)["mean"], exact["mean"])


class Stateful:
    """What it returns depends on data that the fingerprint cannot know: a table in a dict."""

    gains = {"a": 1.0}  # noqa: RUF012

    def __call__(self, a, b):
        return self.gains["a"] * a + b


def stateful():
    Stateful.gains["a"] += 1.0
    return Stateful()
