"""The range of values: bounds over all intervals and a stated part of the random inputs."""

from __future__ import annotations

from itertools import product

import numpy as np
import xarray as xr
from scipy.sparse import csr_array, eye_array
from scipy.special import ndtri

from flexband.analysis.intervals import over_intervals, over_options
from flexband.analysis.labelled_answers import Variables, answer, expected_error
from flexband.analysis.selection import AnySurrogate, Labels
from flexband.basics.checks import check_numbers
from flexband.errors import InputError
from flexband.uncertainty.expansions.bounds.scan import lobatto
from flexband.uncertainty.expansions.expansion import join_outputs
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.expansions.polynomials import chebyshev_values
from flexband.uncertainty.inputs.distributions.random_option import RandomOption
from flexband.uncertainty.inputs.sampling import of_normals
from flexband.uncertainty.surrogates.extrapolation import warn_of_extrapolation
from flexband.uncertainty.surrogates.surrogate import Surrogate


def value_range(
    surrogate: AnySurrogate, probability: float = 0.99, *, at: Labels | None = None
) -> xr.Dataset:
    """Return the lowest and the highest values over all intervals and a part of the random inputs.

    Every random variable is between its quantiles (1 − q)/2 and (1 + q)/2, with q such that all n
    of them are with the given probability: q = probability^(1/n). So the output is in the range at
    least with this probability, whatever the values of the interval inputs are. All options of a
    `Choice` are in the box.

    Parameters
    ----------
    surrogate : what `expand` or `load_surrogate` returns. No runs are made.
    probability : of the random inputs in the box, between 0 and 1; 1 if all of them are bounded.
    at : as in `quantiles`.

    Returns
    -------
    Dataset with the dims "bound" (lower, upper) and those of the outputs: `range`, the bounds;
    `range_at`, with a further dim "input", the values of all inputs at which they are reached; and
    `expected_error` of the surrogate, if its method gives one: that of μ + kσ, with the distance k
    of the box's corners from the mean.

    Raises
    ------
    InputError
        If `surrogate` is not a surrogate, the probability is not in its range, or `at` does not
        fit.

    Examples
    --------
    >>> inputs = {"length": fb.Interval(0.8, 1.2), "play": fb.Uniform(-0.1, 0.1)}
    >>> surrogate = fb.expand(lambda length, play: length + play, inputs, fb.PCCI(1, 1))
    >>> fb.analysis.value_range(surrogate, probability=1.0)["range"].values.round(4)
    array([0.7, 1.3])
    """
    part = checked_probability(probability)
    return over_intervals(lambda case: _over_random_options(case, part), surrogate, at)


def checked_probability(probability: float) -> float:
    """Return the probability of a box; raise `InputError` if it is not above 0 and 1 at most."""
    part = float(check_numbers("probability", probability))
    if not 0 < part <= 1:
        raise InputError(f"probability must be above 0 and at most 1; got {part:g}")
    return part


def _over_random_options(surrogate: Surrogate, probability: float) -> xr.Dataset:
    """Return the range over all options that have probabilities."""
    inputs = surrogate.space.inputs.items()
    options = {name: input_.options for name, input_ in inputs if isinstance(input_, RandomOption)}
    if not options:
        return range_of(surrogate, probability)
    combinations = [
        dict(zip(options, combination, strict=True)) for combination in product(*options.values())
    ]
    return over_options(
        {
            ", ".join(map(str, option_values.values())): range_of(
                surrogate.narrowed(**option_values), probability
            )
            for option_values in combinations
        }
    )


def range_of(surrogate: Surrogate, probability: float) -> xr.Dataset:
    """Return what `value_range` does, for one combination of options."""
    space = surrogate.space
    labels = surrogate.labels
    families = space.families
    n = space.random_dimension
    m = space.interval_dimension
    if probability == 1 and not all(family.has_finite_bounds for family in families):
        raise InputError("probability must be below 1: not all random inputs are bounded; got 1")
    # Find the box of the random variables, and search it together with the intervals.
    beyond = -np.expm1(np.log(probability) / max(n, 1)) / 2
    z = float(-ndtri(max(beyond, 1e-300)))
    ends = of_normals(np.array([[-z] * n, [z] * n]), families)
    warn_of_extrapolation(space, ends, surrogate.diagnostics.attrs)
    extremes = []
    for expansion in surrogate.expansions:
        extremes += expansion.of_hybrid(_on_box(expansion.hybrid, *ends)).extremes([0.0])
    values = join_outputs(surrogate.expansions, [bounds.values for bounds in extremes], 1)
    box = join_outputs(surrogate.expansions, [bounds.places for bounds in extremes], 1).reshape(
        -1, m + n
    )
    # Return the bounds and the values of the inputs there.
    eta = box[:, :m]
    t = box[:, m:]
    inputs = space.numbers_at(ends.mean(axis=0) + t * np.ptp(ends, axis=0) / 2, eta)
    dims = ("bound", *labels.dims[1:])
    shape = (2, *labels.shape[1:])
    data: Variables = {"range": (dims, values.reshape(shape))}
    if inputs:
        stacked = np.array(list(inputs.values())).reshape(-1, *shape)
        data |= {"range_at": (("input", *dims), stacked), "input": ("input", list(inputs))}
    corner = z * n**0.5 if n else 0.0
    if (error := expected_error(surrogate, corner)) is not None:
        data["expected_error"] = dims[1:], error
    attrs = {
        "probability": probability,
        "standard_deviations": z if n else 0.0,
        "made": "a search over the interval inputs"
        + (f" and a box of the random variables: normal ones within ±{z:.4g} σ" if n > 0 else ""),
    }
    return answer(surrogate, data, {}, attrs, LONG_NAMES)


LONG_NAMES = {
    "range": "values over all intervals and the stated part of the random inputs",
    "range_at": "values of the inputs at the bounds",
    "expected_error": "error expected of the surrogate at the corners of the box",
}


def _on_box(expansion: HybridExpansion, lower: np.ndarray, upper: np.ndarray) -> HybridExpansion:
    """Return the same polynomial without random variables, in η and in t with ξ from a to b.

    That is ξ = (a + b)/2 + t (b − a)/2, where `lower` and `upper` are a and b, shape (n,).
    """
    m = expansion.interval_dimension
    index = expansion.index
    transform = eye_array(len(index), format="csr")
    for k, family in enumerate(expansion.families):
        orders = index[:, m + k]
        highest = int(orders.max(initial=0))
        t = lobatto(highest + 1)
        xi = (lower[k] + upper[k]) / 2 + t * (upper[k] - lower[k]) / 2
        matrix = np.linalg.solve(chebyshev_values(highest, t), family.values(highest, xi))
        row, col = np.nonzero(np.arange(highest + 1)[:, None] <= orders)
        new_index = index[col]
        new_index[:, m + k] = row
        index, which = np.unique(new_index, axis=0, return_inverse=True)
        entries = matrix[row, orders[col]], (which.ravel(), col)
        transform = csr_array(entries, shape=(len(index), len(orders))) @ transform
    coefficients = np.asarray(transform @ expansion.coefficients)
    return HybridExpansion((), index, coefficients, expansion.discs)
