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
NAMESPACES = ("analysis", "errors", "execution", "fields", "methods", "models", "sections")


class Moving:
    """Public names that may move to a namespace of the package, one of NAMESPACES."""

    def __getattr__(self, name):
        places = [fb, *(getattr(fb, namespace, None) for namespace in NAMESPACES)]
        return next(getattr(p, name) for p in places if name in getattr(p, "__all__", ()))


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
    damping = "retardation_time" if hasattr(fb.Beam, "retardation_time") else "retardation"
    section = {"height": 0.01, "width": lambda x: 0.02 - 0.01 * x, damping: 1e-4}
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
    block = {"length": 0.1, "height": 0.02, "width": 0.02, "density": 7800.0}
    rack = fb.RigidBody.block(position=(0.0, -0.1), points={"end": (0.1, 0.0)}, **block)
    joints = {
        "P": fb.Revolute("disc", (0.0, 0.0)), "mesh": fb.Rack("disc", "rack", 0.1),
        "guide": fb.Prismatic("rack", (0.0, -0.1)), "rod": fb.Distance("m", "rack.end", 0.3),
        "motor": fb.PrescribedRotation("disc", an.table([0.0, 0.1, 0.2, 0.3], [0, 0.2, 0.1, 0])),
        "path": fb.PrescribedPath("p", lambda t: 0.1 * np.sin(9 * t), lambda t: 0.5 + t**2),
    }  # fmt: skip
    loads = {"g": fb.Gravity(), "s": fb.Spring("p", "m", 50.0, 0.4, damping=0.3),
             "t": fb.TorsionSpring("rack", "disc", 0.2, damping=0.01)}  # fmt: skip
    sensors = {name: fb.Reaction(name) for name in ("P", "guide", "rod", "mesh", "path")}
    sensors |= {"w": fb.Work("motor"), "q": fb.ReactionMoment("motor"), "m": fb.Position("m"),
                "s": fb.SpringForce("s"), "t": fb.SpringMoment("t")}  # fmt: skip
    bodies = {"disc": fb.RigidBody.disc(radius=0.1, width=0.02, density=7800.0), "rack": rack}
    for name, place in (("m", (0.1, -0.4)), ("p", (0.0, 0.5))):
        bodies[name] = fb.PointMass(mass=0.2, position=place)
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


def waves(size, stiffness, profile, rate):
    size, shape = size[:, None], profile(np.linspace(0.0, 1.0, 5)).mean(axis=-1)[:, None]
    phase = rate[:, None] * (1 + 0.03 * size + 0.01 * stiffness[:, None]) * TIMES
    return labelled(np.cos(phase) * shape * np.exp(-0.3 * size), TIMES * np.sin(phase) + size)


def bands(response, inputs, *methods):
    for number, method in enumerate(methods):
        yield f"{type(method).__name__} {number}", fb.propagate(response, inputs, method)


PROFILE = fb.RandomField(1.0, 0.05, correlation_length=1.0, domain=(0.0, 1.0), terms=2)
INPUTS = {"size": fb.Interval(-0.5, 1), "stiffness": fb.Normal(0.5, 0.3), "profile": PROFILE}
SMOOTH, RINGING = INPUTS | {"rate": 1.0}, INPUTS | {"rate": 40.0}
METHODS = (
    fb.PCCI(2, 3), fb.ImprovedPCCI(3, 3), an.RegressionPCCI(3), an.PhaseResolvedPCCI(2, 3),
    an.PerturbationChebyshev(3), fb.LHSScanning(20, 6), fb.MonteCarlo(20, 6), an.SobolScanning(16),
)  # fmt: skip


def paper_study():
    paper, integrator = example("paper/slider_crank"), fb.GeneralizedAlpha(spectral_radius=0.7)
    shortened = {"duration": 0.1, "step": 1e-3, "integrator": integrator}
    response = fb.dynamic_response(paper["slider_crank"], **shortened)
    return fb.Study(response, paper["inputs"], fb.ImprovedPCCI(3, 3)).run()


