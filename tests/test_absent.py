"""What flexband does not have: names lead to what to do instead, and the page says the same."""

from pathlib import Path

import pytest

import flexband as fb
from flexband.basics.absent import ABSENT, absent
from tests.public_names import PUBLIC

PAGE = (Path(__file__).parents[1] / "docs" / "explanation" / "absent.md").read_text()


@pytest.mark.parametrize("row", ABSENT, ids=lambda row: row.feature)
def test_the_page_has_the_row_of_each_feature(row):
    assert f"\n| {row.feature} | {row.instead} |\n" in PAGE


def test_the_page_has_no_other_row():
    rows = [line for line in PAGE.splitlines() if line.startswith("| ")]
    assert len(rows) == len(ABSENT) + 2


@pytest.mark.parametrize("name", [name for row in ABSENT for name in row.names.split()])
def test_names_that_users_try_lead_to_what_to_do_instead(name):
    with pytest.raises(AttributeError) as error:
        getattr(fb, name)
    message = str(error.value)
    assert absent(name).instead in message
    assert "did you mean" not in message


def test_no_public_name_is_said_to_be_absent():
    assert not [name for name in PUBLIC if absent(name)]


def test_other_misspellings_still_name_the_nearest():
    with pytest.raises(AttributeError, match=r"did you mean 'flexband\.Revolute'"):
        _ = fb.Revolut


@pytest.mark.parametrize("components", [(0.0, 0.0, -9.81), (0.0, -9.81, 1.0)])
def test_gravity_in_space_is_refused(components):
    with pytest.raises(fb.errors.InputError, match=r"Gravity z must be 0.*Gravity\(0, -9\.81\)"):
        fb.Gravity(*components)
