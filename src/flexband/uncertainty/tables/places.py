"""Where the rows of a table are, compared with where the inputs are."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
from scipy.cluster.vq import kmeans2
from scipy.spatial import KDTree
from scipy.special import ndtri

from flexband.basics.words import number_of
from flexband.uncertainty.inputs.distributions.random_option import RandomOption
from flexband.uncertainty.inputs.sampling import of_normals, sobol
from flexband.uncertainty.inputs.space import Space


def coordinates_of(xi: np.ndarray, eta: np.ndarray) -> np.ndarray:
    """Return places in which distances are compared, (places, m + n): standard deviations / 2."""
    return np.concatenate([eta, xi / 2], axis=1)


def target_places(space: Space) -> np.ndarray:
    """Return places as likely as the inputs are; intervals count evenly."""
    count = 4096
    m = space.interval_dimension
    n = space.random_dimension
    u = sobol(count, m + n, seed=3)
    return coordinates_of(of_normals(ndtri(u[:, m:]), space.families), 2 * u[:, :m] - 1)


def shares(rows: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """Return for what part of all places each row is the nearest one, (rows,)."""
    nearest = KDTree(rows).query(targets)[1]
    return np.bincount(nearest, minlength=len(rows)) / len(targets)


def folds(rows: np.ndarray, targets: np.ndarray, count: int, seed: int) -> np.ndarray:
    """Return the fold of each row, (rows,).

    Rows of a fold are predicted from all others, which must be as far away as rows are from the
    places that are predicted later (Milà et al., Methods Ecol. Evol. 13 (2022), 1304). Where random
    folds are too near, as those of clusters, folds are neighbours, and as few as that takes.
    """
    near_enough = 0.67  # of the distance from a place to the nearest row, in the lower quartile
    rng = np.random.default_rng(seed)
    min_distance = near_enough * _quartile(KDTree(rows).query(targets)[0])
    fold = rng.permutation(len(rows)) % count
    if _distance(rows, fold) >= min_distance:
        return fold
    for blocks in range(min(count, len(rows) // 2), 1, -1):
        fold = kmeans2(rows, blocks, rng=rng, minit="++")[1]
        if _distance(rows, fold) >= min_distance:
            break
    return np.unique(fold, return_inverse=True)[1]


def _distance(rows: np.ndarray, fold: np.ndarray) -> float:
    """Return the lower quartile of distances of rows to the nearest one of another fold."""
    distances = np.empty(len(rows))
    for k in np.unique(fold):
        inside = fold == k
        distances[inside] = 0.0 if inside.all() else KDTree(rows[~inside]).query(rows[inside])[0]
    return _quartile(distances)


def _quartile(distances: np.ndarray) -> float:
    return float(np.quantile(distances, 0.25))


def levels_within(rows: np.ndarray) -> list[np.ndarray]:
    """Return the number of the level of each row, of each variable that has few values in all rows.

    It is −1 for rows at the lowest or the highest level, which no other rows are beyond.
    """
    few = 12
    rows_of_level = 2.0
    levels = []
    for column in rows.T:
        values, level = np.unique(column, return_inverse=True)
        if len(values) <= min(few, len(rows) / rows_of_level):
            ends = (level == 0) | (level == len(values) - 1)
            levels.append(np.where(ends, -1, level))
    return levels


def too_few_levels(space: Space, xi: np.ndarray, eta: np.ndarray) -> list[str]:
    """Return which inputs have so few values in all rows that these do not tell what they do."""
    names = [*space.owners(random=False), *space.owners(random=True)]
    doubts = []
    for name, column in zip(names, np.concatenate([eta, xi], axis=1).T, strict=True):
        count = len(np.unique(column))
        option = space.inputs[name]
        if isinstance(option, RandomOption):
            absent = set(option.options) - set(option.value(column[:, None]).tolist())
            doubts += [f"no row of the table has {name} = {value!r}" for value in sorted(absent)]
        elif count < 3:
            values = number_of(count, "value")
            doubts.append(f"{name} has {values} in all rows, which show no curve")
    return doubts


def beyond_rows(space: Space, xi: np.ndarray, eta: np.ndarray) -> list[str]:
    """Return which inputs, or pairs of them, have values that no row is near, in words.

    Rows that are drawn at random do not reach the ends of intervals; how near they have to be
    depends on how many there are. A random input is looked at up to two standard deviations.
    """
    m = space.interval_dimension
    owners = [*space.owners(random=False), *space.owners(random=True)]
    ends = np.concatenate([np.ones(m), _usual(space)])
    spread = [v for v, name in enumerate(owners) if space.inputs[name].numeric]
    names = [owners[v] for v in spread]
    at = np.concatenate([eta, xi], axis=1)[:, spread] / ends[spread]
    gap = 2.5 / len(at) ** 0.5
    lacking = []
    for v, name in enumerate(names):
        sides = [side for side in (-1, 1) if np.max(side * at[:, v]) < 1 - min(gap, 0.5)]
        lacking += [f"{'low' if side < 0 else 'high'} {name}" for side in sides]
    if lacking:
        return _in_words(lacking)
    # If each input alone reaches its ends, pairs of them may not.
    for v, w in combinations(range(len(names)), 2):
        for a, b in ((-1, -1), (-1, 1), (1, -1), (1, 1)):
            nearest = np.max(a * at[:, v] + b * at[:, w]) / 2
            reached = 1.0 if max(v, w) < m else 0.7  # two numbers are rarely both far out
            if nearest < reached - min(1.5 * gap, 0.6):
                word = {-1: "low", 1: "high"}
                lacking.append(f"{word[a]} {names[v]} with {word[b]} {names[w]}")
    return _in_words(lacking)


def _in_words(lacking: Sequence[str]) -> list[str]:
    text = ", ".join(lacking[:3]) + (", …" if len(lacking) > 3 else "")
    return [f"no row of the table is near {text}"] if lacking else []


def _usual(space: Space) -> np.ndarray:
    """Return the smaller distance of ξ from 0 at two standard deviations of a normal one, (n,)."""
    n = space.random_dimension
    bounds = of_normals(np.array([[-2.0] * n, [2.0] * n]), space.families)
    return np.abs(bounds).min(axis=0)
