"""The adaptive method: it finds the orders of every input and stops where they are enough."""

from __future__ import annotations

import numpy as np

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_flag, check_integer, check_numbers, check_positive
from flexband.basics.warning import warn
from flexband.basics.words import number_of
from flexband.errors import InputError, ToleranceWarning
from flexband.uncertainty.adaptive.adaptation import Adaptation, StopReason
from flexband.uncertainty.adaptive.adaptive_surrogate import (
    advice,
    orders_used,
    surrogate_of,
    what_helps,
)
from flexband.uncertainty.adaptive.nested_design import fewest_fitted
from flexband.uncertainty.adaptive.refinement.fit_correction import ExtrapolationOptions
from flexband.uncertainty.adaptive.resolution import solve_with_refinement
from flexband.uncertainty.adaptive.response_runs import MIN_HELD
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.methods.method import Evaluate, ExpansionMethod
from flexband.uncertainty.surrogates.bands import BandRecord
from flexband.uncertainty.surrogates.surrogate import Surrogate
from flexband.uncertainty.surrogates.verification_verdict import in_percent


@frozen()
class AdaptivePCCI(ExpansionMethod):
    """A sparse hybrid expansion that finds its orders by itself, and is judged by check runs.

    Every term of the expansion has one run, at a point of nested sequences that contain the ends of
    the intervals (the paper's improvement, Eq. (19), carried over). Eight further runs at generic
    points are never fitted: they tell the error of the expansion. Each further batch of runs adds
    the terms that are expected to matter most, or that explain most of this error. The method stops
    when the expected error of interval mean and error bar, relative to the error bar's mean width,
    is below the tolerance for every output, also in eight runs where the bounds are attained.
    Vibrating responses are split as by `PhaseResolvedPCCI`. See docs/explanation/phase.md.

    With many variables, as those of a random field, where that would start with more than 48 runs
    or more than the budget, few terms out of all are found by sparse regression, from 16 runs on.

    Parameters
    ----------
    tolerance : error of the bands to stop at, relative to the mean width of the error bar. If the
        step or the elements of the response are left open, it is the total error: half of it is for
        the discretization, which is refined until that is met. Given ones keep their error, which
        is estimated. Components of a tensor, as the stresses at a point, are judged
        relative to the width of the widest one; so is a component of a vector whose error bar is
        narrower than 10⁻⁴ of that of another one.
    max_runs : budget of runs that are fitted or check the fit, not of those on finer or coarser
        discretizations; it stops there, or where it has all terms up to order 20 of intervals and 8
        of random variables, and says which error it expects.
    phase_resolved : whether to look for vibration frequencies; without, and with a `Play`, values
        at fixed times are expanded.
    correct : whether the error of step and elements is corrected where finer runs show it; it is
        only estimated otherwise.

    Raises
    ------
    InputError
        Where the tolerance is not positive or the budget no whole number; in `propagate`, where the
        budget is too small or times are not equidistant. A budget is enough if it has 18 runs, or
        three runs more than there are variables. With random fields it must also be larger than
        the number of variables; the message tells what lowers this number.

    Examples
    --------
    >>> inputs = {"a": fb.Interval(0.0, 1.0), "b": fb.Normal(0.0, 1.0)}
    >>> bands = fb.propagate(lambda a, b: np.exp(a) + b, inputs, fb.AdaptivePCCI(tolerance=1e-3))
    >>> bands["mean"].values.round(2), bool(bands.attrs["expected_error"] < 1e-3)
    (array([1.  , 2.72]), True)
    """

    tolerance: float = 0.01
    max_runs: int = 200
    phase_resolved: bool = True
    correct: bool = True

    name = "adaptive PCCI"
    copies = 4.5
    copies_per_carrier = 7.5
    chooses_discretization = True
    skips_failed = True

    def __post_init__(self) -> None:
        check_positive("tolerance", check_numbers("tolerance", self.tolerance))
        if self.tolerance >= 0.5:  # hardly meant
            warn(
                f"tolerance is {self.tolerance:g} of the error bar's mean width, "
                f"{100 * self.tolerance:g} %; is it in per cent?"
            )
        for name in ("phase_resolved", "correct"):
            check_flag(name, getattr(self, name))
        object.__setattr__(self, "max_runs", check_integer("max_runs", self.max_runs, 2))

    @property
    def aimed_error(self) -> float:
        return self.tolerance

    @property
    def label(self) -> str:
        return f"{self.name} ({100 * self.tolerance:g} %)"

    def runs(self, space: Space) -> int:
        """Return the most runs it takes.

        Raises
        ------
        InputError
            Where the budget is too small for the space, or for the terms of random fields.
        """
        variables = space.interval_dimension + space.random_dimension
        min_runs = fewest_fitted(variables) + MIN_HELD
        if self.max_runs < min_runs:
            raise InputError(
                f"max_runs must be {min_runs} or more for {number_of(variables, 'variable')}; got "
                f"{self.max_runs}"
            )
        if space.advice_on_fields and self.max_runs <= variables:
            raise InputError(
                f"max_runs must be above the number of variables, {variables}, whose terms of "
                f"order 1 alone take as many runs; got {self.max_runs}{space.advice_on_fields}"
            )
        return self.max_runs

    def expand(self, space: Space, evaluate: Evaluate) -> Surrogate:
        """Return the surrogate, the errors expected of its bands, and the orders of all variables.

        `mean_expected_error` and `error_bar_expected_error` have the response's dims, `carriers`
        `trusted` and `relative_expected_error` those before the last, `orders` the dim "variable".
        The last is the error's mean over time, relative to the error bar's mean width.
        ``attrs["expected_error"]`` is the largest of all outputs: the sum of
        ``attrs["expansion_error"]`` and ``attrs["discretization_error"]``, unless that is "not
        estimated", since the response must have `refinements()` or `refined()`. Both are variables
        too, for each band. The tolerance is for the sum if the response left out its
        discretization, and for the expansion otherwise.
        ``attrs["discretization"]`` tells the step and the elements, ``attrs["step_error"]`` and
        ``attrs["elements_error"]`` what is due to each, and ``attrs["halved"]`` what was halved.
        ``attrs["runs"]`` counts ``attrs["runs_fitted"]``, ``attrs["runs_checked"]``,
        ``attrs["runs_refined"]`` on finer discretizations than that of the bands and
        ``attrs["runs_coarser"]`` on others that were tried, ``attrs["runs_repeated"]``, and those
        that found the domains of fields or looked for inputs without effect.
        ``attrs["largest_miss"]`` names the check run that the expansion misses by the most,
        ``attrs["stopped"]`` says why there were no more runs, ``attrs["stop_reason"]`` is
        tolerance-met, budget-used or orders-used, ``attrs["runs_generic"]`` how many
        check runs are at generic points. ``attrs["unconverged_output"]`` names the outputs whose
        error falls at no affordable discretization, with ``attrs["unconverged_frequency"]``,
        ``attrs["unconverged_remedies"]`` and more (`surrogates.unconverged`),
        ``attrs["not_refined"]`` tells why a finer one failed, and ``attrs["small_components"]`` the
        first outputs whose error is relative to the error bar of another component, and
        ``attrs["same_counts"]`` those that count the same at all times in all runs.
        ``attrs["carrier_frequencies"]`` are in cycles a unit of time.
        """
        budget = self.runs(space)
        corrected_above = (
            ExtrapolationOptions().threshold * self.tolerance if self.correct else np.inf
        )

        def begin(evaluate: Evaluate) -> Adaptation:
            return Adaptation(
                space,
                evaluate,
                budget,
                phase_resolved=self.phase_resolved and not space.discs,
                corrected_above=corrected_above,
            )

        course, attrs = solve_with_refinement(begin, evaluate, self.tolerance)
        stopped = StopReason(str(attrs["stopped"]))
        attrs |= {
            "advice": advice(course, stopped),
            "stop_reason": stopped.value,
            "stopped": stopped.text,
        }
        if variables_at_limit := orders_used(course):
            attrs["orders_used"] = variables_at_limit
        surrogate = surrogate_of(course).with_attrs(tolerance=self.tolerance, **attrs)
        error = BandRecord.read(surrogate.diagnostics).expected_error or 0.0
        if error > self.tolerance:
            warn(
                f"the error expected of the bands is {in_percent(error)} of the error bar's width, "
                f"above the tolerance of {100 * self.tolerance:g} %: "
                f"{what_helps(surrogate.diagnostics.attrs)}",
                ToleranceWarning,
            )
        return surrogate
