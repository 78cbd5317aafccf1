"""How tolerances scatter in production: a distribution of each, within the interval of its runs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_instance, check_numbers, check_option, check_positive
from flexband.errors import InputError
from flexband.uncertainty.inputs.correlated import Correlated
from flexband.uncertainty.inputs.distribution import Distribution
from flexband.uncertainty.inputs.distributions.normal import TruncatedNormal
from flexband.uncertainty.inputs.inputs import Input, Interval
from flexband.uncertainty.inputs.play import FreePair
from flexband.uncertainty.inputs.sampling import of_normals
from flexband.uncertainty.inputs.space import Space, check_no_play

OF_SAMPLES = "tolerances_scatter"
"""Attribute of a yield that was counted in sampled parts: whether their tolerances differ."""


@frozen()
class Capability:
    """A normal process, given by Cp and Cpk; parts beyond the tolerance are sorted out.

    With the tolerance from L to U, σ = (U − L) / (6 Cp), and the mean is 3 σ Cpk from the nearer
    end (ISO 22514-2).

    Parameters
    ----------
    cp : potential capability.
    cpk : capability, `cp` unless given: the mean is then in the middle.
    side : "lower" or "upper", the end that the mean is nearer to, if `cpk` is less than `cp`.

    Raises
    ------
    InputError
        If `cp` is not positive, `cpk` is below zero or above `cp`, or `side` is missing.

    Examples
    --------
    >>> fb.analysis.Capability(cp=1.0, cpk=0.5, side="upper").within(fb.Interval(-6.0, 6.0))
    TruncatedNormal(mean=3.0, std=2.0, lower=-6.0, upper=6.0)
    """

    cp: float
    cpk: float | None = None
    side: str = ""

    def __post_init__(self) -> None:
        cp = float(check_positive("Capability cp", check_numbers("Capability cp", self.cp)))
        cpk = cp if self.cpk is None else float(check_numbers("Capability cpk", self.cpk))
        if not 0 <= cpk <= cp:
            raise InputError(f"Capability cpk must be from 0 to cp, {cp:g}; got {cpk:g}")
        if cpk < cp or self.side:
            check_option("Capability side", self.side, ("lower", "upper"))
        object.__setattr__(self, "cp", cp)
        object.__setattr__(self, "cpk", cpk)

    def __repr__(self) -> str:
        off = f", cpk={self.cpk:g}, side={self.side!r}" if self.cpk != self.cp else ""
        return f"Capability(cp={self.cp:g}{off})"

    def within(self, interval: Interval) -> TruncatedNormal:
        """Return the distribution of parts whose tolerance is an interval."""
        lower = interval.lower
        upper = interval.upper
        sigma = (upper - lower) / (6 * self.cp)
        cpk = self.cp if self.cpk is None else self.cpk
        aside = (upper - lower) / 2 - 3 * sigma * cpk
        mean = (lower + upper) / 2 + (-aside if self.side == "lower" else aside)
        return TruncatedNormal(mean, sigma, lower=lower, upper=upper)


Scatter = Mapping[str, Distribution | Capability | Correlated]
"""How each tolerance scatters, by the name of its input; correlated ones in a group of any name."""


@dataclass(frozen=True)
class ScatteringTolerances:
    """The interval variables η of a surrogate as functions of standard normal variables."""

    space: Space  # of the distributions, by the names of the tolerances
    intervals: Mapping[str, Interval]  # of the surrogate
    plays: Mapping[str, FreePair]  # of the surrogate; they scatter by themselves

    @staticmethod
    def from_scatter(scatter: Scatter, space: Space) -> ScatteringTolerances:
        """Return how all tolerances of a space scatter.

        Raise `InputError` if a name is no tolerance, a tolerance has no distribution, or a
        distribution goes beyond the interval of the runs.
        """
        check_instance("scatter", scatter, Mapping, '{"length": fb.analysis.Capability(cp=1.33)}')
        tolerances: dict[str, Interval] = {}
        for name, interval in space.of_kind(random=False).items():
            if name in space.plays:
                continue
            if type(interval) is not Interval:
                kind = type(interval).__name__
                raise InputError(f"scatter is of tolerances, each an Interval; {name} is a {kind}")
            tolerances[name] = interval
        groups = {name: _within(name, group, tolerances) for name, group in scatter.items()}
        distributions = {}
        for name, group in groups.items():
            distributions |= group.inputs if isinstance(group, Correlated) else {name: group}
        for name, distribution in distributions.items():
            check_option("a name in scatter", name, tolerances)
            _check_support(name, distribution, tolerances[name])
        if missing := [name for name in tolerances if name not in distributions]:
            raise InputError(
                f"scatter must have a distribution of every tolerance; {', '.join(missing)} "
                f"{'has' if len(missing) == 1 else 'have'} none"
            )
        return ScatteringTolerances(Space(groups), tolerances, space.plays)

    @property
    def dimension(self) -> int:
        """Number of standard normal variables."""
        return self.space.random_dimension + 2 * len(self.plays)

    def eta(self, u: np.ndarray) -> np.ndarray:
        """Return η of shape (points, m) at standard normal variables u (points, dimension)."""
        k = self.space.random_dimension
        xi = of_normals(u[:, :k], self.space.families)
        values = self.space.numbers_at(xi, np.zeros((len(u), 0)))
        columns = {
            name: np.clip(interval.standard(np.asarray(values[name])).reshape(-1, 1), -1.0, 1.0)
            for name, interval in self.intervals.items()
        }
        for first, (name, pair) in enumerate(self.plays.items()):
            columns[name] = pair.of_normals(u[:, k + 2 * first : k + 2 * first + 2])
        ordered = (columns[name] for name in sorted(columns))
        return np.concatenate([np.zeros((len(u), 0)), *ordered], axis=1)


def scattering_tolerances(scatter: Scatter | None, space: Space) -> ScatteringTolerances | None:
    """Return how tolerances scatter; None if they do not, and probabilities are bounded over them.

    Raise `InputError` as `ScatteringTolerances.from_scatter`, and if they are bounded over a disc.
    """
    if scatter is None:
        return check_no_play(space, "failure_probability without scatter")
    return ScatteringTolerances.from_scatter(scatter, space)


def _within(
    name: str, scatter: Distribution | Capability | Correlated, tolerances: Mapping[str, Interval]
) -> Distribution | Correlated:
    kinds = Distribution | Capability | Correlated
    check_instance(f"scatter[{name!r}]", scatter, kinds, "fb.Uniform(0.9, 1.1)")
    if not isinstance(scatter, Capability):
        return scatter
    check_option("a name in scatter", name, tolerances)
    return scatter.within(tolerances[name])


def _check_support(name: str, distribution: Input, interval: Interval) -> None:
    """Raise `InputError` if values beyond an interval are possible."""
    if not isinstance(distribution, Distribution) or distribution.intervals:
        raise InputError(
            f"scatter[{name!r}] must be a distribution of numbers; got {distribution!r}"
        )
    low, high = distribution.support
    slack = 1e-9 * (interval.upper - interval.lower)
    if low < interval.lower - slack or high > interval.upper + slack:
        raise InputError(
            f"scatter[{name!r}] must be within the interval that the runs cover, "
            f"{interval.lower:g} to {interval.upper:g}; got {distribution!r}, from {low:g} to "
            f"{high:g}. A study with a wider Interval covers it"
        )
