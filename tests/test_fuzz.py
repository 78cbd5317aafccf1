"""Every public class and function, given what it is not made for: `InputError`, or a right result.

The names and their parameters are read from the package, so that new ones are tested as well.
"""

import inspect
import os
import random
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import pytest
import xarray as xr
from matplotlib.figure import Figure

import flexband as fb
from flexband.mechanics.bodies.body import Body
from flexband.mechanics.joints.joint import Joint
from flexband.mechanics.loads.load import Load
from flexband.mechanics.sensors.motion import Sensor
from tests.public_names import PUBLIC

REFUSAL = (
    fb.errors.InputError,
    fb.errors.AssemblyError,
    fb.errors.SimulationError,
    fb.errors.StoreError,
)


def nothing(t, x, v, p, force):
    """A force law."""


def fading(t, x, v, s, p, force, rate):
    """A force law with a state."""
    rate[0] = -s[0]


def mechanism(**parts):
    bodies = {
        "r": fb.RigidBody(mass=1.0, inertia=1.0, points={"tip": (1.0, 0.0)}),
        "m": fb.PointMass(mass=1.0),
        "c": fb.Cable(
            length=1.0, mass_per_length=1.0, axial_stiffness=1.0, bending_stiffness=1.0, elements=1
        ),
        "b": fb.Beam(
            length=1.0, width=0.1, height=0.1, density=1.0, youngs_modulus=1e4, poissons_ratio=0.3,
            elements=1,
        ),
    }  # fmt: skip
    all_parts = {
        "joints": {
            "pin": fb.Revolute("r", (0.0, 0.0)),
            "hold": fb.Weld("b.start", (0.0, 0.0)),
        },
        "loads": {
            "spring": fb.Spring("r.tip", (2.0, 0.0)),
            "torsion": fb.TorsionSpring("r", "b.start", stiffness=1.0),
            "fading": fb.ForceLaw(["r"], fading, states={"s": 1.0}),
        },
        "sensors": {"tip": fb.Position("r.tip")},
    }
    return fb.Mechanism(bodies=bodies | parts.pop("bodies", {}), **all_parts | parts)


def same(a):
    """Return a number, the sum of a pair, or a field's value in the middle of the domain."""
    return a(np.array([0.5]))[:, 0] if callable(a) else np.sum(np.atleast_2d(a), axis=0)


def response(a, b):
    return np.stack([a, a * b], axis=1)


def moving(a, b):
    values = np.stack([a, a * b], axis=1)[:, :, None] * np.ones(3)
    return xr.DataArray(values, {"output": ["x", "y"]}, ("sample", "output", "time"))


@dataclass(frozen=True)
class Made:
    """A value that is made when a test needs it: every process collects all tests."""

    make: Callable

    @cached_property
    def value(self):
        return self.make()


