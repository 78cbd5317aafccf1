from pathlib import Path

import pytest

import flexband as fb
from flexband import errors


def test_a_warning_points_to_the_line_of_the_user():
    with pytest.warns(fb.FlexbandWarning, match="implausible") as found:
        errors.warn("an implausible number")
    assert Path(found[0].filename) == Path(__file__)
