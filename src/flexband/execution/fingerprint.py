"""What the values of a response depend on, as hashes: its code, what it calls, its data.

Functions and classes of the response's own package, or of the files beside it, count by their
compiled code, without docstrings, comments and line numbers. Those of other packages count by their
name, and flexband's mechanics as a whole by its code. Numbers, texts and arrays
that functions refer to count by their values. What a program may change while it runs does not
count: lists, dicts, sets, attributes, and variables that the code itself assigns, such as counters.
A store makes two of its runs again, which tells of changes there.
"""

from __future__ import annotations

import dis
import hashlib
import inspect
import sys
import sysconfig
import types
from collections.abc import Collection, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from functools import cache, partial, singledispatchmethod
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

NOT_CODE = ("__dict__", "__weakref__", "__doc__", "__module__")
NOT_CODE += ("__firstlineno__", "__static_attributes__", "__annotations__")
"""Members of a class that do not change what it computes."""

PLAIN = (type(None), bool, int, float, complex, str, bytes, np.generic, type(...), range, slice)


def fingerprint(response: object) -> str:
    """Return a hash of a response: it changes with its code and its data, not with its comments."""
    walk = _Walk(response)
    walk.visit(response)
    return walk.hash.hexdigest()[:16]


class _Walk:
    """One walk over all objects that a response consists of."""

    def __init__(self, response: Any):
        self.hash = hashlib.sha256()
        self.visited: dict[int, int] = {}
        self.objects: list[object] = []  # an object that was freed could give its number to another
        while isinstance(
            response := inspect.unwrap(response, stop=lambda f: isinstance(f, partial)), partial
        ):
            response = response.func
        self.package = str(getattr(response, "__module__", "")).partition(".")[0]

    def text(self, *words: object) -> None:
        self.hash.update("\0".join(map(str, words)).encode() + b"\1")

    def visit(self, value: Any) -> None:
        if isinstance(value, PLAIN):
            self.text(type(value).__name__, repr(value))
        elif id(value) in self.visited:
            self.text("seen", self.visited[id(value)])
        else:
            self.visited[id(value)] = len(self.visited)
            self.objects.append(value)
            self.content(value)

    @singledispatchmethod
    def content(self, instance: Any) -> None:
        """Visit the class of an object, and what does not change of its attributes."""
        if callable(function := getattr(instance, "py_func", None)):  # compiled by Numba
            self.visit(function)
            return
        self.text("object", getattr(instance, "__module__", ""), getattr(instance, "__name__", ""))
        self.visit(type(instance))
        if hasattr(instance, "identity"):
            self.visit(instance.identity)
        elif is_dataclass(instance) and instance.__dataclass_params__.frozen:  # pyright: ignore
            self.visit(tuple(getattr(instance, field.name) for field in fields(instance)))
        for name in ("__wrapped__", "pyfunc", "func"):  # of what calls a function
            if isinstance(function := getattr(instance, name, None), types.FunctionType):
                self.visit(function)

    @content.register
    def _(self, array: np.ndarray) -> None:
        self.text("array", array.dtype, array.shape)
        if array.dtype.kind != "O":
            self.hash.update(np.ascontiguousarray(array).tobytes())

    @content.register
    def _(self, array: xr.DataArray) -> None:
        self.visit((array.dims, array.values, *(c.values for c in array.coords.values())))

    @content.register(tuple)
    def sequence(self, parts: Collection[Any]) -> None:
        self.text("sequence", len(parts))
        for part in parts:
            self.visit(part)

    @content.register
    def _(self, parts: frozenset) -> None:
        self.sequence(sorted(parts, key=repr))

    @content.register
    def _(self, member: Enum) -> None:
        self.text("enum", type(member).__qualname__, member.name)
        self.visit(member.value)

    @content.register
    def _(self, changeable: list | Mapping | set) -> None:
        self.text(type(changeable).__name__)

    @content.register
    def _(self, module: types.ModuleType) -> None:
        self.text("module", module.__name__)

    @content.register
    def _(self, method: types.MethodType) -> None:
        self.visit((method.__func__, method.__self__))

    @content.register
    def _(self, call: partial) -> None:
        self.visit((call.func, call.args, *sorted(call.keywords.items())))

    @content.register
    def _(self, attribute: property) -> None:
        self.visit((attribute.fget, attribute.fset))

    @content.register
    def _(self, method: staticmethod | classmethod) -> None:
        self.visit(method.__func__)

    @content.register
    def function(self, function: types.FunctionType) -> None:
        if not self.is_user_code(function.__module__, function.__code__.co_filename):
            self.text("function", function.__module__, function.__qualname__)
            return
        self.text("function", function.__qualname__)
        self.visit((function.__defaults__, *sorted((function.__kwdefaults__ or {}).items())))
        assigned = _assigned_names(function.__code__) | _assigned_in(function.__globals__)
        for name, cell in zip(
            function.__code__.co_freevars, function.__closure__ or (), strict=True
        ):
            try:
                self.visit("assigned" if name in assigned else cell.cell_contents)
            except ValueError:  # it has no value yet
                self.text("empty")
        self.code(function.__code__)
        self.variables(function.__globals__, _names(function.__code__), assigned)

    def variables(
        self,
        variables: Mapping[str, Any],
        names: set[str],
        assigned: set[str],
        path: tuple[int, ...] = (),
    ) -> None:
        """Visit the variables of a module that code names, and those of modules among them."""
        for name in sorted((names & variables.keys()) - assigned):
            value = variables[name]
            self.text(name)
            self.visit(value)
            module = isinstance(value, types.ModuleType) and id(value) not in path
            if module and self.is_user_code(value.__name__, _file(value)):
                self.variables(vars(value), names, _assigned_in(vars(value)), (*path, id(value)))

    @content.register
    def code(self, code: types.CodeType) -> None:
        """Visit the instructions; texts that none of them loads are docstrings."""
        self.text(code.co_varnames[: code.co_argcount + code.co_kwonlyargcount], code.co_freevars)
        self.hash.update(code.co_exceptiontable)
        for step in dis.get_instructions(code):
            if step.opcode in dis.hasconst:
                self.text(step.opname)
                self.visit(step.argval)
            elif isinstance(step.argval, PLAIN):
                self.text(step.opname, step.argval)
            else:
                self.text(step.opname, step.arg)

    @content.register
    def type(self, kind: type) -> None:
        self.text("class", kind.__module__, kind.__qualname__)
        if not self.is_user_code(kind.__module__, _file(sys.modules.get(kind.__module__))):
            return
        for base in kind.__bases__:
            self.visit(base)
        members = {k: v for k, v in vars(kind).items() if k not in NOT_CODE}
        for name in sorted(name for name in members if not name.startswith("_abc")):
            self.text(name)
            self.visit(members[name])

    def is_user_code(self, module: str | None, file: str | None) -> bool:
        """Return whether a module belongs to the user's code, not to a package he installed."""
        top = str(module).partition(".")[0]
        if top == "flexband" or top in sys.builtin_module_names:
            return False
        return top == self.package or _of_user(top, file)


