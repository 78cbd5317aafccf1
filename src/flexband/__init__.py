"""How uncertain is the motion of my machine?

Rigid–flexible mechanisms in the absolute nodal coordinate formulation, tolerances as intervals,
scattered material properties as random fields, and hybrid expansions that propagate both at once.
"""

from __future__ import annotations

import ast
from difflib import get_close_matches
from importlib import import_module
from typing import TYPE_CHECKING

# The public names. Type checkers read these imports; at run time `__getattr__` imports a name's
# module when the name is first used, so that `import flexband` itself loads nothing heavy.
if TYPE_CHECKING:
    import flexband.report.plot as plot  # noqa: PLR0402
    from flexband.analysis.allocation.allocate import allocate
    from flexband.analysis.allocation.costs import ReciprocalCost
    from flexband.analysis.allocation.grades import Grades
    from flexband.analysis.derivation import derived
    from flexband.analysis.limits import Limit
    from flexband.analysis.margins import check_limits
    from flexband.analysis.p_boxes import p_box
    from flexband.analysis.paths import path
    from flexband.analysis.probability.failure import failure_probability
    from flexband.analysis.quantile_bounds import quantiles
    from flexband.analysis.quantities import (
        Magnitude,
        Peak,
        PeakTime,
        RootMeanSquare,
        Spectrum,
        Trough,
    )
    from flexband.analysis.sensitivity.contributions import contributions
    from flexband.analysis.sensitivity.sobol import sobol_indices
    from flexband.analysis.sensitivity.tolerance_for import tolerance_for
    from flexband.analysis.value_ranges import value_range
    from flexband.analysis.verification.verify import verify
    from flexband.errors import (
        AssemblyError,
        FlexbandWarning,
        InputError,
        ResolutionWarning,
        RunError,
        RunsNeeded,
        SimulationError,
        StoreError,
        StrainWarning,
        ToleranceWarning,
    )
    from flexband.execution.dask import Dask
    from flexband.execution.processes import Processes
    from flexband.execution.store import Store, open_runs
    from flexband.mechanics.assembly.mechanism import Mechanism
    from flexband.mechanics.bodies.beam import Beam
    from flexband.mechanics.bodies.cable import Cable
    from flexband.mechanics.bodies.point_mass import PointMass
    from flexband.mechanics.bodies.rigid import RigidBody
    from flexband.mechanics.bodies.section_stiffness import FullIntegration, SelectiveIntegration
    from flexband.mechanics.bodies.sections import Circle, GeneralSection, Rectangle
    from flexband.mechanics.description import describe
    from flexband.mechanics.discretization import discretization_error
    from flexband.mechanics.engine.generalized_alpha import GeneralizedAlpha
    from flexband.mechanics.equilibrium import equilibrium
    from flexband.mechanics.joints.drives import (
        PrescribedPath,
        PrescribedRotation,
        PrescribedTravel,
    )
    from flexband.mechanics.joints.gears import Gear, Rack
    from flexband.mechanics.joints.joints import Distance, Prismatic, Revolute, Slot, Weld
    from flexband.mechanics.loads.force_laws import ForceLaw, ViscousFriction
    from flexband.mechanics.loads.loads import DistributedLoad, Force, Gravity, Moment
    from flexband.mechanics.loads.springs import Spring, TorsionSpring
    from flexband.mechanics.modal import modal_response
    from flexband.mechanics.modes import SteadyRotation, modes
    from flexband.mechanics.response import dynamic_response
    from flexband.mechanics.sensors.energies import (
        ElasticEnergy,
        KineticEnergy,
        PotentialEnergy,
        Work,
    )
    from flexband.mechanics.sensors.forces import (
        Reaction,
        ReactionMoment,
        SpringForce,
        SpringMoment,
    )
    from flexband.mechanics.sensors.motion import (
        Acceleration,
        Angle,
        AngularVelocity,
        Deflection,
        Position,
        Velocity,
    )
    from flexband.mechanics.sensors.sections import SectionForces, Strain, Stress
    from flexband.mechanics.simulate import simulate
    from flexband.mechanics.static_response import static_response
    from flexband.mechanics.time_functions.interpolation import table
    from flexband.models.external_runs import elsewhere
    from flexband.models.fmu import FMU
    from flexband.models.functions import samplewise
    from flexband.models.one_by_one import ModelError
    from flexband.models.program import ExternalProgram
    from flexband.models.umbridge_client import UMBridgeModel
    from flexband.models.umbridge_server import UMBridgeServer, serve
    from flexband.report.drawing.draw import draw
    from flexband.report.notebook import load_ipython_extension
    from flexband.report.progress import progress_bar
    from flexband.study.comparison import compare
    from flexband.study.run import RunOptions
    from flexband.study.study import Study
    from flexband.uncertainty.adaptive.method import AdaptivePCCI
    from flexband.uncertainty.inputs.choices import Choice, Compensator, Sizing
    from flexband.uncertainty.inputs.correlated import Correlated
    from flexband.uncertainty.inputs.distribution import Distribution
    from flexband.uncertainty.inputs.distributions.bounded import Beta, Triangular, Uniform
    from flexband.uncertainty.inputs.distributions.extremes import Gumbel, Weibull
    from flexband.uncertainty.inputs.distributions.normal import LogNormal, Normal, TruncatedNormal
    from flexband.uncertainty.inputs.distributions.samples import Samples
    from flexband.uncertainty.inputs.distributions.scipy_distribution import ScipyDistribution
    from flexband.uncertainty.inputs.fields.correlation import (
        Matern,
        exponential,
        squared_exponential,
        triangular,
    )
    from flexband.uncertainty.inputs.fields.eole import eole
    from flexband.uncertainty.inputs.fields.field import Field
    from flexband.uncertainty.inputs.fields.galerkin import karhunen_loeve, orthogonal_series
    from flexband.uncertainty.inputs.fields.interval_field import IntervalField
    from flexband.uncertainty.inputs.fields.random_field import RandomField
    from flexband.uncertainty.inputs.inputs import Input, Interval
    from flexband.uncertainty.methods.least_squares import RegressionPCCI
    from flexband.uncertainty.methods.pcci import PCCI, ImprovedPCCI
    from flexband.uncertainty.methods.perturbation import PerturbationChebyshev
    from flexband.uncertainty.methods.scanning import LHSScanning, MonteCarlo, SobolScanning
    from flexband.uncertainty.phase_resolved.method import PhaseResolvedPCCI
    from flexband.uncertainty.propagate import expand, propagate
    from flexband.uncertainty.surrogates.files import load_surrogate, save_surrogate
    from flexband.uncertainty.surrogates.surrogate import Surrogate

with open(__file__, "rb") as _source:
    _MODULES = {
        alias.name: node.module
        for node in ast.walk(ast.parse(_source.read()))
        if isinstance(node, ast.ImportFrom) and node.module and node.module.startswith("flexband.")
        for alias in node.names
    }
__version__: str
__all__ = sorted(_MODULES)  # pyright: ignore[reportUnsupportedDunderAll]


def __getattr__(name: str) -> object:
    if name == "__version__":
        value = import_module("importlib.metadata").version("flexband")
    elif name == "plot":
        value = import_module("flexband.report.plot")
    elif name in _MODULES:
        value = getattr(import_module(_MODULES[name]), name)
    else:
        near = get_close_matches(name, __all__, 1)
        hint = f"; did you mean {near[0]!r}?" if near else ""
        raise AttributeError(f"module 'flexband' has no attribute {name!r}{hint}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return [*__all__, "__version__", "plot"]
