"""A part of the inputs: narrower intervals, less scatter, or values that are fixed."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, fields

import numpy as np

from flexband.basics.words import value_text
from flexband.errors import InputError
from flexband.uncertainty.expansions.bounds.discs import farthest
from flexband.uncertainty.expansions.families import Family
from flexband.uncertainty.expansions.substitution import (
    Substitution,
    fixed_interval,
    fixed_random,
    interval_part,
    random_part,
)
from flexband.uncertainty.inputs.choices import Chosen
from flexband.uncertainty.inputs.constants import Constant, is_number
from flexband.uncertainty.inputs.distribution import Distribution
from flexband.uncertainty.inputs.distributions.random_option import RandomOption
from flexband.uncertainty.inputs.fields.random_field import RandomField
from flexband.uncertainty.inputs.inputs import Input, Interval
from flexband.uncertainty.inputs.pbox import PBox
from flexband.uncertainty.inputs.play import FreePair
from flexband.uncertainty.inputs.space import Space
from flexband.uncertainty.inputs.unfolding import GivenInput, GivenInputs, checked_input

COVERED = 3.0
"""Standard deviations of a normal variable up to which the runs of a study count as there."""

ROUNDING = 1e-6
"""By which a new distribution may be beyond the old one."""


@dataclass(frozen=True)
class NarrowedInputs:
    """Inputs within others, and how their standard variables follow from each other."""

    space: Space  # the narrower inputs
    substitutions: Mapping[int, Substitution]  # of old variables that change, by number, η first
    # where the narrower inputs are in the old variables, three standard deviations to both sides of
    # a mean, shape (m + n,); the radius is ∞ for what does not change
    center: np.ndarray
    radius: np.ndarray
    unit: np.ndarray  # the radius of all of an old variable, shape (m + n,)
    discs: tuple[int, ...]  # those of the old variables

    def distance(self, points: np.ndarray) -> np.ndarray:
        """Return how far old η and ξ, (points, m + n), are from the part, 0 inside, (points,)."""
        excess = (farthest(points - self.center, self.discs) - self.radius) / self.unit
        return np.maximum(excess, 0.0).max(axis=1, initial=0.0)

    def points(self, old: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return new ξ and η of old η and ξ, (points, m + n), about, if they are not linear."""
        change_mask = np.isfinite(self.radius) & (self.radius > 0)
        fixed_columns = {
            k for k, substitution in self.substitutions.items() if not substitution.remains
        }
        columns = [k for k in range(old.shape[1]) if k not in fixed_columns]
        new = np.where(
            change_mask, (old - self.center) / np.where(change_mask, self.radius, 1.0), old
        )
        m = self.space.interval_dimension
        new = np.where(np.isfinite(self.radius) & ~change_mask, 0.0, new)[:, columns]
        scale_mask = change_mask[columns]
        scale_mask[:m] = False
        units = np.concatenate([np.ones(m), _units(self.space)])
        new[:, scale_mask] *= units[scale_mask]
        return new[:, m:], new[:, :m]


