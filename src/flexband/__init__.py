"""How uncertain is the motion of my machine?

Rigid–flexible mechanisms in the absolute nodal coordinate formulation, tolerances as intervals,
scattered material properties as random fields, and hybrid expansions that propagate both at once.
"""

from importlib import import_module
from typing import TYPE_CHECKING

from flexband.basics.namespaces import lazy_names

__version__: str

if TYPE_CHECKING:
    from flexband import (
        analysis as analysis,
        contact as contact,
        errors as errors,
        execution as execution,
        fields as fields,
        loads as loads,
        methods as methods,
        models as models,
        plot as plot,
        sections as sections,
        sensors as sensors,
    )
    from flexband.analysis.limits.production import production_yield as production_yield
    from flexband.requirements.former_names import Limit as Limit
    from flexband.requirements.requirement import Requirement as Requirement
    from flexband.analysis.verification.verify import verify as verify
    from flexband.mechanics.model.mechanism import Mechanism as Mechanism
    from flexband.mechanics.bodies.beam import Beam as Beam
    from flexband.mechanics.bodies.cable import Cable as Cable
    from flexband.mechanics.bodies.point_mass import PointMass as PointMass
    from flexband.mechanics.bodies.rigid import RigidBody as RigidBody
    from flexband.mechanics.description import describe as describe
    from flexband.mechanics.discretization import discretization_error as discretization_error
    from flexband.mechanics.engine.generalized_alpha import GeneralizedAlpha as GeneralizedAlpha
    from flexband.mechanics.equilibrium import equilibrium as equilibrium
    from flexband.mechanics.joints.compliant import Compliant as Compliant
    from flexband.mechanics.joints.drives import (
        PrescribedPath as PrescribedPath,
        PrescribedRotation as PrescribedRotation,
        PrescribedTravel as PrescribedTravel,
    )
    from flexband.mechanics.joints.gears import Gear as Gear, Rack as Rack
    from flexband.mechanics.joints.joints import (
        Distance as Distance,
        Prismatic as Prismatic,
        Revolute as Revolute,
        Slot as Slot,
        Weld as Weld,
    )
    from flexband.mechanics.loads.force_laws import (
        ForceLaw as ForceLaw,
        ViscousFriction as ViscousFriction,
    )
    from flexband.mechanics.loads.loads import (
        DistributedLoad as DistributedLoad,
        Force as Force,
        Gravity as Gravity,
        Moment as Moment,
    )
    from flexband.mechanics.loads.springs import Spring as Spring, TorsionSpring as TorsionSpring
    from flexband.mechanics.modal import modal_response as modal_response
    from flexband.mechanics.modes import SteadyRotation as SteadyRotation, modes as modes
    from flexband.mechanics.response import dynamic_response as dynamic_response
    from flexband.mechanics.sensors.energies import (
        ElasticEnergy as ElasticEnergy,
        KineticEnergy as KineticEnergy,
        PotentialEnergy as PotentialEnergy,
        Work as Work,
    )
    from flexband.mechanics.sensors.forces import (
        LawState as LawState,
        Reaction as Reaction,
        ReactionMoment as ReactionMoment,
        SpringForce as SpringForce,
        SpringMoment as SpringMoment,
    )
    from flexband.mechanics.sensors.motion import (
        Acceleration as Acceleration,
        Angle as Angle,
        AngularVelocity as AngularVelocity,
        Deflection as Deflection,
        Position as Position,
        Velocity as Velocity,
    )
    from flexband.mechanics.sensors.sections import (
        SectionForces as SectionForces,
        Strain as Strain,
        Stress as Stress,
    )
    from flexband.mechanics.simulate import simulate as simulate
    from flexband.mechanics.static_response import static_response as static_response
    from flexband.mechanics.time_functions.interpolation import table as table
    from flexband.mechanics.time_functions.ramps import ramp as ramp
    from flexband.report.drawing.animate import animate as animate
    from flexband.report.drawing.draw import draw as draw
    from flexband.report.notebook import load_ipython_extension as load_ipython_extension
    from flexband.report.progress import progress_bar as progress_bar
    from flexband.study.comparison import compare as compare
    from flexband.study.exchange.surrogate_of import surrogate_of as surrogate_of
    from flexband.study.run import RunOptions as RunOptions
    from flexband.study.study import Study as Study
    from flexband.uncertainty.adaptive.method import AdaptivePCCI as AdaptivePCCI
    from flexband.uncertainty.inputs.choices import (
        Choice as Choice,
        Compensator as Compensator,
        Sizing as Sizing,
    )
    from flexband.uncertainty.inputs.correlated import Correlated as Correlated
    from flexband.uncertainty.inputs.distribution import Distribution as Distribution
    from flexband.uncertainty.inputs.distributions.bounded import (
        Beta as Beta,
        Triangular as Triangular,
        Uniform as Uniform,
    )
    from flexband.uncertainty.inputs.distributions.extreme_values import (
        Gumbel as Gumbel,
        Weibull as Weibull,
    )
    from flexband.uncertainty.inputs.distributions.normal import (
        LogNormal as LogNormal,
        Normal as Normal,
        TruncatedNormal as TruncatedNormal,
    )
    from flexband.uncertainty.inputs.distributions.samples import Samples as Samples
    from flexband.uncertainty.inputs.distributions.scipy_distribution import (
        ScipyDistribution as ScipyDistribution,
    )
    from flexband.uncertainty.inputs.fields.interval_field import IntervalField as IntervalField
    from flexband.uncertainty.inputs.fields.random_field import RandomField as RandomField
    from flexband.uncertainty.inputs.inputs import Input as Input, Interval as Interval
    from flexband.uncertainty.inputs.play import GuidePlay as GuidePlay, Play as Play
    from flexband.uncertainty.methods.pcci import PCCI as PCCI, ImprovedPCCI as ImprovedPCCI
    from flexband.uncertainty.methods.scanning import (
        LHSScanning as LHSScanning,
        MonteCarlo as MonteCarlo,
    )
    from flexband.uncertainty.propagate import expand as expand, propagate as propagate
    from flexband.uncertainty.surrogates.surrogate_file import (
        load_surrogate as load_surrogate,
        save_surrogate as save_surrogate,
    )
    from flexband.uncertainty.surrogates.surrogate import Surrogate as Surrogate
else:
    __all__, _public_name, _names = lazy_names(__name__, __file__)

    def __getattr__(name):
        if name == "__version__":
            return import_module("importlib.metadata").version("flexband")
        return _public_name(name)

    def __dir__():
        return [*_names(), "__version__"]