def adaptive():
    polynomial = fb.AdaptivePCCI(0.05, max_runs=60, phase_resolved=False)
    for inputs in (SMOOTH, RINGING):
        for name, result in bands(waves, inputs, fb.AdaptivePCCI(max_runs=60), polynomial):
            yield f"{name} {inputs['rate']}", result
    for name, duration, step in (("suspension", 0.5, 2e-3), ("four_bar", 0.05, 1e-3)):
        response = fb.dynamic_response(example(name)[name], duration=duration, step=step)
        yield name, fb.Study(response, example(name)["inputs"], fb.AdaptivePCCI(0.02)).run()


def total(**values):
    x = sum(np.sin(k + v) for k, v in enumerate(values.values()))[:, None]
    return labelled(np.exp(0.2 * x) * np.cos(TIMES), x * TIMES)


def distributions():
    part, measured = fb.Interval(0.9, 1.1), an.Samples(np.sin(np.arange(40.0)) + 2)
    normal = fb.Normal(part, cv=0.1), an.LogNormal(1.0, cv=fb.Interval(0.1, 0.2))
    bounded = an.TruncatedNormal(1.0, 0.5, lower=0.4), an.Uniform(0.0, part), part
    shaped = an.Triangular(0.1, 0.15, 0.4), an.Beta(2.0, 5.0, 0.6, 0.9), measured
    others = an.Weibull(1.0, 8.0), an.Gumbel(1.0, cv=0.15), scipy.stats.skewnorm(5.0, scale=0.4)
    for number, given in enumerate((*normal, *bounded, *shaped, *others)):
        both = bands(lambda a: total(a=a), {"a": given}, fb.PCCI(4, 4), fb.LHSScanning(20, 5))
        yield from ((f"{type(given).__name__} {number} {name}", result) for name, result in both)


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
        response = lambda a: labelled(a(TIMES), np.sin(a(TIMES)) ** 2)  # noqa: E731
        yield name, fb.propagate(response, {"a": field}, fb.PCCI(1, 2))


def correlated_and_choices():
    parts = {"front": an.LogNormal(fb.Interval(1, 1.1), cv=0.1), "rear": an.Gumbel(1.0, cv=0.1)}
    inputs = {"springs": an.Correlated(parts, 0.6), "size": fb.Interval(0.9, 1.1)}
    inputs |= {"kind": an.Choice("hard", "soft"), "constant": 1.25}
    methods = fb.PCCI(2, 2), an.RegressionPCCI(2), fb.LHSScanning(20, 4)
    return bands(
        lambda front, rear, size, kind, constant: total(
            a=front, b=rear, c=size, d=np.where(kind == "hard", 1.5, 1.0) * constant
        ),
        inputs,
        *methods,
    )


def crank(length, offset, stiffness, damping):
    angle, length = np.pi * TIMES, length[:, None]
    shake = 2.0 / stiffness[:, None] * np.cos(7 * angle) * np.exp(-damping[:, None] * TIMES)
    return labelled(length * np.sin(angle) + shake, length * np.cos(angle) + offset[:, None])


@cache
def surrogate(name):
    inputs = {"length": fb.Interval(9.9, 10.1), "offset": fb.Interval(-0.05, 0.05)}
    inputs |= {"stiffness": fb.Normal(20.0, 1.0), "damping": an.Uniform(0.2, 0.3)}
    method = fb.ImprovedPCCI(3, 3) if name == "tensor" else an.RegressionPCCI(4)
    an.save_surrogate(fb.expand(crank, inputs, method), "surrogate.npz")
    return an.load_surrogate("surrogate.npz")


