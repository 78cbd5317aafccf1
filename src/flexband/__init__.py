"""How uncertain is the motion of my machine.

Rigid–flexible mechanisms in the absolute nodal coordinate formulation, tolerances as intervals,
scattered material as random fields, and the hybrid expansions that propagate both at once.
"""

from __future__ import annotations

from importlib import import_module
from importlib.metadata import version
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from flexband.errors import AssemblyError, InputError, SimulationError
    from flexband.mechanics.beam import Beam
    from flexband.mechanics.bodies import PointMass, RigidBody
    from flexband.mechanics.cable import Cable
    from flexband.mechanics.drives import PrescribedPath, PrescribedRotation, PrescribedTravel
    from flexband.mechanics.energy_sensors import (
        ElasticEnergy,
        KineticEnergy,
        PotentialEnergy,
        Work,
    )
    from flexband.mechanics.equilibrium import equilibrium
    from flexband.mechanics.force_laws import ForceLaw, TorsionSpring, ViscousFriction
    from flexband.mechanics.force_sensors import Reaction, ReactionMoment, SpringForce, SpringMoment
    from flexband.mechanics.gears import Gear, Rack
    from flexband.mechanics.generalized_alpha import GeneralizedAlpha
    from flexband.mechanics.integration import FullIntegration, SelectiveIntegration
    from flexband.mechanics.joints import Distance, Prismatic, Revolute, Slot, Weld
    from flexband.mechanics.loads import DistributedLoad, Force, Gravity, Moment, Spring
    from flexband.mechanics.mechanism import Mechanism
    from flexband.mechanics.modes import modes
    from flexband.mechanics.response import dynamic_response
    from flexband.mechanics.section_sensors import SectionForces, Strain, Stress
    from flexband.mechanics.sections import Circle, GeneralSection, Rectangle
    from flexband.mechanics.sensors import (
        Acceleration,
        Angle,
        AngularVelocity,
        Deflection,
        Position,
        Velocity,
    )
    from flexband.mechanics.simulate import simulate
    from flexband.report.drawing import draw
    from flexband.study.study import Study
    from flexband.uncertainty.adaptive import AdaptivePCCI
    from flexband.uncertainty.correlation import exponential, squared_exponential
    from flexband.uncertainty.inputs import Interval, Normal, RandomField, Uniform
    from flexband.uncertainty.methods import PCCI, ImprovedPCCI, LHSScanning, MonteCarlo
    from flexband.uncertainty.phase_resolved import PhaseResolvedPCCI
    from flexband.uncertainty.propagate import expand, propagate
    from flexband.uncertainty.surrogate import Surrogate
    from flexband.uncertainty.surrogate_files import load_surrogate, save_surrogate
    from flexband.uncertainty.verification import verify

_MODULES = {
    "errors": ["AssemblyError", "InputError", "SimulationError"],
    "mechanics.beam": ["Beam"],
    "mechanics.cable": ["Cable"],
    "mechanics.bodies": ["PointMass", "RigidBody"],
    "mechanics.drives": ["PrescribedPath", "PrescribedRotation", "PrescribedTravel"],
    "mechanics.equilibrium": ["equilibrium"],
    "mechanics.generalized_alpha": ["GeneralizedAlpha"],
    "mechanics.integration": ["FullIntegration", "SelectiveIntegration"],
    "mechanics.joints": ["Distance", "Prismatic", "Revolute", "Slot", "Weld"],
    "mechanics.loads": ["DistributedLoad", "Force", "Gravity", "Moment", "Spring"],
    "mechanics.mechanism": ["Mechanism"],
    "mechanics.modes": ["modes"],
    "mechanics.response": ["dynamic_response"],
    "mechanics.force_sensors": ["Reaction", "ReactionMoment", "SpringForce", "SpringMoment"],
    "mechanics.sensors": [
        "Acceleration",
        "Angle",
        "AngularVelocity",
        "Deflection",
        "Position",
        "Velocity",
    ],
    "mechanics.simulate": ["simulate"],
    "study.study": ["Study"],
    "uncertainty.correlation": ["exponential", "squared_exponential"],
    "uncertainty.inputs": ["Interval", "Normal", "RandomField", "Uniform"],
    "uncertainty.methods": ["PCCI", "ImprovedPCCI", "LHSScanning", "MonteCarlo"],
    "uncertainty.propagate": ["expand", "propagate"],
    "mechanics.sections": ["Circle", "GeneralSection", "Rectangle"],
    "mechanics.energy_sensors": ["ElasticEnergy", "KineticEnergy", "PotentialEnergy", "Work"],
    "mechanics.section_sensors": ["SectionForces", "Strain", "Stress"],
    "mechanics.force_laws": ["ForceLaw", "TorsionSpring", "ViscousFriction"],
    "mechanics.gears": ["Gear", "Rack"],
    "report.drawing": ["draw"],
    "uncertainty.phase_resolved": ["PhaseResolvedPCCI"],
    "uncertainty.adaptive": ["AdaptivePCCI"],
    "uncertainty.surrogate": ["Surrogate"],
    "uncertainty.surrogate_files": ["load_surrogate", "save_surrogate"],
    "uncertainty.verification": ["verify"],
}
_HOME = {name: module for module, names in _MODULES.items() for name in names}

__version__ = version("flexband")
__all__ = [
    "PCCI",
    "Acceleration",
    "AdaptivePCCI",
    "Angle",
    "AngularVelocity",
    "AssemblyError",
    "Beam",
    "Cable",
    "Circle",
    "Deflection",
    "Distance",
    "DistributedLoad",
    "ElasticEnergy",
    "Force",
    "ForceLaw",
    "FullIntegration",
    "Gear",
    "GeneralSection",
    "GeneralizedAlpha",
    "Gravity",
    "ImprovedPCCI",
    "InputError",
    "Interval",
    "KineticEnergy",
    "LHSScanning",
    "Mechanism",
    "Moment",
    "MonteCarlo",
    "Normal",
    "PhaseResolvedPCCI",
    "PointMass",
    "Position",
    "PotentialEnergy",
    "PrescribedPath",
    "PrescribedRotation",
    "PrescribedTravel",
    "Prismatic",
    "Rack",
    "RandomField",
    "Reaction",
    "ReactionMoment",
    "Rectangle",
    "Revolute",
    "RigidBody",
    "SectionForces",
    "SelectiveIntegration",
    "SimulationError",
    "Slot",
    "Spring",
    "SpringForce",
    "SpringMoment",
    "Strain",
    "Stress",
    "Study",
    "Surrogate",
    "TorsionSpring",
    "Uniform",
    "Velocity",
    "ViscousFriction",
    "Weld",
    "Work",
    "draw",
    "dynamic_response",
    "equilibrium",
    "expand",
    "exponential",
    "load_surrogate",
    "modes",
    "propagate",
    "save_surrogate",
    "simulate",
    "squared_exponential",
    "verify",
]


def __getattr__(name: str) -> object:
    if name not in _HOME:
        raise AttributeError(f"module 'flexband' has no attribute {name!r}")
    value = getattr(import_module(f"flexband.{_HOME[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*__all__, "__version__"])
