"""Former names of arguments work, and say once what replaces them."""

import warnings

import pytest

from flexband import deprecation
from flexband.arguments import ArgumentError, frozen


@frozen(renamed={"width": "breadth"})
class Plate:
    breadth: float = 1.0
    height: float = 1.0

    @classmethod
    def square(cls, breadth):
        return cls(breadth, breadth)


@pytest.fixture(autouse=True)
def _nothing_announced(monkeypatch):
    monkeypatch.setattr(deprecation, "_announced", set())


def test_a_former_name_is_passed_on_with_one_warning_at_the_callers_line():
    with pytest.warns(
        FutureWarning, match=r"Plate\(width=\) is called Plate\(breadth=\)"
    ) as caught:
        assert Plate(width=2.0) == Plate(breadth=2.0)
    assert caught[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert Plate(width=3.0, height=2.0) == Plate(3.0, 2.0)
    with pytest.warns(FutureWarning, match=r"Plate\.square"):
        assert Plate.square(width=2.0) == Plate(2.0, 2.0)


def test_both_names_are_refused():
    with pytest.raises(ArgumentError, match="no argument 'width'"):
        Plate(width=2.0, breadth=2.0)
