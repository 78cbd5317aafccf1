"""Names and options of methods, derived from their classes."""

from dataclasses import dataclass

import pytest

import flexband as fb
from flexband.cli.plan import METHODS
from flexband.study.method_options import method_classes, method_options, with_options
from tests.public_names import PUBLIC


@dataclass(frozen=True)
class TwoStageLHS:
    """A method of a user."""

    runs: int = 10
    share: float | None = None
    mirrored: bool = False
    title: str = ""

    name = "two-stage LHS"

    def solve(self, space, evaluate, sigmas): ...


def test_a_new_method_needs_only_its_class():
    methods = method_classes([fb.Mechanism, TwoStageLHS, fb.PCCI, fb.propagate])
    assert methods == {"two-stage-lhs": TwoStageLHS, "pcci": fb.PCCI}
    assert method_options(methods) == {
        "runs": (int, {"two-stage-lhs": 10}),
        "share": (float, {"two-stage-lhs": None}),
        "mirrored": (bool, {"two-stage-lhs": False}),
        "random_order": (int, {"pcci": 3}),
        "interval_order": (int, {"pcci": 3}),
        "correct": (bool, {"pcci": False}),
    }


def test_an_option_of_several_methods():
    methods = method_classes([fb.LHSScanning, fb.MonteCarlo, fb.methods.PhaseResolvedPCCI])
    assert list(methods) == ["lhs-scanning", "monte-carlo", "phase-resolved-pcci"]
    assert method_options(methods)["seed"] == (int, {"lhs-scanning": 0, "monte-carlo": 0})


def test_public_methods_have_defaults():
    for method in method_classes(PUBLIC.values()).values():
        assert method() == method()


def test_options_that_are_none_are_kept():
    method = with_options(TwoStageLHS(5), {"share": 0.5, "runs": None, "mirrored": True})
    assert method == TwoStageLHS(5, 0.5, True)
    with pytest.raises(
        fb.errors.InputError, match=r"options of two-stage LHS are --runs, .*; got --seed"
    ):
        with_options(TwoStageLHS(), {"seed": 1})


def test_a_method_may_be_no_dataclass():
    class Plain:
        name = "plain"

    method = Plain()
    assert with_options(method, {"seed": None}) is method
    with pytest.raises(fb.errors.InputError, match="options of plain are none; got --seed"):
        with_options(method, {"seed": 1})


def test_commands_know_all_public_methods():
    assert method_classes(PUBLIC.values()) == METHODS
