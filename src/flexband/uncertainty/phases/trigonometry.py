"""Cosines and sines of many angles, computed several at once in the processor's wide registers.

The functions of the C library take one angle at a time and are most of the work of averages over ξ.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from flexband.compilation.functions import compiled

QUARTERS = (1.5707963267341256, 6.077100506303966e-11, 2.0222662487959506e-21)
"""π/2 in three parts, of which the first two have so few digits that k times them is exact."""

LARGEST = 1e6
"""Angles up to which it is."""


@partial(compiled, fastmath={"contract"})
def cos_and_sin(angles, start, cos, sin):
    """Fill the cosines and sines of `angles` − `start`, to the last digits of double precision.

    Quarter turns are taken off (Cody and Waite, Software Manual for the Elementary Functions,
    1980), and the rest, at most π/4, is put into the Taylor series.
    """
    first, second, third = QUARTERS
    max_angle = 0.0
    for q in range(len(angles)):
        max_angle = max(max_angle, abs(angles[q] - start))
    if max_angle > LARGEST:
        for q in range(len(angles)):
            angle = angles[q] - start
            cos[q] = np.cos(angle)
            sin[q] = np.sin(angle)
        return
    for q in range(len(angles)):
        x = angles[q] - start
        quarters = np.rint(x * (2 / np.pi))
        r = ((x - quarters * first) - quarters * second) - quarters * third
        z = r * r
        c = 1 - z * (1 / 182) * (1 - z * (1 / 240))
        c = 1 - z * (1 / 30) * (1 - z * (1 / 56) * (1 - z * (1 / 90) * (1 - z * (1 / 132) * c)))
        c = 1 - z * (1 / 2) * (1 - z * (1 / 12) * c)
        s = 1 - z * (1 / 110) * (1 - z * (1 / 156) * (1 - z * (1 / 210)))
        s = r * (1 - z * (1 / 6) * (1 - z * (1 / 20) * (1 - z * (1 / 42) * (1 - z * (1 / 72) * s))))
        quarter = quarters - 4 * np.floor(quarters * 0.25)
        odd = (quarter == 1) | (quarter == 3)
        x, y = (s, c) if odd else (c, s)
        cos[q] = -x if (quarter == 1) | (quarter == 2) else x
        sin[q] = -y if quarter >= 2 else y
