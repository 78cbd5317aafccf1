"""Mechanisms with a step and elements that are too coarse, of many kinds, drawn at random."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

import flexband as fb
from benchmarks.honesty import mechanisms
from benchmarks.honesty.studies import KINDS, NOMINAL

FREE = 0.25
"""Share of the cases that leave out the step, and the elements if there are any."""

FIRST_ELEMENTS = 4
"""Of members whose elements are left out, on the coarsest level."""

UNIFORM = 0.3
"""Share of uniform inputs among the random ones."""


@dataclass(frozen=True)
class CoarseMechanism:
    """A response to a mechanism's inputs.

    Attributes
    ----------
    builder : of the inputs; it takes the number of elements by name, if there are any.
    inputs : by name.
    duration, step : [s]; the step is the output step, and too long.
    elements : given number of elements; None if there are none.
    free_discretization : whether step and elements are left to the method.
    """

    builder: Callable[..., fb.Mechanism]
    inputs: Mapping[str, object]
    duration: float
    step: float
    elements: int | None
    free_discretization: bool

    def mechanism(self, subdivisions: int = 0, **values) -> fb.Mechanism:
        """Return the mechanism, with elements divided into so many, or left out where free."""
        if self.elements is None:
            return self.builder(**values)
        base_elements = FIRST_ELEMENTS if self.free_discretization else self.elements
        elements = (
            None
            if self.free_discretization and not subdivisions
            else base_elements * max(subdivisions, 1)
        )
        return self.builder(**values, elements=elements)


Parameters = Mapping[str, tuple[float, float]]
"""Nominal value and largest relative spread, by name."""


def _case(
    rng: np.random.Generator,
    builder: Callable[..., fb.Mechanism],
    parameters: Parameters,
    duration: float,
    steps: int,
    elements: int | None = None,
    max_inputs: int = 3,
) -> CoarseMechanism:
    """Return a case, in which some of the parameters are uncertain."""
    nominal = {
        name: value * (1 + NOMINAL * rng.uniform(-1, 1) * (spread >= 0.02))
        for name, (value, spread) in parameters.items()
    }
    inputs: dict[str, object] = {}
    count = int(rng.integers(1, min(max_inputs, len(nominal)) + 1))
    for name in map(str, rng.permutation(list(nominal))[:count]):
        value = nominal.pop(name)
        radius = parameters[name][1] * 10 ** rng.uniform(-0.7, 0)
        ends = value * (1 - radius), value * (1 + radius)
        if rng.random() < 0.5:
            inputs[name] = fb.Interval(*ends)
        elif rng.random() < UNIFORM:
            inputs[name] = fb.Uniform(*ends)
        else:
            inputs[name] = fb.Normal(value, value * radius / 2)
    step = float(f"{duration / steps:.3g}")
    free_discretization = bool(rng.random() < FREE)
    return CoarseMechanism(
        partial(builder, **nominal),
        inputs,
        float(f"{steps * step:.12g}"),
        step,
        elements,
        free_discretization,
    )


def rigid_linkage(name: str, rng: np.random.Generator) -> CoarseMechanism:
    """Return a rigid linkage whose motion is smooth."""
    kind = KINDS[name]
    duration = rng.uniform(*kind.duration)
    steps = round(duration / kind.step / 2 ** rng.uniform(0, 2.5))
    return _case(rng, kind.builder, kind.parameters, duration, max(steps, 40))


def elastic_crank(rng: np.random.Generator, *, field: bool = False) -> CoarseMechanism:
    """Return a slider–crank with an elastic link, stiff or soft, damped or not.

    With a `field` its modulus is one.
    """
    modulus = 10 ** rng.uniform(9.3, 11)
    period = 5.0 / np.sqrt(modulus / 2700)  # about that of the link's bending
    parameters = dict(KINDS["elastic crank"].parameters) | {"modulus": (modulus, 0.08)}
    damping = 10 ** rng.uniform(-5.5, -4) if rng.random() < 0.4 else 0.0
    builder = partial(mechanisms.elastic_crank, retardation_time=damping)
    duration = min(rng.uniform(8, 30) * period, 0.4)
    steps = max(80, round(duration / period * 2 ** rng.uniform(3, 6)))
    if field:
        del parameters["modulus"], parameters["link"]
    elements = int(rng.integers(2, 5))
    case = _case(rng, builder, parameters, duration, steps, elements, max_inputs=1 if field else 2)
    if not field:
        return case
    length = rng.uniform(0.3, 1.0)
    of_link = fb.RandomField(modulus, 0.02 * modulus, correlation_length=length, domain=(0.0, 0.45))
    builder = partial(case.builder, link=0.45)
    return replace(case, builder=builder, inputs={**case.inputs, "modulus": of_link})


def elastic_four_bar(rng: np.random.Generator) -> CoarseMechanism:
    """Return the linkage of a wiper with a coupler of polyamide."""
    kind = KINDS["elastic four-bar"]
    duration = rng.uniform(*kind.duration)
    steps = round(duration / kind.step * 2 ** rng.uniform(-0.5, 2.5))
    return _case(
        rng, kind.builder, kind.parameters, duration, steps, int(rng.integers(2, 5)), max_inputs=2
    )


def chain(rng: np.random.Generator) -> CoarseMechanism:
    """Return two to four rigid bars with springs between them, which ring in several modes."""
    count = int(rng.integers(2, 5))
    lengths = rng.uniform(0.1, 0.4, count)
    angles = rng.uniform(-0.3, 0.3, count)
    factors = 10 ** rng.uniform(-0.3, 0.3, count)
    damping = 10 ** rng.uniform(-4, -2)

    def builder(stiffness, density, lean):
        bodies = {}
        joints = {}
        end = (0.0, 0.0)
        loads: dict[str, object] = {"gravity": fb.Gravity()}
        for k in range(count):
            angle = angles[k] + lean
            bodies[f"{k}"] = fb.RigidBody.bar(
                length=lengths[k], height=0.02, width=0.02, density=density, start=end, angle=angle
            )
            previous_end = f"{k - 1}.end" if k else end
            joints[f"j{k}"] = fb.Revolute(f"{k}.start", previous_end)
            loads[f"s{k}"] = fb.TorsionSpring(
                f"{k}", previous_end, stiffness * factors[k], damping=damping
            )
            end = (end[0] + lengths[k] * np.cos(angle), end[1] + lengths[k] * np.sin(angle))
        sensors = {"end": fb.Position(f"{count - 1}.end"), "F": fb.Reaction("j0")}
        return fb.Mechanism(bodies=bodies, joints=joints, loads=loads, sensors=sensors)

    stiffness = 10 ** rng.uniform(1.5, 2.7)
    parameters = {"stiffness": (stiffness, 0.08), "density": (3000.0, 0.05), "lean": (0.2, 0.1)}
    return _case(rng, builder, parameters, rng.uniform(0.5, 1.5), int(rng.integers(120, 600)))


def cantilever(rng: np.random.Generator) -> CoarseMechanism:
    """Return a beam that rings after a load, sudden or within a while."""
    length = rng.uniform(0.2, 1.0)
    slenderness = rng.uniform(10, 60)
    height = length / slenderness
    density = 2000.0
    modulus = 10 ** rng.uniform(8, 11)
    area = 0.02 * height
    second = 0.02 * height**3 / 12
    period = 2 * np.pi / 3.516 * length**2 * np.sqrt(density * area / (modulus * second))
    size = 0.3 * modulus * second / length**2
    rise = rng.uniform(0, 1) * period
    damping = float(rng.choice([0.0, 0.003])) * period

    def builder(modulus, density, load, elements):
        beam = fb.Beam(
            length=length, height=height, width=0.02, density=density, youngs_modulus=modulus,
            poissons_ratio=0.3, elements=elements, retardation_time=damping,
        )  # fmt: skip

        def force(t):
            return -load * np.minimum(t / rise, 1.0)

        return fb.Mechanism(
            bodies={"beam": beam},
            joints={"clamp": fb.Weld("beam.start", (0.0, 0.0))},
            loads={"load": fb.Force("beam.end", y=force)},
            sensors={"tip": fb.Position("beam.end"), "root": fb.Reaction("clamp")},
        )

    parameters = {"modulus": (modulus, 0.08), "density": (density, 0.05), "load": (size, 0.1)}
    steps = int(rng.integers(120, 500))
    return _case(
        rng, builder, parameters, rng.uniform(4, 12) * period, steps, int(rng.integers(2, 5)), 2
    )


def soft_pendulum(rng: np.random.Generator) -> CoarseMechanism:
    """Return a soft beam that falls from the horizontal, with a weight at its end."""
    height = rng.uniform(4e-3, 1e-2)
    modulus = 10 ** rng.uniform(8, 9.5)
    damping = 10 ** rng.uniform(-4, -3) if rng.random() < 0.5 else 0.0

    def builder(modulus, density, weight, elements):
        length = 0.6
        member = fb.Beam(
            length=length, height=height, width=0.02, density=density, youngs_modulus=modulus,
            poissons_ratio=0.4, elements=elements, retardation_time=damping,
        )  # fmt: skip
        return fb.Mechanism(
            bodies={
                "member": member,
                "weight": fb.PointMass(mass=weight, position=(length, 0.0)),
            },
            joints={
                "hinge": fb.Revolute("member.start", (0.0, 0.0)),
                "end": fb.Revolute("weight", "member.end"),
            },
            loads={"gravity": fb.Gravity()},
            sensors={"end": fb.Position("member.end"), "F": fb.Reaction("hinge")},
        )

    parameters = {
        "modulus": (modulus, 0.1), "density": (1200.0, 0.05),
        "weight": (10 ** rng.uniform(-2, -0.3), 0.1),
    }  # fmt: skip
    steps = int(rng.integers(120, 500))
    return _case(rng, builder, parameters, rng.uniform(0.2, 0.5), steps, int(rng.integers(2, 5)), 2)


def spring_and_stop(t, x, v, p, force):
    """Set the force of a spring, and of a stop that is hit beyond a gap."""
    stiffness, contact, gap = p
    force[0, 0] = -stiffness * x[0, 0]
    if x[0, 0] > gap:
        force[0, 0] -= contact * (x[0, 0] - gap)


def stop(rng: np.random.Generator) -> CoarseMechanism:
    """Return a mass on a spring that hits a stop: kinks, of which no order is seen."""
    contact = 10 ** rng.uniform(4, 6)

    def builder(stiffness, gap, weight):
        return fb.Mechanism(
            bodies={"mass": fb.RigidBody(mass=weight, inertia=0.01, position=(-0.1, 0.0))},
            joints={"guide": fb.Prismatic("mass", (0.0, 0.0))},
            loads={"law": fb.ForceLaw(["mass"], spring_and_stop, [stiffness, contact, gap])},
            sensors={"x": fb.Position("mass"), "v": fb.Velocity("mass")},
        )

    parameters = {"stiffness": (500.0, 0.1), "gap": (0.05, 0.1), "weight": (1.0, 0.1)}
    return _case(rng, builder, parameters, rng.uniform(0.3, 0.8), int(rng.integers(100, 600)))


DRAWS: dict[str, Callable[[np.random.Generator], CoarseMechanism]] = {
    "rigid slider–crank": partial(rigid_linkage, "rigid slider–crank"),
    "rigid four-bar": partial(rigid_linkage, "four-bar"),
    "double pendulum": partial(rigid_linkage, "pendulum"),
    "elastic crank": elastic_crank,
    "elastic four-bar": elastic_four_bar,
    "chain": chain,
    "cantilever": cantilever,
    "soft pendulum": soft_pendulum,
    "random field": partial(elastic_crank, field=True),
    "stop": stop,
}
