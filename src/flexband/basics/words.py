"""Words of messages, tables and reports: counts with their nouns, and articles."""

from __future__ import annotations


def number_of(count: object, noun: str) -> str:
    """Return a count with its noun: "1 new run", "2 bodies", "0 processes".

    Parameters
    ----------
    count : a number, or a number as text.
    noun : in the singular, with what is before it.
    """
    return f"{count} {noun if str(count) == '1' else plural(noun)}"


def are(count: object, noun: str) -> str:
    """Return the same with its verb: "1 run is", "2 runs are"."""
    return f"{number_of(count, noun)} {'is' if str(count) == '1' else 'are'}"


def all_of(count: int, noun: str) -> str:
    """Return all of a count: "the only run", "both runs", "all 3 runs"."""
    few = {1: f"the only {noun}", 2: f"both {plural(noun)}"}
    return few.get(count, f"all {number_of(count, noun)}")


def plural(noun: str) -> str:
    """Return the plural of a noun, regular ones only."""
    if noun.endswith("y") and noun[-2] not in "aeou":
        return f"{noun[:-1]}ies"
    return f"{noun}es" if noun.endswith(("s", "x", "ch")) else f"{noun}s"


def with_article(noun: str) -> str:
    """Return a noun with its indefinite article: "a Normal", "an Interval"."""
    return f"{'an' if noun[0].lower() in 'aeiou' else 'a'} {noun}"


MAX_VALUE_LENGTH = 80
"""Characters of a value in a message."""


def value_text(value: object) -> str:
    """Return a value as text for a message, shortened if it is long."""
    text = repr(value)
    return text if len(text) <= MAX_VALUE_LENGTH else f"{text[:MAX_VALUE_LENGTH]} ..."


def number_text(value: object) -> str:
    """Return a value for a message that asks for a number; a text is called one, with a hint."""
    if not isinstance(value, str | bytes):
        return value_text(value)
    try:
        float(value)
    except ValueError:
        return f"the text {value_text(value)}"
    hint = ""
    if isinstance(value, str) and "e" in value.lower():
        hint = ". YAML reads numbers such as 1.0e-3, with point and sign; 1e-3 is a text to it"
    return f"the text {value_text(value)}; write the number without quotes{hint}"
