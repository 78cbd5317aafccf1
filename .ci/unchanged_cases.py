"""The cases of unchanged.py, computed with the flexband on the path: fixed inputs, fixed seeds.

`python unchanged_cases.py FILE [case …]` writes all their arrays. Cases whose names start with
"adaptive" choose their orders themselves. The examples are those of the tree under test.
"""

import os
import runpy
import sys
import time
import traceback
import warnings
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import scipy.stats
import xarray as xr

import flexband as fb

TREE = Path(os.environ["PYTHONPATH"]).parent
ROOMS = ("analysis", "answers", "fields", "inputs", "mechanics", "methods", "models", "uncertainty")


class Moving:
    """Public names that may move to a namespace of the package, one of ROOMS."""

    def __getattr__(self, name):
        places = [fb, *(getattr(fb, room, None) for room in ROOMS)]
        return next(getattr(place, name) for place in places if hasattr(place, name))


an = Moving()
PAIR = np.array([0.98, 1.03])  # factors of a number in two samples
TIMES = np.linspace(0.0, 2.0, 81)
MOTIONS = {  # file and function of examples, arguments, duration, step
    "slider_crank slider_crank": ((0.2 * PAIR, 1e3, lambda x: 69e9 + 7e9 * x, 0.34), 0.02, 1e-4),
    "paper/soft_link soft_link": ((0.2 * PAIR, 1e3, 6.9e9 / PAIR, 0.34), 0.05, 1e-3),
    "four_bar four_bar": ((0.3 * PAIR, 2.8e9), 0.05, 5e-4),
    "balance_wheel balance_wheel": ((8e-3 * PAIR, 1.6e-5), 0.5, 1e-3),
    "machine_mounts shaker": ((30, 4e4 * PAIR, 4e4, 0.02, ["natural", "synthetic"]), 0.2, 1e-3),
    "pick_and_place arm": ((0.5 * PAIR, 70e9), 0.1, 5e-4),
    "rough_road quarter_car": ((lambda x: 0.01 * np.sin(x), 1600 * PAIR), 0.5, 2.5e-3),
    "suspension suspension": ((4500.0, 45e3 * PAIR), 0.5, 2e-3),
    "cable_pendulum cable_pendulum": ((), 0.05, 5e-4),
    "door_stop door": ((), 0.6, 1e-3),
    "parallelogram parallelogram": ((), 0.5, 1e-3),
    "planetary_gear planetary_gear": ((), 0.1, 5e-4),
    "quick_return quick_return": ((), 0.5, 1e-3),
    "spin_up spin_up": ((), 0.5, 5e-3),
}


@cache
def example(name):
    return runpy.run_path(str(TREE / "examples" / f"{name}.py"))


def motions():
    for names, (arguments, duration, step) in MOTIONS.items():
        file, function = names.split()
        mechanism = example(file)[function](*arguments)
        yield file, fb.simulate(mechanism, duration=duration, step=step)


def cantilever(modulus):
    material = {"density": 7800.0, "youngs_modulus": modulus, "poissons_ratio": 0.3}
    section = {"height": 0.01, "width": lambda x: 0.02 - 0.01 * x, "retardation": 1e-4}
    local = {name: getattr(fb, name)("b", "0.3") for name in ("Deflection", "SectionForces")}
    local |= {name: getattr(fb, name)("b", "0.3", y=0.005) for name in ("Strain", "Stress")}
    whole = {name: getattr(fb, f"{name}Energy")() for name in ("Kinetic", "Elastic", "Potential")}
    return fb.Mechanism(
        bodies={"b": fb.Beam(length=0.5, **section, elements=3, **material),
                "m": fb.RigidBody(mass=0.1, inertia=1e-4, position=(0.5, 0.0))},
        joints={"clamp": fb.Weld("b.start", (0.0, 0.0)), "tip": fb.Weld("m", "b.end")},
        loads={"g": fb.Gravity(), "q": fb.DistributedLoad("b", y=lambda x: -20.0 * x)},
        sensors={**local, **whole, "tip": fb.Position("b.end"), "turn": fb.Angle("b.end"),
                 "v": fb.Velocity("m"), "a": fb.Acceleration("m"), "f": fb.Reaction("clamp")},
    )  # fmt: skip


