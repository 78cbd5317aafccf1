"""Public names, whose modules are imported when a name is first used.

A package writes its names once, as the imports for type checkers below its ``if TYPE_CHECKING``. At
run time they are read from its file, so that importing the package loads nothing heavy.
"""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable
from difflib import get_close_matches
from importlib import import_module
from typing import Any

from flexband.basics.absent import absent

NAMESPACES = (
    "analysis",
    "contact",
    "errors",
    "execution",
    "fields",
    "loads",
    "methods",
    "models",
    "sections",
    "sensors",
)
"""Packages and modules of public names, beside those of the package itself."""


def lazy_names(
    package: str, file: str
) -> tuple[list[str], Callable[[str], Any], Callable[[], list[str]]]:
    """Return `__all__`, `__getattr__` and `__dir__` of a package.

    `__dir__` also has the modules that are imported from the package itself. Names from a module
    ``former_names`` are in neither list: they are found, but not offered.
    """
    origins = {
        alias.name: node.module
        for node in imports_for_types(file)
        if isinstance(node, ast.ImportFrom) and node.module
        for alias in node.names
    }

    def public_name(name: str) -> Any:
        if name not in origins:
            raise unknown_name(package, name)
        if origins[name] == package:
            return import_module(f"{package}.{name}")
        value = getattr(import_module(origins[name]), name)
        setattr(sys.modules[package], name, value)
        return value

    listed = {
        name: origin for name, origin in origins.items() if not origin.endswith(".former_names")
    }
    public = sorted(name for name, origin in listed.items() if origin != package)
    return public, public_name, lambda: sorted(listed)


def imports_for_types(file: str) -> list[ast.stmt]:
    """Return the statements below the ``if TYPE_CHECKING`` of a file, which has no other before."""
    with open(file, "rb") as source:
        statements = ast.parse(source.read()).body
    return next((node.body for node in statements if isinstance(node, ast.If)), [])


def unknown_name(package: str, name: str) -> AttributeError:
    """Return the error of a name that does not exist; it states the nearest one, wherever it is."""
    absent_feature = absent(name)
    if absent_feature:
        return AttributeError(
            f"module {package!r} has no attribute {name!r}, since flexband has no "
            f"{absent_feature.feature}. {absent_feature.instead} See docs/explanation/absent.md"
        )
    suggestions: list[str] = []
    if not name.startswith("_"):
        root = package.partition(".")[0]
        others = [root, *(f"{root}.{part}" for part in NAMESPACES)]
        places = {
            public: f"{module}.{public}"
            for module in [*others, package]
            for public in dir(import_module(module))
        }
        suggestions = [places[match] for match in get_close_matches(name, places, 1)]
    hint = f"; did you mean {suggestions[0]!r}?" if suggestions else ""
    return AttributeError(f"module {package!r} has no attribute {name!r}{hint}")