STUDY = {"a": fb.Interval(1.0, 2.0), "b": fb.Normal(0.0, 1.0)}
BOX = fb.expand(response, {"a": fb.Interval(1.0, 2.0), "b": 1.0}, fb.PCCI(1, 1))
GOOD = {
    "first": "r.tip", "second": (0.0, 1.0), "point": "r.tip", "points": ["r.tip"],
    "axis": (1.0, 0.0),
    "joint": "pin", "spring": "spring", "body": "c", "beam": "c", "part": "pin", "place": "0.5",
    "law": nothing, "parameters": (1.0,), "angle": 0.0, "travel": np.sin, "x": 0.0, "y": 0.0,
    "elements": 1, "bodies": {"m": fb.PointMass(mass=1.0)}, "mechanism": Made(mechanism),
    "duration": 0.1, "step": 0.05, "count": 1, "builder": mechanism, "response": response,
    "inputs": STUDY, "method": fb.PCCI(1, 1), "lower": 0.0, "upper": 1.0, "mean": 1.0,
    "vertices": [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)], "file": "surrogate.npz",
    "poissons_ratio": 0.3, "surrogate": fb.expand(response, STUDY, fb.PCCI(1, 1)),
    "requirements": fb.Requirement("response", below=5.0),
}  # fmt: skip
OWN = {
    ("PrescribedRotation", "angle"): lambda t: 0.0,
    ("PrescribedPath", "x"): np.sin,
    ("PrescribedPath", "y"): np.cos,
    ("Beam", "height"): 0.1,
    ("Choice", "other"): 2.0,
    ("Requirement", "name"): "stroke",
    ("Requirement", "below"): 1.0,
    ("Capability", "cp"): 1.33,
    ("Probability", "at_most"): 1e-3,
    ("ShareOfParts", "at_most"): 1e-3,
    ("production_yield", "surrogate"): BOX,
    ("production_yield", "scatter"): {"a": fb.Uniform(1.0, 2.0)},
    ("Store", "folder"): "runs",
    ("surrogate_of", "table"): {
        "a": np.linspace(1.0, 2.0, 12),
        "b": np.sin(np.arange(12.0)),
        "u": np.arange(12.0),
    },
    ("Correlated", "inputs"): {"a": fb.Normal(0.0, 1.0), "b": fb.Uniform(0.0, 1.0)},
    ("Correlated", "correlation"): 0.5,
    ("ExternalProgram", "command"): ["echo", "${length}"],
    ("ExternalProgram", "read"): np.zeros,
    **{(name, "std"): 0.5 for name in ("Gumbel", "LogNormal", "Normal", "TruncatedNormal")},
    ("LogNormal", "mean"): 1.0,
    ("Interval", "percent"): 3.0,
    **{(name, "order"): 2 for name in ("PCCI", "ImprovedPCCI", "PhaseResolvedPCCI")},
    ("Samples", "values"): np.sin(np.arange(9.0)),
    ("ScipyDistribution", "distribution"): "norm",
    ("ScipyDistribution", "parameters"): (("loc", 2.0),),
    ("IntervalField", "domain"): (0.0, 1.0),
    ("RandomField", "domain"): (0.0, 1.0),
    ("ReactionMoment", "joint"): "hold",
    ("SpringMoment", "spring"): "torsion",
    ("Stress", "body"): "b",
    ("LawState", "load"): "fading",
    ("LawForce", "load"): "fading",
    ("Compliant", "joint"): fb.Revolute("r.tip", (1.0, 0.0)),
    ("Compliant", "stiffness"): 1e4,
    ("Switched", "joint"): fb.Revolute("r.tip", (1.0, 0.0)),
    ("Switched", "active"): lambda t: t > 0.05,
    ("FreeStrain", "member"): "c",
    ("FreeCurvature", "member"): "c",
    ("Bushing", "stiffness"): (1.0, 1.0, 1.0),
    ("Characteristic", "force"): (1.0, 2.0),
    ("Characteristic", "place"): (0.0, 1.0),
    ("LawState", "state"): "s",
    **{(name, "sensor"): fb.Position("r.tip") for name in fb.sensors.__all__},
    ("Average", "window"): 0.1,
    **{
        (name, "law"): fb.contact.KeepsRestitution(stiffness=1e3, restitution=0.5)
        for name in ("Contact", "Stop", "AngularStop")
    },
    ("Contact", "geometry"): fb.contact.CircleOnLine(),
    ("Contact", "second"): (0.0, -1.0),
    ("Stop", "upper"): 5.0,
    ("AngularStop", "upper"): 2.0,
    ("CircleOnCircle", "radii"): (0.1, 0.2),
    ("CircleInCircle", "radii"): (0.1, 0.2),
    ("hertz_stiffness", "radii"): (0.1, 0.2),
    ("hertz_stiffness", "youngs_moduli"): (2e11, 2e11),
    ("hertz_stiffness", "poissons_ratios"): (0.3, 0.3),
    ("samplewise", "function_of_one"): max,
    ("OverOutput", "output"): "angle",
    ("OverOutput", "values"): [0.0, 1.0],
    ("table", "times"): (0.0, 1.0),
    ("table", "values"): (0.0, 1.0),
    ("Magnitude", "first"): "x",
    ("Magnitude", "second"): "y",
    ("derived", "quantity"): np.abs,
    ("path", "surrogate"): fb.expand(moving, STUDY, fb.PCCI(1, 1)),
    ("path", "x"): "x",
    ("path", "y"): "y",
    ("derived", "samples"): 64,
    ("predictability_horizon", "points"): 2,
    ("predictability_horizon", "change"): 1e-3,
    ("sample_parts", "samples"): 4,
    ("sample_parts", "probabilities"): (0.5,),
    **{("sample_parts", name): 0.5 for name in ("confidence", "accuracy")},
    ("derived", "probability"): 0.5,
    ("modal_response", "modes"): 1,
    ("modal_response", "nominal"): {},
    ("p_box", "at"): {"dim_1": 0},
    ("allocate", "costs"): {"a": 1.0},
    ("allocate", "surrogate"): BOX,
    ("Grades", "grades"): {"fine": (0.1, 2.0)},
    ("Grades", "costs"): {"IT7": 2.0},
    ("Grades", "size"): 0.1,
    **{(name, "samples"): 256 for name in ("p_box", "quantiles")},
    ("value_range", "probability"): 0.9,
    ("tolerance_for", "name"): "a",
    ("elsewhere", "name"): "a",
    ("elsewhere", "outputs"): ["y"],
    ("elsewhere", "times"): (0.0, 1.0),
    **{("Weibull", name): 2.0 for name in ("scale", "shape")},
    **{("Beta", name): 2.0 for name in ("alpha", "beta")},
    **{
        (name, parameter): value
        for name in ("eole", "karhunen_loeve", "orthogonal_series")
        for parameter, value in (
            ("correlation", fb.fields.exponential),
            ("domain", (0.0, 1.0)),
            ("nodes", 5),
        )
    },
    ("Beam", "width"): 0.1,
    ("Weld", "axis"): False,
    ("RigidBody", "points"): {},
    ("Beam", "path"): [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)],
    ("Cable", "path"): lambda u: np.stack([u, u * u], axis=1),
}
COMPARED = Made(
    lambda: fb.compare(fb.Study(response, STUDY, fb.PCCI(1, 1)), fb.PCCI(1, 1), [fb.PCCI(1, 2)])
)
FIELD = fb.RandomField(1.0, 0.1, correlation_length=1.0, domain=(0.0, 1.0))
OWN |= {
    ("plot_bands", "bands"): Made(lambda: COMPARED.value[0].bands.isel(dim_1=0)),
    ("plot_bounds", "found"): Made(lambda: COMPARED.value[0].bands),
    ("plot_bounds", "variable"): "mean",
    ("plot_comparison", "results"): Made(lambda: {"a": COMPARED.value[0].bands}),
    ("plot_contributions", "found"): Made(lambda: fb.analysis.contributions(GOOD["surrogate"])),
    ("plot_deviations", "bands"): Made(lambda: COMPARED.value[0].bands),
    ("plot_errors", "results"): COMPARED,
    ("plot_field", "field"): FIELD,
    ("plot_margins", "found"): Made(
        lambda: fb.analysis.check_requirements(GOOD["surrogate"], GOOD["requirements"])
    ),
    ("plot_p_box", "found"): Made(
        lambda: fb.analysis.p_box(GOOD["surrogate"], at={"dim_1": 0}, samples=256)
    ),
    ("plot_path", "found"): Made(lambda: fb.analysis.path(OWN["path", "surrogate"], "x", "y")),
    ("plot_probability", "found"): Made(
        lambda: fb.analysis.failure_probability(GOOD["surrogate"], GOOD["requirements"])
    ),
    ("plot_response", "response"): xr.DataArray(np.ones(3), dims="time"),
    ("plot_tolerances", "found"): Made(
        lambda: fb.analysis.allocate(BOX, fb.Requirement("response", below=2.5), {"a": 1.0})
    ),
    ("plot_variance_error", "fields"): {"E": FIELD},
    ("animate", "file"): "motion.gif",
    ("animate", "points"): ["tip", "b.end"],
    ("animate", "dpi"): 30.0,
    ("compare", "study"): fb.Study(response, STUDY, fb.PCCI(1, 1)),
    ("compare", "reference"): fb.PCCI(1, 2),
    ("compare", "methods"): [fb.PCCI(1, 1)],
    **{(f"plot_{name}", "ax"): Figure().subplots() for name in fb.plot.__all__},
}
FROM_PATH = {"length", "start", "angle", "curvature"}
MOTION = {"points", "position", "angle", "velocity", "rate"}
NUMBERS = [0, 1, -1, 2.5, 1e-300, 1e300, -1e300, 10**400, np.nan, np.inf, -np.inf, True]
ARRAYS = [
    np.zeros(0), np.ones(1), np.ones(3), np.ones((2, 2)), np.array(1.0), np.array("x"),
    np.array([1, 2j]), np.array([None, 1.0]), np.ma.array([1.0, 2.0], mask=[0, 1]),
    np.array(["2020-01-01"], dtype="datetime64[D]"), np.timedelta64(1, "s"), np.float32(1.5),
]  # fmt: skip
OBJECTS = [
    None, "", "x", "r.tip", "nan", "1", b"1", 1j, (), [], {}, {1.0}, (1.0, 2.0), [1.0, "x"],
    [[1.0]],
    {"a": 1}, {1: 2.0}, {"m": fb.PointMass(mass=1.0)}, object(), float, fb.Force, fb.PCCI(1, 1),
    fb.Force("m", 1.0), fb.Interval(0.0, 1.0), fb.RigidBody(mass=1.0, inertia=1.0),
    lambda *a, **k: None, lambda *a, **k: "x", lambda *a, **k: np.ones(7),
    lambda *a, **k: np.nan, iter([]), slice(None), NotImplemented, ...,
]  # fmt: skip
FOREIGN = {
    "Dask", "FMU", "Surrogate", "UMBridgeModel", "UMBridgeServer", "load_ipython_extension",
    "load_surrogate", "open_runs", "serve", "Gap", "ContactForce", "Contacts", "FrictionForce",
    "SwitchingLoss",
}  # fmt: skip
"""What takes a file, a server, another program's object, the parts of a surrogate, or a contact."""