def part_of(space: Space, changes: GivenInputs) -> NarrowedInputs:
    """Return the part of the inputs that narrower ones span; refuse what is outside."""
    if not changes:
        raise InputError(f"narrowed needs at least one of {', '.join(space.inputs)}")
    changes = {name: float(c) if is_number(c) else c for name, c in changes.items()}
    # Start with the whole of every old variable.
    first = _numbers_of_variables(space)
    total = space.interval_dimension + space.random_dimension
    center = np.zeros(total)
    radius = np.full(total, np.inf)
    inputs = dict(space.user_inputs)
    owners = dict[str, Input]()
    substitutions = {}
    # Replace the inputs that change, and note where the new ones are in the old variables.
    for name, change in changes.items():
        old = _old(space, name)
        owner, _, parameter = name.rpartition(".")
        new = _new(name, change) if old.numeric else Constant(change)  # pyright: ignore[reportArgumentType]
        if isinstance(old, RandomField) and isinstance(new, RandomField) and new.domain is None:
            new = new.with_domain(old.domain)
        try:
            parts = _substitutions(old, new, keeps=name in space.parameters)
        except InputError as error:
            raise InputError(f"{name}: {error}") from None
        if name in space.parameters:  # it stays an interval, maybe of no width
            interval = Interval(change, change) if is_number(change) else new
            owners[owner] = owners.get(owner, space.inputs[owner]).with_parameters(
                {parameter: interval}
            )
        else:
            inputs[name] = change if is_number(change) else new
        for k, (substitution, *where) in enumerate(parts, first[name]):
            substitutions[k], (center[k], radius[k]) = substitution, where
    # A p-box whose midpoints move has another family of polynomials.
    unit = np.concatenate([np.ones(space.interval_dimension), _units(space)])
    narrower = Space({**inputs, **owners})
    for name, old in space.inputs.items():
        new = narrower.inputs[name]
        if isinstance(old, PBox) and isinstance(new, PBox) and old.family != new.family:
            substitutions[first[name]] = _between_middles(old.distribution, new.distribution)
    return NarrowedInputs(narrower, substitutions, center, radius, unit, space.discs)


def _between_middles(old_distribution: Distribution, new: Distribution) -> Substitution:
    """Return ξ of a p-box at equal probabilities with the midpoints of new parameters."""
    old, middle = old_distribution.midpoint(), new.midpoint()

    def old_xi(xi: np.ndarray) -> np.ndarray:
        score = middle.to_normal(np.ravel(middle.value(xi[:, None])))
        return np.ravel(old.standard(old.at_normal(score)))

    return random_part(old.family, middle.family, old_xi)


def _units(space: Space) -> np.ndarray:
    """Return the radius of every ξ within three standard deviations of a normal variable, (n,)."""
    ends = np.array([-COVERED, COVERED])
    return np.array([np.ptp(family.of_normal(ends)) / 2 for family in space.families])


def fix_inputs(
    space: Space, names: Collection[str]
) -> tuple[dict[int, Substitution], tuple[Family, ...]]:
    """Return the substitutions that fix inputs, and the families of the random ones that remain.

    Intervals are fixed at their midpoints, random inputs at their means, and fields at those of
    every position. Correlated inputs have to be fixed together.
    """
    first = _numbers_of_variables(space)
    substitutions = {}
    means = {name: input_.mean_or_midpoint() for name, input_ in space.uncertain.items()}
    xi, eta = space.standardize(means)
    m = space.interval_dimension
    families = space.families
    for name in names:
        input_ = space.inputs[name]
        for k in range(first[name], first[name] + input_.dimension):
            if input_.random:
                substitutions[k] = fixed_random(families[k - m], float(xi[0, k - m]))
            else:
                substitutions[k] = fixed_interval(float(eta[0, k]))
    return substitutions, tuple(
        family for k, family in enumerate(families, m) if k not in substitutions
    )


def _numbers_of_variables(space: Space) -> dict[str, int]:
    """Return the number of the first variable of every uncertain input, η first."""
    m = space.interval_dimension
    random = space.columns(random=True)
    return space.columns(random=False) | {name: m + k for name, k in random.items()}


def _old(space: Space, name: str) -> Input:
    old = space.uncertain.get(name)
    if old is None:
        uncertain = ", ".join(space.uncertain)
        raise InputError(f"{name} must be one of the uncertain inputs {uncertain}")
    if name in space.dependent_names:
        raise InputError(f"{name} cannot be narrowed, since it is correlated with others")
    if old.random and old.intervals:
        parameter_names = " and ".join(f"{name}.{parameter}" for parameter in old.intervals)
        raise InputError(
            f"{name} is narrowed by its parameters that are intervals: {parameter_names}"
        )
    return old


def _new(name: str, change: GivenInput) -> Input:
    allowed = "a number or an input of the old kind"
    new = checked_input(name, change, allowed)
    if new.intervals:
        raise InputError(f"{name} must be {allowed}; got {value_text(change)}")
    return new


