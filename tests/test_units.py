"""Units as texts: factors between them, and what is refused."""

import math

import pytest

from flexband.errors import InputError
from flexband.requirements.units import factor


@pytest.mark.parametrize(
    ("unit", "into", "expected"),
    [
        ("mm", "m", 1e-3),
        ("deg", "rad", math.pi / 180),
        ("°", "mrad", 1e3 * math.pi / 180),
        ("rpm", "rad/s", math.pi / 30),
        ("rev/min", "rpm", 1.0),
        ("bar", "Pa", 1e5),
        ("mbar", "Pa", 1e2),
        ("GPa", "N/mm²", 1e3),
        ("kN/mm", "N/m", 1e6),
        ("N m", "J", 1.0),
        ("N·mm", "N m", 1e-3),
        ("m/s²", "mm/s^2", 1e3),
        ("g/cm³", "kg/m³", 1e3),
        ("kg m²", "g mm2", 1e9),
        ("1/min", "Hz", 1 / 60),
        ("%", "1", 1e-2),
        ("µm", "nm", 1e3),
        ("N m s/rad", "N mm s/deg", 1e3 * math.pi / 180),
        ("km/h", "m/s", 1 / 3.6),
    ],
)
def test_factors(unit, into, expected):
    assert factor("unit", unit, into) == pytest.approx(expected, rel=1e-14)
    assert factor("unit", into, unit) == pytest.approx(1 / expected, rel=1e-14)


@pytest.mark.parametrize(
    ("unit", "into"),
    [("mm", "rad"), ("Hz", "rad/s"), ("deg", "1"), ("N", "N m"), ("kg", "N")],
)
def test_other_dimensions_are_refused(unit, into):
    with pytest.raises(InputError, match=f"unit must be a unit for {into}; got '{unit}'"):
        factor("unit", unit, into)


@pytest.mark.parametrize("unit", ["", " ", "furlong", "mm²²", "kdeg", "m^x", "/", 3.0, None, "mmm"])
def test_what_is_no_unit_is_refused(unit):
    with pytest.raises(InputError, match="unit must be a unit"):
        factor("unit", unit, "m")