VALUES = (NUMBERS, ARRAYS, OBJECTS)
SEED = os.environ.get("FUZZ_SEED", "")
"""Another one draws other values: ``FUZZ_SEED=1 pytest tests/test_fuzz.py``."""


def callables():
    """Yield the name and the object of everything public that can be called."""
    for name, public in PUBLIC.items():
        if isinstance(public, type) and (
            issubclass(public, Exception) or inspect.isabstract(public)
        ):
            continue
        yield name, public
        if isinstance(public, type):
            for attribute, member in inspect.getmembers(public):
                kind = inspect.getattr_static(public, attribute)
                if not attribute.startswith("_") and isinstance(kind, staticmethod | classmethod):
                    yield f"{name}.{attribute}", member


def choice(option, other):
    """Return a choice, whose parameters have no names."""
    return fb.Choice(option, other)


def magnitude(first, second):
    """Return the magnitude of two components, which have no names."""
    return fb.analysis.Magnitude(first, second)


def elsewhere(name, outputs, times):
    """Return a model that runs elsewhere, whose inputs have no names."""
    return fb.models.elsewhere(name, outputs=outputs, times=times)


CALLABLES = (
    dict(callables())
    | {"Choice": choice, "elsewhere": elsewhere, "Magnitude": magnitude}
    | {f"plot_{name}": getattr(fb.plot, name) for name in fb.plot.__all__}
)


