"""Loops for compiled functions, which compile faster than the functions of NumPy."""

from __future__ import annotations

from flexband.caching import compiled


@compiled
def fill(array, value):
    """Set all numbers of an array."""
    flat = array.reshape(-1)
    for k in range(len(flat)):
        flat[k] = value


@compiled
def copy(into, values):
    """Copy an array of one dimension into another one."""
    for k in range(len(into)):
        into[k] = values[k]


@compiled
def largest(values, first, end):
    """Return the largest of the values from `first` on and before `end`, 0 at least."""
    maximum = 0
    for k in range(first, end):
        maximum = max(maximum, values[k])
    return maximum