def sensors_and_integrators():
    pulse = an.table([0.0, 0.01, 0.01, 0.03, 0.06], [0.0, 30.0, 15.0, 20.0, 0.0])
    loads = {"p": fb.Force("b.end", y=pulse), "t": fb.Moment("m", 0.4)}
    model, grid = replace(cantilever(2e11 * PAIR), loads=loads), {"duration": 0.06, "step": 5e-4}
    yield "default", fb.simulate(model, **grid)
    damped = fb.GeneralizedAlpha(spectral_radius=0.5)
    yield "damped", fb.simulate(model, substeps=2, integrator=damped, **grid)
    yield "discretization", an.discretization_error(model, **grid)


def joints_and_drives():
    disc = {"width": 0.02, "density": 7800.0}
    block = {"length": 0.1, "height": 0.02, "points": {"left": (-0.05, 0.0), "right": (0.1, 0.0)}}
    bodies = {
        "pinion": fb.RigidBody.disc(radius=0.1, **disc),
        "wheel": fb.RigidBody.disc(radius=0.2, position=(0.3, 0.0), **disc),
        "rack": fb.RigidBody.block(position=(0.0, -0.1), **block, **disc),
        "m": fb.PointMass(mass=0.2, position=(0.1, -0.4)),
        "p": fb.PointMass(mass=0.2, position=(0.0, 0.5)),
    }
    joints = {
        "P": fb.Revolute("pinion", (0.0, 0.0)), "W": fb.Revolute("wheel", (0.3, 0.0)),
        "teeth": fb.Gear("pinion", "wheel", 0.1, 0.2), "mesh": fb.Rack("pinion", "rack", 0.1),
        "guide": fb.Prismatic("rack.left", (0.0, -0.1)),
        "rod": fb.Distance("m", "rack.right", 0.3),
        "motor": fb.PrescribedRotation("pinion", an.table([0.0, 0.1, 0.2, 0.3], [0, 0.2, 0.1, 0])),
        "path": fb.PrescribedPath("p", lambda t: 0.1 * np.sin(9 * t), lambda t: 0.5 + t**2),
    }  # fmt: skip
    loads = {
        "g": fb.Gravity(), "s": fb.Spring("p", "wheel", 50.0, 0.4, damping=0.3),
        "c": fb.ViscousFriction("m", (0.0, 0.0), 0.1),
        "t": fb.TorsionSpring("wheel", (0.0, 0.0), 0.2, damping=0.01),
    }  # fmt: skip
    sensors = {name: fb.Reaction(name) for name in ("P", "guide", "rod", "mesh", "path")} | {
        "m": fb.Position("m"), "turn": fb.Angle("wheel"), "work": fb.Work("motor"),
        "motor": fb.ReactionMoment("motor"), "s": fb.SpringForce("s"), "t": fb.SpringMoment("t"),
    }  # fmt: skip
    model = fb.Mechanism(bodies=bodies, joints=joints, loads=loads, sensors=sensors)
    yield "motion", fb.simulate(model, duration=0.3, step=1e-3)


def rest_and_modes():
    leaf = example("leaf_spring")["leaf_spring"](np.array([0.0, 2000.0]))
    yield "leaf", an.equilibrium(leaf, steps=2)
    yield "leaf modes", an.modes(leaf, 2, steps=2)
    yield "clamped", an.modes(cantilever(210e9), 3, about="start", thickness=True)
    beam = cantilever(210e9 * PAIR)
    joints = {"hub": fb.Revolute("b.start", (0.0, 0.0)), "tip": beam.joints["tip"]}
    spun = replace(beam, joints=joints, loads={}, sensors={})
    yield "spun", an.modes(spun, 3, about=an.SteadyRotation(rate=4.0))
    yield "static", an.static_response(cantilever)(modulus=210e9 * PAIR)
    modal = an.modal_response(cantilever, 3, nominal={"modulus": 210e9})
    yield "modal", modal(modulus=210e9 * PAIR)


