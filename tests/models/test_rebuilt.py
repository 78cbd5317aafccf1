"""Scripts of Exudyn, rebuilt: the numbers agree, and with a wrong parameter they do not."""

import page
import pytest
from rebuilt import REBUILT
from scripts import all_scripts

pytestmark = [
    pytest.mark.filterwarnings("ignore::flexband.errors.StrainWarning"),
    pytest.mark.filterwarnings("ignore:joint 'drive' is prescribed by a function whose rate jumps"),
]


@pytest.mark.parametrize("case", REBUILT, ids=lambda case: case.solve.__name__)
def test_the_number_of_a_script(case):
    right, wrong = case.differences
    assert right <= case.tolerance, f"{case.numbers[0]} instead of {case.exudyn}"
    assert wrong > case.tolerance


def test_every_script_is_on_the_page():
    answers = all_scripts()
    assert len(answers) == 96
    assert not [case.script for case in REBUILT if answers[case.script][0] == "no"]
    text = page.PAGE.read_text(encoding="utf-8")
    assert page.script_table() in text
    assert not [case.quantity for case in REBUILT if case.quantity not in text]
