"""Files that are written completely or not at all."""

from concurrent.futures import ThreadPoolExecutor

import pytest

from flexband.basics.files import replace_file


def test_writers_of_one_file_do_not_mix(tmp_path):
    file = tmp_path / "deep" / "file.txt"

    def write(k):
        with replace_file(file) as partial, partial.open("w") as stream:
            for _ in range(100):
                stream.write(f"{k}\n")
                stream.flush()

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(write, range(32)))
    lines = file.read_text().splitlines()
    assert len(lines) == 100
    assert len(set(lines)) == 1
    assert list(file.parent.iterdir()) == [file]


def test_an_old_file_stays_if_the_new_one_fails(tmp_path):
    file = tmp_path / ("long" * 60 + ".txt")
    file.write_text("old")

    def interrupt():
        with replace_file(file) as partial:
            partial.write_text("new")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupt()
    assert file.read_text() == "old"
    assert list(tmp_path.iterdir()) == [file]