def labelled(*outputs):
    coords = {"output": ["X", "Y"], "time": TIMES}
    return xr.DataArray(np.stack(outputs, axis=1), coords, ("sample", "output", "time"))


def smooth(size, stiffness, profile):
    size, shape = size[:, None], profile(np.linspace(0.0, 1.0, 5)).mean(axis=-1)[:, None]
    decay = np.exp(-0.3 * size * TIMES) * shape
    return labelled(decay + size**2, np.sin(TIMES * shape) / (1 + 0.1 * stiffness[:, None]))


def ringing(size, stiffness, profile):
    size, shape = size[:, None], profile(np.linspace(0.0, 1.0, 5)).mean(axis=-1)[:, None]
    phase = 40 * (1 + 0.03 * size + 0.01 * stiffness[:, None]) * TIMES
    return labelled(np.cos(phase) * shape, TIMES * np.sin(phase) + size)


def bands(response, inputs, *methods):
    for number, method in enumerate(methods):
        name = f"{response.__name__} {type(method).__name__} {number}"
        yield name, fb.propagate(response, inputs, method)


PROFILE = fb.RandomField(1.0, 0.05, correlation_length=1.0, domain=(0.0, 1.0), terms=2)
INPUTS = {"size": fb.Interval(-0.5, 1), "stiffness": fb.Normal(0.5, 0.3), "profile": PROFILE}


def methods():
    expansions = fb.PCCI(2, 3), fb.ImprovedPCCI(3, 3), an.RegressionPCCI(3)
    others = an.PerturbationChebyshev(3), an.PhaseResolvedPCCI(2, 3)
    scanning = fb.LHSScanning(20, 6), fb.MonteCarlo(20, 6), an.SobolScanning(16, 6)
    for response in (smooth, ringing):
        yield from bands(response, INPUTS, *expansions, *others, *scanning)


def paper_study():
    paper, integrator = example("paper/slider_crank"), fb.GeneralizedAlpha(spectral_radius=0.7)
    shortened = {"duration": 0.1, "step": 1e-3, "integrator": integrator}
    response = fb.dynamic_response(paper["slider_crank"], **shortened)
    yield "improved", fb.Study(response, paper["inputs"], fb.ImprovedPCCI(3, 3)).run()


def adaptive():
    polynomial = fb.AdaptivePCCI(0.05, max_runs=60, phase_resolved=False)
    for response in (smooth, ringing):
        yield from bands(response, INPUTS, fb.AdaptivePCCI(0.01, max_runs=60), polynomial)
    for name, duration, step in (("suspension", 0.5, 2e-3), ("four_bar", 0.05, 1e-3)):
        response = fb.dynamic_response(example(name)[name], duration=duration, step=step)
        yield name, fb.Study(response, example(name)["inputs"], fb.AdaptivePCCI(0.02)).run()


def total(**values):
    x = sum(np.sin(k + v) for k, v in enumerate(values.values()))[:, None]
    return labelled(np.exp(0.2 * x) * np.cos(TIMES), x * TIMES)


def number(a):
    return total(a=a)


def function(a):
    return labelled(a(TIMES), np.sin(a(TIMES)) ** 2)


