"""Scrambled Sobol' sequences.

In few variables they are made here, bit for bit as by `scipy.stats.qmc`, which takes half a second
to import. The numbers are those of Joe and Kuo, SIAM J. Sci. Comput. 30 (2008), 2635, scrambled by
Matoušek's linear matrices and a shift, J. Complexity 14 (1998), 527.
"""

from __future__ import annotations

import numpy as np
import scipy

MAX_DIMENSION = 21201
"""Of the table of Joe and Kuo that SciPy has."""

JOE_KUO = (
    (1, 0, (1,)), (2, 1, (1, 3)), (3, 1, (1, 3, 1)), (3, 2, (1, 1, 1)), (4, 1, (1, 1, 3, 3)),
    (4, 4, (1, 3, 5, 13)), (5, 2, (1, 1, 5, 5, 17)), (5, 4, (1, 1, 5, 5, 5)),
    (5, 7, (1, 1, 7, 11, 19)),
)  # fmt: skip
"""Degree, coefficients and first direction numbers of the polynomial of each variable but the first
one."""


def scrambled_sobol(count: int, dimension: int, seed: int = 0) -> np.ndarray:
    """Return the first points of a scrambled Sobol' sequence in [0, 1), (count, dimension)."""
    rng = np.random.default_rng(seed)
    if dimension > len(JOE_KUO) + 1:
        power = max(count - 1, 1).bit_length()
        return scipy.stats.qmc.Sobol(dimension, rng=rng).random_base2(power)[:count]
    rng = rng.spawn(1)[0]
    bits = 30
    places = np.arange(bits, dtype=np.uint32)
    shift = rng.integers(2, size=(dimension, bits), dtype=np.uint32) @ (1 << places)
    lower = rng.integers(2, size=(dimension, bits, bits), dtype=np.uint32)
    lower = np.tril(lower, -1) | np.eye(bits, dtype=np.uint32)
    digits = _directions(dimension, bits)[:, None] >> places[::-1, None] & 1
    directions = np.sum(lower @ digits % 2 << places[::-1, None], axis=1)
    k = np.arange(1, count)
    digit_numbers = np.log2(k & -k).astype(int)  # digit in which a Gray code changes
    steps = np.concatenate([shift[:, None], directions[:, digit_numbers]], axis=1)
    return np.bitwise_xor.accumulate(steps.astype(np.uint32), axis=1)[:, :count].T * 2.0**-bits


def _directions(dimension: int, bits: int) -> np.ndarray:
    """Return the direction numbers of all variables, shape (dimension, bits)."""
    numbers = np.ones((dimension, bits), dtype=np.uint32)
    for v, (degree, coefficients, first) in zip(numbers[1:], JOE_KUO, strict=False):
        v[:degree] = first
        for j in range(degree, bits):
            v[j] = v[j - degree] ^ v[j - degree] << degree
            for k in range(1, degree):
                v[j] ^= (coefficients >> (degree - 1 - k) & 1) * (v[j - k] << k)
    return numbers << np.arange(bits, dtype=np.uint32)[::-1]
