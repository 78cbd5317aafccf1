"""What flexband computes is known by its code, not by its comments."""

import json
import os
import time

import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexband.basics import computation as module
from flexband.basics.computation import parse_source, source_hash

CODE = '''"""Springs."""

LIMIT = 3.0
"""Of what is small."""


def force(k, x):
    """Return the force."""
    return k * x  # Hooke
'''
COMMENTED = '''"""Springs that are linear."""

LIMIT = 3.0
"""Of what counts as small."""

# A law of 1678.
def force(k, x):
    return (
        k
        * x
    )
'''


def test_a_comment_changes_nothing_and_a_constant_does():
    assert parse_source(CODE.encode()) == parse_source(COMMENTED.encode())
    assert (
        parse_source(CODE.encode()).hash
        != parse_source(COMMENTED.replace("* x", "+ x").encode()).hash
    )


@given(st.floats(1.0, 10.0), st.floats(1.0, 10.0))
def test_any_other_number_changes_the_hash(a, b):
    codes = (CODE.replace("3.0", repr(x)).encode() for x in (a, b))
    assert (len({parse_source(code).hash for code in codes}) == 1) == (a == b)


@pytest.fixture
def package(tmp_path, monkeypatch):
    (tmp_path / "laws").mkdir()
    (tmp_path / "laws" / "springs.py").write_text(CODE, encoding="utf-8")
    monkeypatch.setattr(module, "PACKAGE", tmp_path)
    now = time.time
    monkeypatch.setattr(module.time, "time", lambda: now() + 60.0)
    monkeypatch.setattr("flexband.basics.computation.user_folder", lambda: tmp_path / "user")
    return tmp_path


def fresh_hash():
    source_hash.cache_clear()
    return source_hash("laws")


def test_hashes_are_remembered_by_time_and_size(package, monkeypatch):
    file = package / "laws" / "springs.py"
    first = fresh_hash()
    with monkeypatch.context() as patch:
        patch.setattr(module, "parse_source", None)  # nothing is parse_source again
        assert fresh_hash() == first
    time.sleep(0.05)
    file.write_text(CODE.replace("# Hooke", "# Hooke's law"), encoding="utf-8")
    assert fresh_hash() == first
    time.sleep(0.05)
    file.write_text(CODE.replace("3.0", "4.0"), encoding="utf-8")
    os.utime(file, (1e9, 1e9))
    second = fresh_hash()
    assert second != first
    assert len(json.loads((package / "user" / module.MEMORY).read_text())) == 1
    time.sleep(0.05)
    file.write_text(CODE.replace("3.0", "5.0"), encoding="utf-8")
    os.utime(file, (1e9, 1e9))  # the size and the time of modification are the same
    assert fresh_hash() not in (first, second)


def test_a_file_that_has_just_changed_is_not_remembered(package, monkeypatch):
    """Another change at once might leave its times as they are."""
    monkeypatch.setattr(module.time, "time", lambda: 0.0)
    fresh_hash()
    assert not (package / "user" / module.MEMORY).exists()


def test_hashes_do_not_depend_on_the_version_of_python():
    """Hashes of Python 3.11, 3.12 and 3.13."""
    code = b"def f(x, *a, k=1.5, **b):\n    return [f'{x}{a!r}', *a, b'1', 2j, None, ...]\n"
    assert parse_source(code).hash == "6535e5e0aba03de24b76dcff32f0699f"


@pytest.mark.parametrize("content", [b"", b"[1]", b"\xff", b'{"a": '])
def test_a_damaged_memory_is_made_again(package, content):
    first = fresh_hash()
    (package / "user" / module.MEMORY).write_bytes(content)
    assert fresh_hash() == first