def distributions():
    part, measured = fb.Interval(0.9, 1.1), an.Samples(np.sin(np.arange(40.0)) + 2)
    normal = fb.Normal(part, cv=0.1), an.LogNormal(1.0, cv=fb.Interval(0.1, 0.2))
    bounded = an.TruncatedNormal(1.0, 0.5, lower=0.4), an.Uniform(0.0, part), part
    shaped = an.Triangular(0.1, 0.15, 0.4), an.Beta(2.0, 5.0, 0.6, 0.9), measured
    others = an.Weibull(1.0, 8.0), an.Gumbel(1.0, cv=0.15), scipy.stats.skewnorm(5.0, scale=0.4)
    for place, given in enumerate((*normal, *bounded, *shaped, *others)):
        for name, result in bands(number, {"a": given}, fb.PCCI(4, 4), fb.LHSScanning(20, 5)):
            yield f"{name} {type(given).__name__} {place}", result


def fields():
    span = {"correlation_length": 1.0, "domain": (0.0, 2.0)}
    loeve = {"discretization": an.karhunen_loeve, "correlation": an.exponential, "terms": 3}
    series = {"discretization": an.orthogonal_series, "correlation": an.Matern(1.5), "terms": 3}
    given = {
        "eole": fb.RandomField(1.0, 0.1, **span),
        "loeve": fb.RandomField(1.0, lambda x: 0.1 + 0.02 * x, **span, **loeve),
        "series": fb.RandomField(1.0, 0.1, **span, **series),
        "triangular": fb.RandomField(1.0, 0.1, **span, terms=3, correlation=an.triangular),
        "lognormal": fb.RandomField(1.0, 0.4, **span, distribution="lognormal"),
        "box": fb.RandomField(fb.Interval(0.9, 1.1), fb.Interval(0.1, 0.2), **span),
        "interval": an.IntervalField(0.9, lambda x: 1.1 + 0.1 * x, length=1, domain=(0.0, 2.0)),
        "smooth": an.IntervalField(0.9, 1.1, length=1, domain=(0.0, 2.0), smooth=True),
    }
    for name, field in given.items():
        yield name, fb.propagate(function, {"a": field}, fb.PCCI(1, 2))


def mixed(front, rear, size, kind, constant):
    return total(a=front, b=rear, c=size, d=np.where(kind == "hard", 1.5, 1.0) * constant)


def correlated_and_choices():
    parts = {"front": an.LogNormal(fb.Interval(1, 1.1), cv=0.1), "rear": an.Gumbel(1.0, cv=0.1)}
    inputs = {"springs": an.Correlated(parts, 0.6), "size": fb.Interval(0.9, 1.1)}
    inputs |= {"kind": an.Choice("hard", "soft"), "constant": 1.25}
    return bands(mixed, inputs, fb.PCCI(2, 2), an.RegressionPCCI(2), fb.LHSScanning(20, 4))


def crank(length, offset, stiffness, damping):
    angle, length = np.pi * TIMES, length[:, None]
    shake = 2.0 / stiffness[:, None] * np.cos(7 * angle) * np.exp(-damping[:, None] * TIMES)
    return labelled(length * np.sin(angle) + shake, length * np.cos(angle) + offset[:, None])


@cache
def surrogate(*, tensor=False):
    inputs = {"length": fb.Interval(9.9, 10.1), "offset": fb.Interval(-0.05, 0.05)}
    inputs |= {"stiffness": fb.Normal(20.0, 1.0), "damping": an.Uniform(0.2, 0.3)}
    method = fb.ImprovedPCCI(3, 3) if tensor else an.RegressionPCCI(4)
    an.save_surrogate(fb.expand(crank, inputs, method), "surrogate.npz")
    return an.load_surrogate("surrogate.npz")


def surrogates():
    at = {
        "length": 10 * PAIR,
        "offset": 0.01 * PAIR,
        "stiffness": 20 * PAIR,
        "damping": 0.25 * PAIR,
    }
    tight = {"length": fb.Interval(9.98, 10.02), "stiffness": fb.Normal(20.0, 0.5)}
    for name, model in (("regression", surrogate()), ("tensor", surrogate(tensor=True))):
        yield f"{name} bands", model.bands(2.0)
        yield f"{name} values", model.evaluate(**at)
        yield f"{name} narrowed", model.narrowed(**tight).bands()
        yield f"{name} verified", fb.verify(model, crank, runs=12)


