"""Functions for compiled code, of which Numba hears only when they are compiled.

Once all machine code is on disk, nothing imports Numba, which takes longer than most studies' runs.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property
from importlib import import_module
from typing import Any


class Deferred:
    """A module that is imported when something of it is used."""

    def __init__(self, name: str):
        self._module = name

    def __getattr__(self, name: str) -> Any:
        return getattr(import_module(self._module), name)


machine_code = Deferred("flexband.compilation.machine_code")


class CompiledFunction:
    """A function that only compiled code calls.

    Attributes
    ----------
    py_func : the function, for Python.
    """

    def __init__(self, function: Callable, options: dict[str, Any]):
        self.py_func = function
        self.options = options

    @cached_property
    def dispatcher(self) -> Any:
        """What Numba compiles the function with."""
        return machine_code.dispatcher(self.py_func, self.options)

    @property
    def _numba_type_(self) -> Any:  # by which Numba knows what it meets in other functions
        return self.dispatcher._numba_type_


class Instruction:
    """A function that writes LLVM's code, for compiled functions that call it."""

    def __init__(self, function: Callable, *, constants: bool):
        self.function = function
        self.constants = constants

    @cached_property
    def _numba_type_(self) -> Any:
        return machine_code.instruction_type(self, self.function, constants=self.constants)


def compiled(function: Callable, **options: Any) -> Any:
    """Compile a function that only compiled code calls; further options are Numba's.

    Division is that of IEEE 754. It is compiled once for all constants of a type: Numba would do so
    again for each whole number.
    """
    return CompiledFunction(function, options)


def instruction(function: Callable, *, constants: bool = False) -> Any:
    """Make a function that generates LLVM code callable from compiled code.

    With `constants` it receives whole numbers that are constants in the caller as literal types.
    """
    return Instruction(function, constants=constants)