AT = {"time": TIMES[:20:5]}
PLACES = {"length": 10 + 0.1 * (PAIR - 1), "offset": PAIR - 1, "stiffness": 20 * PAIR}
NARROW = {"length": fb.Interval(9.98, 10.02), "stiffness": fb.Normal(20.0, 0.5)}
COSTS = {"length": 1.0, "stiffness": an.ReciprocalCost(5.0)}
GRADES = {"length": an.Grades({"fine": (0.02, 9.0), "medium": (0.05, 4.0), "coarse": (0.1, 2.0)})}
LIMITS = an.Limit("X", below=10.2), an.Limit("X", above=-10.3, during=(0.5, 1.5))
TWO_SIDED = an.Limit("Y", above=-11.0, below=10.2)
QUANTITIES = ("Peak", "Trough", "PeakTime", "RootMeanSquare", "Spectrum")
ANSWERS = {  # of surrogates by regression and on a tensor grid
    "bands": lambda r, t: r.bands(2.0),
    "values": lambda r, t: r.evaluate(**PLACES, damping=0.25 * PAIR),
    "narrowed": lambda r, t: r.narrowed(**NARROW).bands(),
    "narrowed tensor": lambda r, t: t.narrowed(**NARROW).bands(),
    "verify": lambda r, t: fb.verify(r, crank, runs=12).verification,
    "verify tensor": lambda r, t: fb.verify(t, crank, runs=12).verification,
    "contributions": lambda r, t: an.contributions(r),
    "shapley": lambda r, t: an.contributions(t, shapley=True, at=AT),
    "sobol": lambda r, t: an.sobol_indices(r, at=AT),
    "tolerance_for": lambda r, t: an.tolerance_for(r, "length", 0.5),
    "quantiles": lambda r, t: an.quantiles(r, [0.05, 0.9], at=AT, samples=1024),
    "p_box": lambda r, t: an.p_box(r, "X", 0.5, samples=1024),
    "value_range": lambda r, t: an.value_range(r),
    "path": lambda r, t: an.path(r, "X", "Y"),
    "path tensor": lambda r, t: an.path(t, "X", "Y", probability=0.99, directions=8),
    "derived": lambda r, t: (
        (name, an.derived(r, getattr(an, name)("X"), samples=2000)) for name in QUANTITIES
    ),
    "magnitude": lambda r, t: an.derived(r, an.Peak(an.Magnitude("X", "Y")), samples=2000),
    "check_limits": lambda r, t: an.check_limits(r, LIMITS),
    "check_limits tensor": lambda r, t: an.check_limits(t, TWO_SIDED, sigmas=2),
    "failure": lambda r, t: an.failure_probability(r, LIMITS[0], seed=3, accuracy=0.1),
    "failure of runs": lambda r, t: an.failure_probability(r, LIMITS, response=crank),
    "allocate": lambda r, t: an.allocate(r, an.Limit("X", below=10.13), COSTS, response=crank),
    "allocate chance": lambda r, t: an.allocate(r, LIMITS[0], COSTS, probability=0.01),
    "allocate grades": lambda r, t: an.allocate(r, an.Limit("X", below=10.25), GRADES),
}


def arrays(name, result):
    """Yield the variables and the numeric attributes of a result, or of several, by name."""
    if not isinstance(result, xr.DataArray | xr.Dataset):
        for part, whole in result:
            yield from arrays(f"{name}/{part}", whole)
        return
    whole = result.to_dataset(name="values") if isinstance(result, xr.DataArray) else result
    values = {name: variable.values for name, variable in whole.variables.items()}
    attributes = {f"attrs {key}": np.asarray(value) for key, value in whole.attrs.items()}
    values |= {key: array for key, array in attributes.items() if array.dtype.kind in "biufc"}
    for key, array in values.items():
        yield f"{name}/{key}", array.astype(str) if array.dtype.kind == "O" else array


def main():
    """Compute the cases, or those that are named, and write a file."""
    file, *names = sys.argv[1:]
    if not Path(fb.__file__).is_relative_to(TREE):
        sys.exit(f"flexband must be that of {TREE}; got {fb.__file__}")
    warnings.simplefilter("ignore")
    mechanics = motions, sensors_and_integrators, joints_and_drives, rest_and_modes, paper_study
    inputs = distributions, fields, correlated_and_choices, adaptive
    cases = {case.__name__: case for case in (*mechanics, *inputs)}
    cases["methods, smooth"] = lambda: bands(waves, SMOOTH, *METHODS)
    cases["methods, ringing"] = lambda: bands(waves, RINGING, *METHODS)
    for name, answer in ANSWERS.items():
        cases[name] = lambda answer=answer: answer(surrogate("regression"), surrogate("tensor"))
    written, times = {}, {}
    for name in names or cases:
        start = time.process_time()
        try:
            written |= dict(arrays(name, cases[name]()))
        except Exception as error:
            traceback.print_exc()
            written[f"{name}/error"] = np.array(f"{type(error).__name__}: {error}")
        times[name] = f"{name} {time.process_time() - start:.1f}"
    print(f"{time.process_time():.1f} s: {', '.join(times.values())}", flush=True)
    np.savez_compressed(file, **written)


if __name__ == "__main__":
    main()