def sensitivities():
    at = {"time": TIMES[:20:5]}
    yield "contributions", an.contributions(surrogate())
    yield "shapley", an.contributions(surrogate(tensor=True), shapley=True, at=at)
    yield "sobol", an.sobol_indices(surrogate(), at=at)
    yield "tolerance", an.tolerance_for(surrogate(), "length", 0.5)


def ranges():
    at = {"time": TIMES[:20:5]}
    yield "quantiles", an.quantiles(surrogate(), [0.05, 0.9], at=at, samples=1024)
    yield "p_box", an.p_box(surrogate(), "X", 0.5, samples=1024)
    yield "range", an.value_range(surrogate())
    yield "path", an.path(surrogate(), "X", "Y")
    yield "tube", an.path(surrogate(tensor=True), "X", "Y", probability=0.99, directions=8)
    for name in ("Peak", "Trough", "PeakTime", "RootMeanSquare", "Spectrum"):
        yield name, an.derived(surrogate(), getattr(an, name)("X"), samples=2000)
    yield "farthest", an.derived(surrogate(), an.Peak(an.Magnitude("X", "Y")), samples=2000)


def limits():
    model, tensor, far = surrogate(), surrogate(tensor=True), an.Limit("Y", above=-11, below=10.2)
    high, low = an.Limit("X", below=10.2), an.Limit("X", above=-10.3, during=(0.5, 1.5))
    yield "margins", an.check_limits(model, [high, low])
    yield "tensor", an.check_limits(tensor, far, sigmas=2)
    yield "probability", an.failure_probability(model, high, seed=3, accuracy=0.1)
    yield "corrected", an.failure_probability(model, [high, low], response=crank, accuracy=0.1)


def allocations():
    costs = {"length": 1.0, "stiffness": an.ReciprocalCost(5.0)}
    low, high, model = an.Limit("X", below=10.13), an.Limit("X", below=10.25), surrogate()
    grades = an.Grades({"fine": (0.02, 9.0), "medium": (0.05, 4.0), "coarse": (0.1, 2.0)})
    yield "worst case", an.allocate(model, low, costs, response=crank)
    yield "probability", an.allocate(model, low, costs, probability=0.01)
    yield "grades", an.allocate(model, high, {"length": grades})


CASES = [motions, sensors_and_integrators, joints_and_drives, rest_and_modes, methods, paper_study,
         adaptive, distributions, fields, correlated_and_choices, surrogates, sensitivities, ranges,
         limits, allocations]  # fmt: skip


def arrays(name, result):
    """Yield the variables and the numeric attributes of a result, by name."""
    whole = result.to_dataset(name="values") if isinstance(result, xr.DataArray) else result
    values = {name: variable.values for name, variable in whole.variables.items()}
    attributes = {f"attrs {key}": np.asarray(value) for key, value in whole.attrs.items()}
    values |= {key: array for key, array in attributes.items() if array.dtype.kind in "biufc"}
    for key, array in values.items():
        yield f"{name}: {key}", array.astype(str) if array.dtype.kind == "O" else array


def main():
    """Compute the cases, or those that are named, and write a file."""
    file, *names = sys.argv[1:]
    if not Path(fb.__file__).is_relative_to(TREE):
        sys.exit(f"flexband must be that of {TREE}; got {fb.__file__}")
    warnings.simplefilter("ignore")
    written = {}
    for case in [case for case in CASES if not names or case.__name__ in names]:
        name, start = case.__name__, time.process_time()
        try:
            written |= {f"{name}/{key}": a for part in case() for key, a in arrays(*part)}
        except Exception as error:
            traceback.print_exc()
            written[f"{name}/error"] = np.array(f"{type(error).__name__}: {error}")
        print(f"{name}: {time.process_time() - start:.1f} s", flush=True)
    np.savez_compressed(file, **written)


if __name__ == "__main__":
    main()
