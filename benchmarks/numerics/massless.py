"""Mechanisms with zero masses and inertias, drawn at random: right, or refused.

Pendulums, four-bars, slider–cranks, quick returns, parallel cranks, plates on rods and bodies on
springs, in which some masses and inertias are zero. What simulations return is compared with the
`Reference` of massless_draws.py, and refusals with the rank of its equations.

    python -m benchmarks.numerics.massless --seed 1 --samples 200
"""

from __future__ import annotations

import sys
import warnings
from collections import Counter

import numpy as np

import flexband as fb
from benchmarks.harness import options, report
from benchmarks.numerics.massless_draws import Draw, Part, Reference, mechanism, rod

MECHANISMS = 200
DURATION = 0.4
STEP = 1e-3
TOLERANCE = 2e-3
"""Error of motions, relative to the size of the mechanism and to 1 rad, and of forces relative to
the largest one, that counts as wrong."""

LIGHT = 0.15
"""Share of bodies whose masses are drawn from six decades."""

UNDETERMINED = 1e-6
"""Motion of what has mass, as a share of that of all, that does not determine it."""


def masses(rng: np.random.Generator, length: float) -> tuple[float, float]:
    """Return a mass and an inertia, of which one or both may be zero; some bodies are light."""
    mass = 10.0 ** rng.uniform(-5 if rng.random() < LIGHT else -1, 1)
    inertia = mass * length**2 / 12
    return [(mass, inertia), (0.0, 0.0), (0.0, inertia), (mass, 0.0)][
        rng.choice(4, p=[0.4, 0.4, 0.08, 0.12])
    ]


def bar(rng: np.random.Generator, start, end) -> Part:
    """Return a bar between two points with drawn masses."""
    return rod(start, end, *masses(rng, float(np.hypot(end[0] - start[0], end[1] - start[1]))))


def point(rng: np.random.Generator, place) -> Part:
    """Return a point mass."""
    return Part(10.0 ** rng.uniform(-1, 1), None, {"centre": (0.0, 0.0)}, tuple(place), 0.0)


def offset_point(rng: np.random.Generator, start, length: float, angle: float | None = None):
    """Return a point at a distance in a drawn direction."""
    angle = rng.uniform(-np.pi, np.pi) if angle is None else angle
    return start[0] + length * np.cos(angle), start[1] + length * np.sin(angle)


def chain(rng: np.random.Generator) -> Draw:
    """Return a pendulum of one to four bars, with point masses at some of its pins."""
    parts = {}
    joints = {}
    springs = []
    at = (0.0, 0.0)
    last = (0.0, 0.0)
    for k in range(rng.integers(1, 5)):
        end = offset_point(rng, at, rng.uniform(0.1, 0.5))
        parts[f"b{k}"] = bar(rng, at, end)
        weld = k > 0 and rng.random() < 0.2
        angle = parts[f"b{k}"].angle - parts[f"b{k - 1}"].angle if weld else 0.0
        joints[f"J{k}"] = ("weld", (f"b{k}", "start"), last, angle) if weld else (
            "pin", (f"b{k}", "start"), last)  # fmt: skip
        if rng.random() < 0.5:
            parts[f"m{k}"] = point(rng, end)
            joints[f"M{k}"] = "pin", (f"m{k}", "centre"), (f"b{k}", "end")
        if rng.random() < 0.3:
            previous_angle = parts[f"b{k - 1}"].angle if k else 0.0
            rest = float(parts[f"b{k}"].angle - previous_angle)
            springs.append(("turn", (f"b{k}", "start"), last, rng.uniform(1, 30), rest,
                            rng.choice([0.0, 0.05])))  # fmt: skip
        at = end
        last = (f"b{k}", "end")
    return Draw("chain", parts, joints, springs)


def _add_motor(rng, joints, parts, name):
    """Add a motor to some mechanisms."""
    if rng.random() < 0.4:
        joints["motor"] = "motor", (name, "start"), (0.0, 0.0), rng.uniform(-10, 10)


def four_bar(rng: np.random.Generator) -> Draw:
    """Return a four-bar, some with a point mass on its coupler, a spring or a motor."""
    a = offset_point(rng, (0.0, 0.0), rng.uniform(0.05, 0.15))
    d = (rng.uniform(0.25, 0.4), 0.0)
    b = offset_point(rng, d, rng.uniform(0.15, 0.3), rng.uniform(0.8, 2.2))
    parts = {
        "crank": bar(rng, (0.0, 0.0), a), "coupler": bar(rng, a, b), "rocker": bar(rng, d, b)
    }  # fmt: skip
    joints: dict[str, tuple] = {
        "A": ("pin", ("crank", "start"), (0.0, 0.0)),
        "B": ("pin", ("coupler", "start"), ("crank", "end")),
        "C": ("pin", ("coupler", "end"), ("rocker", "end")),
        "D": ("pin", ("rocker", "start"), d),
    }
    springs = []
    if rng.random() < 0.5:
        place = [("coupler", "centre"), ("coupler", "end"), ("crank", "end")][rng.integers(3)]
        of = parts[place[0]]
        c = np.cos(of.angle)
        s = np.sin(of.angle)
        x = of.points[place[1]][0]
        parts["load"] = point(rng, (of.place[0] + c * x, of.place[1] + s * x))
        joints["L"] = "pin", ("load", "centre"), place
    if rng.random() < 0.4:
        springs.append(("line", ("coupler", "centre"), (0.1, 0.5), rng.uniform(10, 300), 0.2,
                        rng.choice([0.0, 1.0])))  # fmt: skip
    _add_motor(rng, joints, parts, "crank")
    return Draw("four-bar", parts, joints, springs)


