"""Counts in messages: one helper writes them, so that none reads "1 runs"."""

import ast
import importlib
import inspect
import re
from pathlib import Path

import pytest

import flexband as fb
from flexband.basics.arguments import ArgumentError
from flexband.basics.words import all_of, are, number_of, with_article
from tests.public_names import PUBLIC

COUNTED = re.compile(
    r"^ (?:(?:new|other|more|recorded|failed|held-out|random|interval|different) )*"
    r"(?:runs|samples|points|inputs|outputs|bodies|terms|variables|values|numbers|names|times|"
    r"intervals|positions|processes|workers|sensors|elements|entries|options|combinations|orders)\b"
)
NO_COUNTS = {"kind", "sign", "name", "_count(runs)", "qmc.Sobol.MAXDIM", "m", "least", "most"}
"""What is a word before a plural, or a limit that is never one."""


def test_a_count_and_its_noun_agree():
    assert number_of(1, "new run") == "1 new run"
    assert number_of(2, "body") == "2 bodies"
    assert number_of(0, "process") == "0 processes"
    assert number_of("1", "run") == "1 run"
    assert (are(1, "point"), are(3, "point")) == ("1 point is", "3 points are")
    assert [all_of(k, "run") for k in (1, 2, 3)] == ["the only run", "both runs", "all 3 runs"]
    assert (with_article("Interval"), with_article("Normal")) == ("an Interval", "a Normal")


def counts_without_helper(file):
    """Yield the counts in f-strings whose noun is a plural, whatever the count is."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.JoinedStr):
            for value, follower in zip(node.values, node.values[1:], strict=False):
                if isinstance(value, ast.FormattedValue) and isinstance(follower, ast.Constant):
                    count = ast.unparse(value.value)
                    times = str(follower.value).startswith(" times ")
                    counts = not times and not count.isupper() and count not in NO_COUNTS
                    if counts and COUNTED.match(str(follower.value)):
                        yield f"{file.name}:{value.lineno}: {{{count}}}{follower.value}"


def test_every_count_agrees_with_its_noun():
    source = Path(fb.__file__).parent
    violations = [line for file in source.rglob("*.py") for line in counts_without_helper(file)]
    assert not violations


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: fb.Beam(youngs_moduls=1.0), "Beam has no argument 'youngs_moduls'; did you mean "),
        (lambda: fb.Force("a.end", following_=True), "did you mean 'following'"),
        (lambda: fb.Revolute("a", secnd="b"), "did you mean 'second'"),
        (lambda: fb.RigidBody.bar(lenght=1.0), "RigidBody.bar has no .* did you mean 'length'"),
        (lambda: fb.AdaptivePCCI(tolerence=0.1), "did you mean 'tolerance'"),
        (lambda: fb.Normal(1.0, sigma=0.1), "no argument 'sigma'; there are mean, std, cv"),
    ],
)
def test_a_misspelled_argument_is_told_with_the_nearest_one(make, message):
    for kind in (TypeError, fb.errors.InputError):
        with pytest.raises(kind, match=message):
            make()


def test_other_wrong_arguments_are_those_of_python():
    with pytest.raises(TypeError, match="missing"):
        fb.Revolute("a")
    assert fb.RigidBody.bar(length=1.0, height=0.1, width=0.1, density=1.0, angle=0.2).angle == 0.2


CLASSES = [
    name
    for name, value in PUBLIC.items()
    if isinstance(value, type)
    and not issubclass(value, BaseException)
    and not inspect.isabstract(value)
    and "__init__" in vars(value)
]


@pytest.mark.parametrize("name", CLASSES)
def test_every_public_class_refuses_unknown_arguments_wherever_it_is_imported_from(name):
    module = importlib.import_module(PUBLIC[name].__module__)
    with pytest.raises(ArgumentError, match=f"{name} has no argument 'nonsense'"):
        getattr(module, name)(nonsense=1)
