"""Tolerances that come in grades, with a cost each."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from flexband.basics.arguments import frozen
from flexband.basics.checks import check_instance, check_numbers, check_option, check_positive
from flexband.basics.words import value_text
from flexband.errors import InputError

SIZES = (3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500)
"""Nominal sizes [mm] up to which a row of the standard holds."""

ISO_286 = {
    "IT5": (4, 5, 6, 8, 9, 11, 13, 15, 18, 20, 23, 25, 27),
    "IT6": (6, 8, 9, 11, 13, 16, 19, 22, 25, 29, 32, 36, 40),
    "IT7": (10, 12, 15, 18, 21, 25, 30, 35, 40, 46, 52, 57, 63),
    "IT8": (14, 18, 22, 27, 33, 39, 46, 54, 63, 72, 81, 89, 97),
    "IT9": (25, 30, 36, 43, 52, 62, 74, 87, 100, 115, 130, 140, 155),
    "IT10": (40, 48, 58, 70, 84, 100, 120, 140, 160, 185, 210, 230, 250),
    "IT11": (60, 75, 90, 110, 130, 160, 190, 220, 250, 290, 320, 360, 400),
}
"""Widths of tolerance zones [µm], ISO 286-1:2010, Table 1."""


@frozen()
class Grades:
    """Available tolerances, and their costs.

    Parameters
    ----------
    grades : name of a grade -> its tolerance (half the width of an interval, or a standard
        deviation) and its cost.

    Raises
    ------
    InputError
        If there are no grades, a tolerance is not positive, or a cost is not a finite number.
    """

    grades: Mapping[str, tuple[float, float]]

    def __post_init__(self) -> None:
        example = "a mapping from names to a tolerance and a cost"
        check_instance("Grades", self.grades, Mapping, example)
        if not self.grades:
            raise InputError("Grades must have at least one grade; got none")
        pairs = {}
        for name, pair in self.grades.items():
            tolerance, cost = check_numbers(f"Grades {value_text(name)}", pair, 2)
            pairs[str(name)] = (
                float(check_positive(f"tolerance of {name}", tolerance)),
                float(cost),
            )
        object.__setattr__(self, "grades", pairs)

    @classmethod
    def iso_286(
        cls, size: float, costs: Mapping[str, float], *, millimetre: float = 1e-3
    ) -> Grades:
        """Return grades IT5 to IT11 of a nominal size, ISO 286-1:2010.

        The tolerance is half the width of the tolerance zone.

        Parameters
        ----------
        size : nominal size in the unit of the input, up to 500 mm.
        costs : grade -> its cost.
        millimetre : a millimetre in the unit of the input: 0.001 for metres.

        Raises
        ------
        InputError
            If the size or a grade is not among those of the standard.
        """
        check_instance("costs", costs, Mapping, "a mapping from grades to costs")
        unit = float(check_positive("millimetre", check_numbers("millimetre", millimetre)))
        size_in_mm = float(check_positive("size", check_numbers("size", size))) / unit
        if size_in_mm > SIZES[-1]:
            raise InputError(f"size must be up to {SIZES[-1]} mm; got {size_in_mm:g} mm")
        row = int(np.searchsorted(SIZES, size_in_mm * (1 - 1e-12)))
        grades = {}
        for name, cost in costs.items():
            check_option("costs: a grade", name, ISO_286)
            price = float(check_numbers(f"costs: {name}", cost))
            grades[name] = (ISO_286[name][row] / 2000 * unit, price)
        return cls(grades)

    @property
    def tolerances(self) -> np.ndarray:
        """The tolerances of all grades."""
        return np.array([tolerance for tolerance, _ in self.grades.values()])

    @property
    def costs(self) -> np.ndarray:
        """The costs of all grades."""
        return np.array([cost for _, cost in self.grades.values()])

    def __call__(self, tolerance: float) -> float:
        """Return the cost of the grade whose tolerance is nearest."""
        return float(self.costs[np.abs(self.tolerances - tolerance).argmin()])

    def name(self, tolerance: float) -> str:
        """Return the name of the grade whose tolerance is nearest."""
        return list(self.grades)[np.abs(self.tolerances - tolerance).argmin()]
