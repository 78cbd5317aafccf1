"""Checks that the parts of a surrogate from a file fit together."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from flexband.basics.words import number_of
from flexband.errors import InputError
from flexband.uncertainty.expansions.expansion import Expansion
from flexband.uncertainty.expansions.hybrid import HybridExpansion
from flexband.uncertainty.inputs.evaluation import LARGEST, check_labels
from flexband.uncertainty.surrogates.axes import axes_of
from flexband.uncertainty.surrogates.bands import VARIABLES
from flexband.uncertainty.surrogates.held_out import HeldOut
from flexband.uncertainty.surrogates.surrogate import Surrogate


def check(surrogate: Surrogate) -> None:
    """Raise `InputError` or another error if a surrogate cannot be evaluated or has no bands."""
    space = surrogate.space
    labels = surrogate.labels
    diagnostics = surrogate.diagnostics
    if not space.inputs or labels.dims[0] != "sample" or len(labels):
        raise InputError("the surrogate must have inputs, and labels without runs")
    # Check that the expansions are those of the outputs, times and inputs.
    check_labels(labels)
    dimensions = space.random_dimension, space.interval_dimension
    axes = axes_of(labels)
    outputs = math.prod(axes.shape)
    times = axes.times
    for expansion in (*surrogate.expansions, *surrogate.correction):
        _check_expansion(expansion, *dimensions, times)
        if expansion.hybrid.discs != space.discs:
            raise InputError("the discs of an expansion must be those of its inputs")
    numbers = np.concatenate([expansion.outputs for expansion in surrogate.expansions])
    if not np.array_equal(np.sort(numbers), np.arange(outputs)):
        raise InputError(
            f"the expansions must be those of {number_of(outputs, 'output')}, each once; earlier "
            "versions took outputs without a time for one: make the surrogate again"
        )
    # Check the corrections and the check runs.
    expansions = surrogate.expansions if surrogate.correction else ()
    for expansion, part in zip(expansions, surrogate.correction, strict=True):
        shapes = expansion.hybrid.coefficients.shape[1], part.hybrid.coefficients.shape[1]
        if shapes[0] != shapes[1] or not np.array_equal(expansion.outputs, part.outputs):
            raise InputError("a correction must be that of its expansions")
    verifies = False
    if surrogate.held_out is not None:
        _check_held_out(surrogate.held_out, *dimensions, outputs, times)
        verifies = surrogate.held_out.verifies
    if verifies != bool(diagnostics.attrs.get("judged_by")):
        raise InputError("verification runs must have weights")
    # Check attributes and diagnostics.
    _check_attributes(diagnostics.attrs)
    _check_attributes({} if surrogate.verification is None else surrogate.verification.attrs)
    for variable in (*labels.coords.values(), *diagnostics.variables.values()):
        _check_attributes(variable.attrs)
    if VARIABLES & set(diagnostics.variables):
        raise InputError("diagnostics must have names other than those of bands")
    sizes = {**labels.sizes, "variable": sum(dimensions)}
    for name, size in diagnostics.sizes.items():
        if sizes.get(name, size) != size or name in ("sample", "bound", "input"):
            raise InputError(f"diagnostics of the surrogate must fit its labels; got dim {name}")


def _check_expansion(expansion: Expansion, n: int, m: int, times: int) -> None:
    """Check the shapes and orders of an expansion, and its values at some points."""
    (parts,) = (v for v in vars(expansion).values() if isinstance(v, HybridExpansion))
    outputs = expansion.outputs
    beta = parts.coefficients
    if outputs.ndim != 1 or outputs.dtype.kind not in "iu" or np.any(np.diff(outputs) <= 0):
        raise InputError("outputs of an expansion must be increasing numbers")
    _check_index(parts.index, n + m)
    if beta.dtype != np.float64 or beta.ndim != 2 or len(beta) != len(parts.index):
        raise InputError("coefficients of an expansion must be one per product of polynomials")
    if np.any(np.abs(parts.orthonormal_coefficients) > LARGEST):
        raise InputError("coefficients of an expansion are too large")
    xi = np.array([np.zeros(n), np.ones(n)])
    eta = np.array([np.zeros(m), np.ones(m)])
    values = expansion.evaluate(xi, eta)
    if values.shape != (2, len(outputs), times) or not np.all(np.abs(values) <= LARGEST):
        raise InputError("values of an expansion must be finite, and those of the labels")


def _check_held_out(held_out_runs: HeldOut, n: int, m: int, outputs: int, times: int) -> None:
    runs = len(held_out_runs.missed)
    shapes = {"xi": (runs, n), "eta": (runs, m), "missed": (runs, outputs, times)}
    shapes |= {"overshoot": (outputs, times), "weight": (runs * held_out_runs.verifies,)}
    for name, shape in shapes.items():
        array = getattr(held_out_runs, name)
        if array.dtype.kind != "f" or array.shape != shape or not np.all(np.abs(array) <= LARGEST):
            raise InputError(f"{name} of check runs must be finite, of shape {shape}")
    window = np.asarray(held_out_runs.window)
    if not runs or window.shape or window.dtype.kind not in "iu" or not 0 <= window <= times:
        raise InputError("there must be check runs, and their window must be within the times")


def _check_index(index: np.ndarray, dimension: int) -> None:
    """Check the orders of polynomials, shape (terms, dimension), the constant first."""
    max_lower_terms = 10_000  # most terms below one term, unless as many are given
    max_order = 101  # that of the methods and the next one
    if index.ndim != 2 or index.shape[1] != dimension or index.dtype.kind not in "iu":
        raise InputError(
            f"orders of an expansion must be whole numbers of {number_of(dimension, 'variable')}"
        )
    if not len(index) or index.min(initial=0) < 0 or index.max(initial=0) > max_order:
        raise InputError(f"orders of an expansion must be from 0 to {max_order}")
    if index[0].any() or len(np.unique(index, axis=0)) < len(index):
        raise InputError("orders of an expansion must differ, and start with the constant")
    if np.prod(index + 1.0, axis=1).max() > max(len(index), max_lower_terms):
        raise InputError("orders of an expansion must be those of products of few variables")


def _check_attributes(attributes: Mapping[Any, Any]) -> None:
    for name, value in attributes.items():
        values = value if isinstance(value, list) else [value]
        if not isinstance(name, str) or not all(isinstance(v, str | int | float) for v in values):
            raise InputError(
                f"attribute {name!r} must be a number, a text or a list; got {value!r}"
            )
