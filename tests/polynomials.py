"""Polynomials that several tests draw."""

import numpy as np


def drawn_polynomial(seed):
    """Return a response to two plays, an interval and a normal variable."""
    rng = np.random.default_rng(seed)
    weights = rng.normal(size=(6, 11))
    squares = rng.normal(size=(6, 6, 11))

    def response(crank, length, load, pin):
        x = np.stack([crank[0] / 0.2, crank[1] / 0.4, length, load, *pin / 0.1])
        return x.T @ weights + 0.3 * np.einsum("in,jn,ijt->nt", x, x, squares)

    return response
