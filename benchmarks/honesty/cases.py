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
from benchmarks.honesty.steps import stepped_problem
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
    "saturating": formulas.saturations,
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
    "many": by_inputs.many_inputs,
    "turned": by_inputs.sums_of_normals,
    "intervals": by_inputs.intervals,
    "randoms": by_inputs.randoms,
    "units": by_inputs.units,
}
"""Families that choose the number of inputs, or the units, themselves."""

STEPPED = {
    "stepped ringing": (ringing.ring, ringing.modes, ringing.beats, ringing.resonance),
    "stepped smooth": (formulas.smooth, formulas.pulses, formulas.saturations, formulas.rational),
}
"""Families with a step and a mesh, of these problems."""

MORE_INPUTS = 0.25
"""Share of the cases with more inputs than variables."""


def _problem_family(make: Callable[[np.random.Generator], Problem]) -> Family:
    def draw_case(name: str, seed: int, rng: np.random.Generator) -> Case:
        problem = make(rng)
        has_more_inputs = rng.random() < MORE_INPUTS
        inputs = len(problem.kinds) + int(rng.integers(1, 5)) if has_more_inputs else 0
        return case(name, seed, problem, rng, inputs=inputs)

    return draw_case


def _family_with_options(make: Callable[[np.random.Generator], tuple[Problem, dict]]) -> Family:
    def draw_case(name: str, seed: int, rng: np.random.Generator) -> Case:
        problem, options = make(rng)
        return case(name, seed, problem, rng, **options)

    return draw_case


def _study_family(kind: Kind) -> Family:
    return lambda name, seed, rng: study(name, seed, rng, kind)


FAMILIES: dict[str, Family] = {
    **{name: _problem_family(make) for name, make in PROBLEMS.items()},
    **{name: _family_with_options(make) for name, make in CHOSEN.items()},
    **{name: partial(stepped_problem, makers) for name, makers in STEPPED.items()},
    **{name: _study_family(kind) for name, kind in KINDS.items()},
    "bent": bends.bent_phases,
    "swinging": bends.swinging_pendulum,
    "stiffening": bends.duffing_oscillator,
}


def draw(family: str, seed: int) -> Case:
    """Return a case of a family; it depends on the seed and the family's name only."""
    rng = np.random.default_rng([seed, zlib.crc32(family.encode())])
    return FAMILIES[family](family, seed, rng)
