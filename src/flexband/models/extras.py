"""Packages that only some models need."""

from __future__ import annotations

from importlib import import_module
from typing import Any


def extra(module: str, name: str) -> Any:
    """Return a module of a package that comes with ``flexband[name]``.

    Raises
    ------
    ImportError
        If it is not installed; the message shows how to install it.
    """
    try:
        return import_module(module)
    except ImportError as error:
        package = module.split(".", maxsplit=1)[0]
        raise ImportError(
            f"the package {package!r} is needed here; install it by: pip install 'flexband[{name}]'"
        ) from error
