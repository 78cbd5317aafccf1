"""Numbers as text, as the report's scripts write them too."""

from __future__ import annotations

import math
import re
from typing import Any


def number(value: Any, digits: int = 4, scale: float = 0.0) -> str:
    """Return a number as text: 0.0123 and 12300, but 7.67e-5; "0" for rounding of a `scale`."""
    noise = 1e-12  # below this part of the largest value of a series, numbers are rounding errors
    value = float(value)
    if abs(value) <= noise * scale or not math.isfinite(value):
        return "0" if math.isfinite(value) else f"{value:g}"
    head, power = f"{value:.{digits - 1}e}".split("e")
    if -4 <= int(power) < 6:
        return f"{float(f'{head}e{power}'):.{digits + 6}g}"
    return f"{float(head):.{digits}g}e{int(power)}" if value else "0"


def digits_for(value: Any, finest: float) -> int:
    """Return how many digits of a number tell differences of a size, four at least."""
    if not finest or not value or not math.isfinite(value):
        return 4
    return min(max(4, math.ceil(math.log10(abs(float(value)) / finest)) + 1), 15)


def percent(part: float) -> str:
    """Return a part in per cent, with two digits below 100 %; of huge ones only that they are."""
    if part > (huge := 10.0):
        return f"more than {100 * huge:.0f} %"
    return f"{100 * part:.2g} %" if part < 0.995 else f"{100 * part:.0f} %"


def percent_to_tenth(part: float) -> str:
    """Return a part in per cent, with one decimal, so that parts of a whole can be added."""
    return f"{round(100 * part, 1) + 0.0:g} %"


def with_minus(text: str) -> str:
    """Return a text whose numbers and powers of ten have a minus sign, as axes have, no hyphen.

    Powers lose their zeros: 1.3e-05 is 1.3e−5.
    """
    signed = re.sub(r"(?<![\w.])-(?=[\d.])", "−", text)
    return re.sub(r"(?<![\w.-])(−?\d+(?:\.\d+)?e)([-+])0*(?=\d)", _power, signed)


def _power(match: re.Match[str]) -> str:
    return match[1] + ("−" if match[2] == "-" else "")