def parameters(name):
    """Return the parameters of a public object that have a name, those of `**named` included."""
    by_name = dict(inspect.signature(CALLABLES[name]).parameters)
    of_class = inspect.signature(PUBLIC.get(name.partition(".")[0], CALLABLES[name])).parameters
    if by_name.pop("motion", None):
        by_name |= {k: p for k, p in of_class.items() if k in MOTION}
    if by_name.pop("properties", None):
        by_name |= {k: p for k, p in of_class.items() if k not in FROM_PATH}
    assert not [p for p in by_name.values() if p.kind in (p.VAR_KEYWORD, p.VAR_POSITIONAL)]
    return list(by_name.values())


def usual(name):
    """Return arguments that are fine, as far as the names of the parameters tell."""
    arguments = {}
    for parameter in parameters(name):
        value = OWN.get((name.partition(".")[0], parameter.name))
        if value is None and parameter.default is parameter.empty:
            value = GOOD.get(parameter.name, 1.0)
        if value is not None:
            arguments[parameter.name] = value.value if isinstance(value, Made) else value
    return arguments


def use(part):
    """Put a part into a mechanism and run it."""
    for kind, kinds in ((Body, "bodies"), (Joint, "joints"), (Sensor, "sensors"), (Load, "loads")):
        if isinstance(part, kind):
            motion = fb.simulate(mechanism(**{kinds: {"it": part}}), duration=0.02, step=0.01)
            assert np.isfinite(motion.values).all()
            return
    if isinstance(part, fb.Input):
        fb.propagate(same, {"a": part}, fb.PCCI(1, 1))