def slider_crank(rng: np.random.Generator) -> Draw:
    """Return a slider–crank whose slider is a body on a guide, or a point mass in a slot."""
    length = rng.uniform(0.3, 0.6)
    arm = rng.uniform(0.05, 0.2)
    a = offset_point(rng, (0.0, 0.0), arm)
    b = a[0] + np.sqrt(length**2 - a[1] ** 2), 0.0
    parts = {"crank": bar(rng, (0.0, 0.0), a), "rod": bar(rng, a, b)}
    joints: dict[str, tuple] = {
        "A": ("pin", ("crank", "start"), (0.0, 0.0)),
        "B": ("pin", ("rod", "start"), ("crank", "end")),
    }
    if rng.random() < 0.5:
        parts["slider"] = point(rng, b)
        joints["guide"] = "slot", ("slider", "centre"), (0.0, 0.0), (1.0, 0.0)
    else:
        mass, inertia = masses(rng, 0.1)
        parts["slider"] = Part(mass, inertia, {"centre": (0.0, 0.0)}, b, 0.0)
        joints["guide"] = "slide", ("slider", "centre"), (0.0, 0.0), (1.0, 0.0), 0.0
    joints["C"] = "pin", ("slider", "centre"), ("rod", "end")
    springs = []
    if rng.random() < 0.4:
        springs.append(("line", ("slider", "centre"), (0.0, 0.0), rng.uniform(10, 300), b[0],
                        rng.choice([0.0, 2.0])))  # fmt: skip
    _add_motor(rng, joints, parts, "crank")
    return Draw("slider–crank", parts, joints, springs)


def quick_return(rng: np.random.Generator) -> Draw:
    """Return a crank whose end runs in the slot of a rocker."""
    a = offset_point(rng, (0.0, 0.0), rng.uniform(0.05, 0.12))
    d = (0.0, -rng.uniform(0.2, 0.4))
    reach = 0.6
    angle = float(np.arctan2(a[1] - d[1], a[0] - d[0]))
    parts = {
        "crank": bar(rng, (0.0, 0.0), a), "rocker": bar(rng, d, offset_point(rng, d, reach, angle))
    }  # fmt: skip
    joints: dict[str, tuple] = {
        "A": ("pin", ("crank", "start"), (0.0, 0.0)),
        "D": ("pin", ("rocker", "start"), d),
    }
    if rng.random() < 0.5:
        mass, inertia = masses(rng, 0.05)
        parts["block"] = Part(mass, inertia, {"centre": (0.0, 0.0)}, a, angle)
        joints["B"] = "pin", ("block", "centre"), ("crank", "end")
        joints["S"] = "slide", ("block", "centre"), ("rocker", "start"), (1.0, 0.0), 0.0
    else:
        joints["S"] = "slot", ("crank", "end"), ("rocker", "start"), (1.0, 0.0)
    _add_motor(rng, joints, parts, "crank")
    return Draw("quick return", parts, joints)


def cranks(rng: np.random.Generator) -> Draw:
    """Return a plate that hangs on two or three parallel cranks or rods."""
    count = rng.integers(2, 4)
    angle = -rng.uniform(0.5, 1.2)
    length = rng.uniform(0.2, 0.5)
    places = np.sort(rng.uniform(-0.5, 0.5, 3))
    parts: dict[str, Part] = {}
    joints: dict[str, tuple] = {}
    centre = offset_point(rng, (0.0, 0.0), length, angle)
    mass = 10.0 ** rng.uniform(-1, 1)
    points = {f"p{k}": (float(x), 0.0) for k, x in enumerate(places)} | {"centre": (0.0, 0.0)}
    inertia = rng.choice([0.0, 0.1]) * mass
    parts["plate"] = Part(mass, float(inertia), points, centre, 0.0)
    for k, x in enumerate(places[:count]):
        foot = (float(x), 0.0)
        if rng.random() < 0.2:
            joints[f"b{k}"] = "rod", ("plate", f"p{k}"), foot, length
            continue
        parts[f"c{k}"] = bar(rng, foot, offset_point(rng, foot, length, angle))
        joints[f"a{k}"] = "pin", (f"c{k}", "start"), foot
        joints[f"b{k}"] = "pin", ("plate", f"p{k}"), (f"c{k}", "end")
    return Draw("parallel cranks", parts, joints)


