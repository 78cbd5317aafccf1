"""Where bodies must be so that joints meet, without turning any of them.

At given angles the constraints of most joints are linear in the places of the bodies. The guess of
the user is moved by the least squares of these constraints. If they can be met so, assembly leaves
all angles as they were given; what remains, as in a loop that does not close, is left to it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from flexband.basics.user_functions import evaluate_function
from flexband.mechanics.kernels.forms import Form


def place_bodies(
    guess: Sequence[np.ndarray],
    bodies: Sequence[Sequence[Sequence[int]]],
    rows: Sequence[Form],
    *,
    iterations: int = 10,
    tolerance: float = 1e-12,
    min_singular_value: float = 1e-3,
) -> list[np.ndarray]:
    """Return the guess [1, q] with each body moved, but not turned, to where the rows vanish.

    `bodies` has the rows of the positions of each body's nodes. Singular values of the rows'
    Jacobian below a part of the largest are left to assembly, whose way is then much shorter.
    """
    # Number the places of the bodies as columns, and select the rows that depend on them.
    starts = np.cumsum([0, *(len(places[0]) for places in bodies)])
    column = {
        row: int(first) + axis
        for first, places in zip(starts, bodies, strict=False)
        for place in places
        for axis, row in enumerate(place)
    }
    rows = [row for row in rows if _is_influenced(row, column)]
    samples = _samples(guess, rows)
    if not rows or samples is None:
        return list(guess)
    z = np.stack([np.broadcast_to(np.asarray(c, dtype=float), samples) for c in guess])
    size = np.abs(z[list(column)]).max(axis=0)
    for _ in range(iterations):
        # Select the samples in which joints are still open.
        misfit = np.stack([np.broadcast_to(row.at(list(z)), samples) for row in rows])
        open_samples = np.flatnonzero(np.abs(misfit).max(axis=0) > tolerance * size)
        if not len(open_samples):
            break
        # Differentiate the rows by the places.
        jacobian = np.zeros((len(open_samples), len(rows), starts[-1]))
        for k, row in enumerate(rows):
            for (i, j, f), c in row.terms.items():
                at_start = 1.0 if f is None else evaluate_function(f, 0.0)
                factor = np.broadcast_to(c * at_start, samples)[open_samples]
                for coordinate, other in ((i, j), (j, i)):
                    if coordinate in column:
                        jacobian[:, k, column[coordinate]] += factor * z[other, open_samples]
        # Move the bodies by the least squares of what is missing.
        inverse = np.linalg.pinv(jacobian, rcond=min_singular_value)
        shift = np.zeros((starts[-1], len(open_samples)))
        for k in range(len(rows)):  # in this order, whatever the number of samples
            shift -= inverse[:, :, k].T * misfit[k, open_samples]
        for node, c in column.items():
            z[node, open_samples] += shift[c]
    return list(z)


def _is_influenced(row: Form, column: Mapping[int, int]) -> bool:
    """Return whether a row changes with the places, polynomially."""
    keys = [key for term in row.polar for form in term.vector for key in form.terms]
    polar = {n for i, j, _ in keys for n in (i, j)}
    return polar.isdisjoint(column) and any({i, j} & column.keys() for i, j, _ in row.terms)


def _samples(guess: Sequence[np.ndarray], rows: Sequence[Form]) -> int | None:
    """Return the number of samples, or None if numbers do not fit, which assembly refuses."""
    functions = [f for row in rows for _, _, f in row.terms if f is not None]
    functions += [term.f for row in rows for term in row.polar if term.f is not None]
    parts = [*guess, *(c for row in rows for c in row.terms.values())]
    try:
        parts += [np.asarray(evaluate_function(f, 0.0)) for f in functions]
    except (TypeError, ValueError):
        return None
    sizes = {np.size(part) for part in parts} - {1}
    finite = all(np.all(np.isfinite(part)) for part in parts)
    return max(sizes, default=1) if finite and len(sizes) < 2 else None