def modules_of_user() -> list[types.ModuleType]:
    """Return the modules that were imported from files of the user, not from installed packages."""
    tops = {name: name.partition(".")[0] for name in list(sys.modules)}
    others = ("flexband", "__main__", "__mp_main__")
    modules = [
        sys.modules[name]
        for name, top in tops.items()
        if top not in others and _of_user(top, _file(sys.modules[name]))
    ]
    return [module for module in modules if isinstance(module, types.ModuleType)]


def _of_user(top: str, file: str | None) -> bool:
    """Return whether a file, of a module or package of this name, is none that was installed."""
    if not file or top in sys.stdlib_module_names:
        return False
    parts = Path(file).parts
    if "site-packages" in parts or "dist-packages" in parts:
        return False
    return not any(str(file).startswith(folder) for folder in _installed_folders())


def _names(code: types.CodeType) -> set[str]:
    """Return all names that code looks up, in the functions inside it as well."""
    inner = (constant for constant in code.co_consts if isinstance(constant, types.CodeType))
    return set(code.co_names).union(*map(_names, inner))


def _assigned_names(code: types.CodeType) -> set[str]:
    """Return the variables outside of a function that it, or a function inside it, assigns."""
    stores = ("STORE_GLOBAL", "STORE_DEREF")
    variables = {step.argval for step in dis.get_instructions(code) if step.opname in stores}
    inner = (constant for constant in code.co_consts if isinstance(constant, types.CodeType))
    return variables.union(*map(_assigned_names, inner))


def _assigned_in(variables: Mapping[str, Any]) -> set[str]:
    """Return the variables of a module that one of its functions assigns."""
    functions = [v for v in variables.values() if isinstance(v, types.FunctionType)]
    codes = [v.__code__ for v in functions if v.__globals__ is variables]
    return {
        step.argval
        for code in codes
        if dis.opmap["STORE_GLOBAL"] in code.co_code[::2]  # of few functions
        for step in dis.get_instructions(code)
        if step.opname == "STORE_GLOBAL"
    }


@cache
def _installed_folders() -> tuple[str, ...]:
    """Return the folders of installed packages."""
    paths = sysconfig.get_paths()
    return tuple({paths[name] for name in ("stdlib", "platstdlib", "purelib", "platlib")})


def _file(module: types.ModuleType | None) -> str | None:
    return getattr(module, "__file__", None)