def sprung_body(rng: np.random.Generator) -> Draw:
    """Return a body on springs that act on massless plates, hubs or bars joined to it."""
    parts: dict[str, Part] = {"body": rod((0.0, 0.0), (0.4, 0.0), 2.0, 0.05)}
    joints: dict[str, tuple] = {}
    if rng.random() < 0.6:
        joints["A"] = "pin", ("body", "start"), (0.0, 0.0)
    springs: list[tuple] = []
    for k in range(rng.integers(1, 4)):
        end = offset_point(rng, (0.4, 0.0), rng.uniform(0.1, 0.3))
        parts[f"b{k}"] = bar(rng, (0.4, 0.0), end)
        angle = parts[f"b{k}"].angle
        where = (f"b{k}", "start"), ("body", "end")
        joints[f"J{k}"] = ("weld", *where, angle) if rng.random() < 0.6 else ("pin", *where)
        anchor = offset_point(rng, end, rng.uniform(0.2, 0.4))
        springs.append(("line", (f"b{k}", "end"), anchor, rng.uniform(20, 500),
                        rng.uniform(0.1, 0.4), rng.choice([0.0, 1.0])))  # fmt: skip
    return Draw("sprung", parts, joints, springs)


KINDS = chain, four_bar, slider_crank, quick_return, cranks, sprung_body


def draw_mechanism(seed: int) -> Draw:
    """Return the mechanism of a seed."""
    rng = np.random.default_rng(seed)
    return KINDS[rng.integers(len(KINDS))](rng)


def errors(draw: Draw, exact: dict[str, np.ndarray], parts: int, unique: bool) -> dict[str, float]:
    """Return the largest error of places, angles and forces relative to their scale.

    Each step has so many parts. Forces that redundant constraints share are not compared.
    """
    motion = fb.simulate(mechanism(draw), duration=DURATION, step=STEP, substeps=parts)
    largest = {"place": draw.size, "angle": 1.0, "force": 0.0}
    forces = [np.abs(v).max() for name, v in exact.items() if name.startswith("force")]
    largest["force"] = max(*forces, 1e-9)
    largest_errors = dict.fromkeys(largest, 0.0)
    for name, values in zip(motion.output.values, motion.values, strict=True):
        kind = str(name).split()[0]
        if kind == "force" and not unique:
            continue
        difference = values[:: len(values) // (len(exact[name]) - 1)] - exact[name]
        if kind == "angle":
            difference = (difference + np.pi) % (2 * np.pi) - np.pi
        largest_errors[kind] = max(
            largest_errors[kind], float(np.abs(difference).max()) / largest[kind]
        )
    return largest_errors


def judge_mechanism(draw: Draw) -> tuple[str, str]:
    """Return what became of a mechanism, and why."""
    reference = Reference(draw)
    is_determined = reference.determinacy(reference.start) > UNDETERMINED
    error_by_kind: dict[str, float] = {}
    with warnings.catch_warnings(record=True) as warning_list:
        warnings.simplefilter("always")
        exact = reference.motion(np.linspace(0.0, DURATION, 41)) if is_determined else None
        try:
            if exact is not None:
                error_by_kind = errors_at_fine_step(
                    draw, exact, not reference.is_redundant(reference.start)
                )
            else:
                fb.simulate(mechanism(draw), duration=DURATION, step=STEP)
        except (fb.errors.InputError, fb.errors.SimulationError, fb.errors.AssemblyError) as error:
            no_verdict = isinstance(error, fb.errors.SimulationError) and exact is None
            verdict = "not judged" if no_verdict else "refused wrongly"
            return (
                verdict if is_determined else "refused rightly",
                f"{type(error).__name__}: {error}",
            )
    if exact is None:
        return "not judged" if is_determined else "accepted wrongly", "masses hardly determine it"
    text = ", ".join(f"{kind} {error:.1e}" for kind, error in error_by_kind.items())
    if max(error_by_kind.values()) < TOLERANCE:
        return "right", text
    resolution = any(issubclass(w.category, fb.errors.ResolutionWarning) for w in warning_list)
    return "wrong, warned of" if resolution else "wrong in silence", text


def errors_at_fine_step(draw: Draw, exact: dict[str, np.ndarray], unique: bool) -> dict[str, float]:
    """Return the `errors` at the first step that is short enough, or at the shortest one."""
    largest_errors: dict[str, float] = {}
    for parts in (1, 10, 50):
        largest_errors = errors(draw, exact, parts, unique)
        if max(largest_errors.values()) < TOLERANCE:
            break
    return largest_errors


def main() -> None:
    arguments = options(__doc__, MECHANISMS, seed=(1, "first of the seeds"))
    counts: dict[str, Counter] = {}
    for seed in range(arguments.seed, arguments.seed + arguments.samples):
        draw = draw_mechanism(seed)
        outcome, why = judge_mechanism(draw)
        counts.setdefault(draw.kind, Counter())[outcome] += 1
        if outcome not in ("right", "refused rightly"):
            print(seed, draw.kind, outcome, why, file=sys.stderr)
    outcomes = sorted({outcome for count in counts.values() for outcome in count})
    rows = [[kind, *(str(count[o]) for o in outcomes)] for kind, count in counts.items()]
    measurements = {kind: dict(count) for kind, count in counts.items()}
    report(arguments.output, "massless", ["mechanism", *outcomes], rows, measurements)


if __name__ == "__main__":
    main()
