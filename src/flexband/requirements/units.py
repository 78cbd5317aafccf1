"""Units as texts: by which factor a number in one is a number in another.

A unit is a product of symbols with powers: ``mm``, ``kN``, ``N m``, ``m/s²``, ``N/mm``, ``deg/s``,
``1/min``. Angles count as a dimension, so that a frequency in Hz is no angular velocity in rad/s.
"""

from __future__ import annotations

import math
import re
from typing import NamedTuple

from flexband.basics.words import value_text
from flexband.errors import InputError


class Unit(NamedTuple):
    """A unit in words of the SI."""

    scale: float  # how many SI units one of it is
    powers: tuple[int, ...]  # of metre, kilogram, second, radian, ampere, kelvin


def _powers(m: int = 0, kg: int = 0, s: int = 0, rad: int = 0, A: int = 0, K: int = 0) -> tuple:
    return m, kg, s, rad, A, K


PREFIXABLE = {
    "m": Unit(1.0, _powers(m=1)),
    "g": Unit(1e-3, _powers(kg=1)),
    "s": Unit(1.0, _powers(s=1)),
    "rad": Unit(1.0, _powers(rad=1)),
    "A": Unit(1.0, _powers(A=1)),
    "K": Unit(1.0, _powers(K=1)),
    "N": Unit(1.0, _powers(m=1, kg=1, s=-2)),
    "Pa": Unit(1.0, _powers(m=-1, kg=1, s=-2)),
    "J": Unit(1.0, _powers(m=2, kg=1, s=-2)),
    "W": Unit(1.0, _powers(m=2, kg=1, s=-3)),
    "Hz": Unit(1.0, _powers(s=-1)),
    "V": Unit(1.0, _powers(m=2, kg=1, s=-3, A=-1)),
    "bar": Unit(1e5, _powers(m=-1, kg=1, s=-2)),
}
"""Units that take the prefixes of the SI."""

OTHERS = {
    "1": Unit(1.0, _powers()),
    "%": Unit(1e-2, _powers()),
    "deg": Unit(math.pi / 180, _powers(rad=1)),
    "°": Unit(math.pi / 180, _powers(rad=1)),
    "rev": Unit(2 * math.pi, _powers(rad=1)),
    "rpm": Unit(2 * math.pi / 60, _powers(rad=1, s=-1)),
    "min": Unit(60.0, _powers(s=1)),
    "h": Unit(3600.0, _powers(s=1)),
    "t": Unit(1e3, _powers(kg=1)),
}
"""Units without prefixes."""

PREFIXES = {
    "T": 1e12, "G": 1e9, "M": 1e6, "k": 1e3, "h": 1e2, "d": 1e-1, "c": 1e-2,
    "m": 1e-3, "µ": 1e-6, "μ": 1e-6, "u": 1e-6, "n": 1e-9,
}  # fmt: skip

SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-")


def unit_of(name: str, text: str) -> Unit:
    """Return the unit that a text says; raise `InputError`, with a name, if it is not known."""
    scale = 1.0
    powers = _powers()
    sign = 1
    plain = text.translate(SUPERSCRIPTS) if isinstance(text, str) else ""
    factors = [part for part in re.split(r"([·*/\s]+)", plain.strip()) if part]
    for part in factors:
        if re.fullmatch(r"[·*/\s]+", part):
            sign = -1 if "/" in part else sign  # N/m s is N/(m s)
            continue
        match = re.fullmatch(r"([^\d^-]+|1)\^?(-?\d+)?", part)
        symbol = _symbol(match[1]) if match else None
        if match is None or symbol is None:
            raise InputError(
                f"{name} must be a unit of m, kg, s, rad, N, Pa, J, W, Hz, V, A, K, bar (with "
                "prefixes), deg, rev, rpm, min, h, t, % and 1, such as 'mm' or 'kN/mm'; "
                f"got {value_text(text)}"
            )
        power = sign * int(match[2] or 1)
        scale *= symbol.scale**power
        powers = tuple(p + power * q for p, q in zip(powers, symbol.powers, strict=True))
    if not factors:
        raise InputError(f"{name} must be a unit, such as 'mm'; got {value_text(text)}")
    return Unit(scale, powers)


def _symbol(text: str) -> Unit | None:
    """Return a unit with or without a prefix; None if there is none of this name."""
    prefix = text[:1]
    rest = text[1:]
    plain = PREFIXABLE.get(text) or OTHERS.get(text)
    if plain is None and prefix in PREFIXES and rest in PREFIXABLE:
        return Unit(PREFIXES[prefix] * PREFIXABLE[rest].scale, PREFIXABLE[rest].powers)
    return plain


def factor(name: str, unit: str, into: str) -> float:
    """Return by what a number in one unit is multiplied to be one in another.

    Raise `InputError`, with a name, if one is no unit, or they have different dimensions.
    """
    first = unit_of(name, unit)
    second = unit_of(name, into)
    if first.powers != second.powers:
        raise InputError(f"{name} must be a unit for {into}; got {unit!r}")
    return first.scale / second.scale
