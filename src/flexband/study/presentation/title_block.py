"""The title block of a report that is signed: who states what, about which part."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from flexband.basics.checks import check_instance
from flexband.basics.words import value_text
from flexband.errors import InputError

FIELDS = {
    "title": "title",
    "author": "author",
    "part": "part number",
    "drawing": "drawing number",
    "revision": "revision",
    "date": "date",
    "comment": "comment",
}
"""What a title block may have, and how the report names it."""


def checked_title_block(name: str, entries: Any) -> dict[str, str]:
    """Return the fields of a title block as texts; raise `InputError` for others."""
    check_instance(name, entries, Mapping, 'names with texts, such as {"author": "A. Weber"}')
    for field, value in entries.items():
        if field not in FIELDS:
            raise InputError(f"{name} must have {', '.join(FIELDS)} alone; got {value_text(field)}")
        if isinstance(value, Mapping | list | bool):
            raise InputError(f"{name}[{field!r}] must be a text; got {value_text(value)}")
    return {field: str(entries[field]) for field in FIELDS if field in entries}


def title_block(entries: Mapping[str, str], file: Path | None) -> dict[str, str]:
    """Return the title block of a study: its own fields, others from a TOML file of its name.

    Beside ``wiper.py`` this is ``wiper.toml``. Raise `InputError` if it is no TOML, or has other
    fields.
    """
    beside = None if file is None else file.with_suffix(".toml")
    if beside is None or not beside.is_file():
        return dict(entries)
    try:
        content = tomllib.loads(beside.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"{beside} must be TOML; {error}") from None
    all_entries = checked_title_block(str(beside), content) | dict(entries)
    return {field: all_entries[field] for field in FIELDS if field in all_entries}
