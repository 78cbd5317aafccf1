"""Inputs that change no output, as far as the runs of a method can prove it.

Two runs that differ in one input only, and whose values are equal, show that it has no effect
there. The design of a tensor or scanning method has such pairs at every combination of the other
inputs, which is a proof for these points.
"""

from __future__ import annotations

import dis
import inspect
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import FunctionType

import numpy as np

from flexband.basics.response import ResponseFunction
from flexband.uncertainty.inputs.inputs import Input, Interval
from flexband.uncertainty.inputs.sampling import of_normals
from flexband.uncertainty.inputs.space import Space

ROUNDING = 4 * np.finfo(float).eps
"""Relative difference of equal values: products of matrices round differently row by row."""


def never_read(response: ResponseFunction, inputs: Mapping[str, Input]) -> list[str]:
    """Return the inputs that the code of a response never reads.

    An object that wraps a function, such as one with a cache, is taken for the function; a function
    around another may read the arguments on its own, and is taken for itself.
    """
    # functions that read arguments without naming them
    watchers = {"locals", "vars", "eval", "exec", "_getframe", "currentframe"}
    inner = inspect.unwrap(response, stop=lambda function: isinstance(function, FunctionType))
    if not isinstance(inner, FunctionType):
        return []
    code = inner.__code__
    if watchers & set(code.co_names):
        return []
    arguments = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
    read = set(code.co_cellvars)
    for instruction in dis.get_instructions(code):
        name = instruction.argval
        if instruction.opname not in ("STORE_FAST", "DELETE_FAST"):
            read |= set(name) if isinstance(name, tuple) else {name}
    return [name for name in inputs if name in arguments and name not in read]


def without_effect(
    space: Space, points: tuple[np.ndarray, np.ndarray], values: np.ndarray
) -> tuple[dict[str, int], list[str]]:
    """Return the inputs that provably change no value, and others that may change none.

    The first are given with the number of their values in the runs, (runs, …) at ξ and η. It is a
    proof if there are pairs of runs at every combination of two values or more of every other
    variable. Samples have no pairs, so that random inputs are then judged together.
    """
    runs = _Runs.from_values(*points, values)
    masks = _variables(space)
    random_mask = np.arange(len(runs.codes)) < space.random_dimension
    proofs = {}
    suspects = []
    for name, input_ in space.uncertain.items():
        if isinstance(input_, Interval) and input_.lower == input_.upper:
            continue
        proof = runs.proof(masks[name])
        if proof is None and input_.random and not len(runs.pairs(masks[name])[0]):
            proof = runs.proof(random_mask)
        if proof:
            proofs[name] = len(np.unique(runs.keys[masks[name]].sum(axis=0)))
        elif proof is False:
            suspects.append(name)
    return proofs, suspects


def all_have_effects(
    space: Space, points: tuple[np.ndarray, np.ndarray], values: np.ndarray
) -> bool:
    """Return whether the first few runs, as in `without_effect`, show effects of every input."""
    first_runs = slice(64)
    runs = _Runs.from_values(points[0][first_runs], points[1][first_runs], values[first_runs])
    masks = _variables(space)
    return all(runs.differ(which) for which in masks.values() if which.any())


def probes(space: Space, names: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
    """Return ξ and η of 2 (1 + inputs) runs: pairs for each of the inputs at two random places."""
    generator = np.random.default_rng(0)
    masks = _variables(space)
    n = space.random_dimension
    m = space.interval_dimension
    points = []
    for _ in range(2):
        xi = of_normals(generator.standard_normal((2, n)), space.families)
        eta = generator.uniform(-1.0, 1.0, (2, m))
        base, auxiliary = np.concatenate([xi, eta], axis=1)
        points += [base, *(np.where(masks[name], auxiliary, base) for name in names)]
    all_points = np.stack(points)
    return all_points[:, :n], all_points[:, n:]


def _variables(space: Space) -> dict[str, np.ndarray]:
    """Return which of the variables, ξ before η, are those of each input."""
    owners = np.array(space.owners(random=True) + space.owners(random=False), dtype=str)
    return {name: owners == name for name in space.inputs}


@dataclass(frozen=True)
class _Runs:
    """Runs, of which equal values of a variable have equal codes."""

    codes: np.ndarray  # number of the value of every variable, ξ before η, (variables, runs)
    keys: np.ndarray  # the codes times random numbers, whose sums tell combinations of values apart
    random: np.ndarray  # which variables are ξ
    values: np.ndarray  # shape (runs, …)

    @staticmethod
    def from_values(xi: np.ndarray, eta: np.ndarray, values: np.ndarray) -> _Runs:
        columns = [*xi.T, *eta.T]
        codes = np.array([np.unique(c, return_inverse=True)[1] for c in columns], dtype=np.uint64)
        factors = np.random.default_rng(0).integers(2**63, size=len(codes), dtype=np.uint64)
        random = np.arange(len(codes)) < xi.shape[1]
        return _Runs(codes, codes * (2 * factors + 1)[:, None], random, values)

    def pairs(self, mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the numbers of runs that differ in these variables only: chains of pairs."""
        other_keys = self.keys[~mask].sum(axis=0)
        key = self.keys[mask].sum(axis=0)
        order = np.lexsort((key, other_keys))
        first = order[:-1]
        second = order[1:]
        pair = (other_keys[first] == other_keys[second]) & (key[first] != key[second])
        return first[pair], second[pair]

    def differ(self, mask: np.ndarray) -> bool:
        """Return whether two runs that differ in these variables only have other values."""
        pairs = self.pairs(mask)
        return len(pairs[0]) > 0 and not self._equal(*pairs)

    def proof(self, mask: np.ndarray) -> bool | None:
        """Return whether variables provably change nothing; None without pairs, or if they do."""
        first, second = self.pairs(mask)
        if not len(first) or not self._equal(first, second):
            return None
        codes = self.codes[:, first]
        keys = self.keys[:, first]
        samples = self.random & ~mask
        counts = [len(np.unique(row)) for row in codes[samples]]
        joint = len(np.unique(keys[samples].sum(axis=0)))
        if counts and set(counts) == {joint}:  # samples, which differ in all their variables
            counts = [joint]
        counts += [len(np.unique(row)) for row in codes[~mask & ~self.random]]
        places = len(np.unique(keys[~mask].sum(axis=0)))
        return min(counts, default=2) > 1 and places == math.prod(counts)

    def _equal(self, first: np.ndarray, second: np.ndarray) -> bool:
        """Return whether pairs of runs have equal values; soon, if the first ones have not."""
        begin = 0
        count = 8
        while begin < len(first):
            a, b = (self.values[runs[begin : begin + count]] for runs in (first, second))
            if np.any(np.abs(a - b) > ROUNDING * np.maximum(np.abs(a), np.abs(b))):
                return False
            begin = begin + count
            count = min(2 * count, 256)
        return True