def attempt(name, arguments):
    """Call a public object; return what is wrong with how it refuses, or None."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.simplefilter("ignore", fb.errors.FlexbandWarning)
        warnings.simplefilter("ignore", DeprecationWarning)
        warnings.simplefilter("ignore", RuntimeWarning)  # numbers that overflow
        try:
            use(CALLABLES[name](**arguments))
        except REFUSAL:
            return None
        except Exception as error:
            return f"{name}({arguments}) raised {type(error).__name__}: {error}"
    return None


@pytest.mark.parametrize("name", [name for name in CALLABLES if name not in FOREIGN])
def test_the_usual_arguments_are_fine(name, tmp_path, monkeypatch):
    """Otherwise they are refused before what is drawn is looked at."""
    monkeypatch.chdir(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", fb.errors.FlexbandWarning)
        use(CALLABLES[name](**usual(name)))


@pytest.mark.parametrize("name", CALLABLES)
def test_nothing_but_an_input_error_comes_out(name, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    names = [p.name for p in parameters(name)]
    if not names:
        return

    rng = random.Random(name + SEED)
    for _ in range(6 + 2 * len(names)):
        selection = rng.sample(names, min(len(names), rng.choice((1, 2))))
        changes = {option: rng.choice(rng.choice(VALUES)) for option in selection}
        assert attempt(name, {**usual(name), **changes}) is None


FLAGS = [(k, p.name) for k in CALLABLES for p in parameters(k) if isinstance(p.default, bool)]


@pytest.mark.parametrize(("name", "flag"), [k for k in FLAGS if k[1] != "elements_left_out"])
def test_flags_are_true_or_false(name, flag, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    surrogate = fb.expand(lambda a: 2.0 * a, {"a": fb.Interval(0.0, 1.0)}, fb.PCCI(0, 1))
    fb.save_surrogate(surrogate, "surrogate.npz")
    for value in (np.ones(3), 1, None, "no"):
        with pytest.raises(fb.errors.InputError, match=f"{flag} must be True or False"):
            CALLABLES[name](**usual(name) | {flag: value})
    CALLABLES[name](**usual(name) | {flag: np.False_})


@pytest.mark.parametrize("name", ["modes", "modal_response"])
def test_a_state_to_linearize_about_is_given_by_its_name(name):
    with pytest.raises(fb.errors.InputError, match=r"about must be 'start'.* '.*'; got"):
        CALLABLES[name](**usual(name) | {"about": np.ones(3)})