Placed = tuple[Substitution, float, float]
"""A substitution, and the center and the radius of its part."""


def _substitutions(old: Input, new: Input, *, keeps: bool) -> list[Placed]:
    """Return one substitution per variable of an input; a parameter `keeps` its variable."""
    if isinstance(old, Interval | Chosen):
        return [_of_interval(old, new, keeps=keeps)]
    if isinstance(old, RandomOption):
        if not isinstance(new, Constant):
            raise InputError(f"must be one of its options; got {value_text(new)}")
        xi = float(old.standard(new.constant)[0, 0])
        return [(fixed_random(old.family, xi), xi, 0.0)]
    if isinstance(old, FreePair):
        return _of_pair(old, new)
    if isinstance(old, Distribution):
        return [_of_distribution(old, new)]
    if isinstance(old, RandomField) and isinstance(new, RandomField):
        return _of_field(old, new)
    raise InputError(f"{type(old).__name__} cannot be narrowed to {value_text(new)}")


def _of_interval(old: Interval | Chosen, new: Input, *, keeps: bool) -> Placed:
    if not isinstance(new, Constant | Interval):
        raise InputError(f"must be a number or an Interval within {old!r}; got {value_text(new)}")
    low, high = old.standard(new.value(np.array([[-1.0], [1.0]])))
    center = (low + high) / 2
    radius = (high - low) / 2
    if not (new.dimension or keeps):
        return fixed_interval(center), center, 0.0
    return interval_part(center, radius), center, radius


def _of_pair(old: FreePair, new: Input) -> list[Placed]:
    alike = type(new) is type(old) and new.with_tolerance(1.0) == old.with_tolerance(1.0)
    ratio = new.tolerance_or_std / old.size
    if not alike or ratio > 1 + ROUNDING:
        raise InputError(
            f"must be {old!r} or one of a smaller {old.size_name}; got {value_text(new)}"
        )
    return [(interval_part(0.0, ratio), 0.0, ratio)] * 2


def _of_distribution(old: Distribution, new: Input) -> Placed:
    if not isinstance(new, Constant | Distribution):
        raise InputError(
            f"must be a number or a distribution within {old!r}; got {value_text(new)}"
        )
    clause = "its 3σ range ends" if new.dimension else "it is"
    reach = np.array([-COVERED, COVERED])
    ends = new.at_normal(reach) if isinstance(new, Distribution) else new.value(reach[:, None])
    scores = old.to_normal(ends)
    if not np.all(np.abs(scores) <= COVERED + ROUNDING):
        farther = scores[np.argmax(np.abs(scores))]
        raise InputError(
            f"{new!r} is beyond the runs: {clause} at {farther:.3g} standard deviations of "
            f"{old!r}; allowed are {COVERED:g}"
        )
    low, high = np.ravel(old.standard(ends)).tolist()
    where = (low + high) / 2, (high - low) / 2
    if not new.dimension:
        return fixed_random(old.family, low), *where

    def old_xi(xi: np.ndarray) -> np.ndarray:
        return np.ravel(old.standard(np.ravel(new.value(xi[:, None]))))

    part = random_part(old.family, new.family, old_xi)
    part.matrix(1)  # refuses values that the old distribution does not have
    return part, *where


def _of_field(old: RandomField, new: RandomField) -> list[Placed]:
    before = old.std
    after = new.std
    differences = [f.name for f in fields(old) if getattr(old, f.name) != getattr(new, f.name)]
    if (
        differences != ["std"]
        or not (is_number(before) and is_number(after))
        or old.distribution != "normal"
    ):
        raise InputError(
            f"a normal RandomField can be narrowed in its std, a number; {', '.join(differences)} "
            "of the new one differ"
        )
    ratio = float(after) / float(before)
    if ratio > 1 + ROUNDING:
        raise InputError(f"std must be {before:g} or less; got {after:g}")
    part = random_part(old.family, old.family, lambda xi: ratio * xi)
    return [(part, 0.0, COVERED * ratio)] * old.dimension
