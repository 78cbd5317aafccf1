"""The families of `honesty.py`, and their cases by seed."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from functools import partial

import numpy as np

from benchmarks.honesty import bends, formulas, hidden, ringing
from benchmarks.honesty import inputs as by_inputs
from benchmarks.honesty import kinks as kinked
from benchmarks.honesty.problems import Case, Problem, case
from benchmarks.honesty.steps import stepped
from benchmarks.honesty.studies import KINDS, Kind, study

Family = Callable[[str, int, np.random.Generator], Case]

PROBLEMS: dict[str, Callable[[np.random.Generator], Problem]] = {
    "ring": ringing.ring,
    "modes": ringing.modes,
    "veering": ringing.veering,
    "resonance": ringing.resonance,
    "beats": ringing.beats,
    "friction": kinked.friction,
    "impact": kinked.impact,
    "contact": kinked.contact,
    "kinks": kinked.kinks,
    "smooth": formulas.smooth,
    "rational": formulas.rational,
    "saturating": formulas.saturating,
    "alias": formulas.alias,
    "products": formulas.products,
    "pulses": formulas.pulses,
    "scalars": formulas.scalars,
    "stops": hidden.stops,
    "bumps": hidden.bumps,
    "powers": hidden.powers,
    "poles": hidden.poles,
    "corners": hidden.corners,
    "uniform": by_inputs.uniform,
}
"""Families whose cases have sometimes more inputs than variables."""

CHOSEN = {
    "many": by_inputs.many,
    "turned": by_inputs.turned,
    "intervals": by_inputs.intervals,
    "randoms": by_inputs.randoms,
    "units": by_inputs.units,
}
"""Families that choose the number of inputs, or the units, themselves."""

STEPPED = {
    "stepped ringing": (ringing.ring, ringing.modes, ringing.beats, ringing.resonance),
    "stepped smooth": (formulas.smooth, formulas.pulses, formulas.saturating, formulas.rational),
}
"""Families with a step and a mesh, of these problems."""

MORE_INPUTS = 0.25
"""Share of the cases with more inputs than variables."""


def _plain(make: Callable[[np.random.Generator], Problem]) -> Family:
    def drawn(name: str, seed: int, rng: np.random.Generator) -> Case:
        problem = make(rng)
        more = rng.random() < MORE_INPUTS
        inputs = len(problem.kinds) + int(rng.integers(1, 5)) if more else 0
        return case(name, seed, problem, rng, inputs=inputs)

    return drawn


def _chosen(make: Callable[[np.random.Generator], tuple[Problem, dict]]) -> Family:
    def drawn(name: str, seed: int, rng: np.random.Generator) -> Case:
        problem, options = make(rng)
        return case(name, seed, problem, rng, **options)

    return drawn


def _mechanism(kind: Kind) -> Family:
    return lambda name, seed, rng: study(name, seed, rng, kind)


FAMILIES: dict[str, Family] = {
    **{name: _plain(make) for name, make in PROBLEMS.items()},
    **{name: _chosen(make) for name, make in CHOSEN.items()},
    **{name: partial(stepped, makers) for name, makers in STEPPED.items()},
    **{name: _mechanism(kind) for name, kind in KINDS.items()},
    "bent": bends.bent,
    "swinging": bends.swinging,
    "stiffening": bends.stiffening,
}


def draw(family: str, seed: int) -> Case:
    """Return a case of a family; it depends on the seed and the family's name only."""
    rng = np.random.default_rng([seed, zlib.crc32(family.encode())])
    return FAMILIES[family](family, seed, rng)
