"""One sample of a mechanism at its assembled start, in which forms are evaluated."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from flexband.basics.checks import check_instance, check_integer
from flexband.basics.user_functions import evaluate_function
from flexband.basics.warning import without_warnings
from flexband.errors import ResolutionWarning
from flexband.mechanics.assembly.packing import AT_START, pack
from flexband.mechanics.assembly.system import assemble
from flexband.mechanics.bodies.properties import Property
from flexband.mechanics.engine.batch import begin
from flexband.mechanics.engine.failures import raise_failures
from flexband.mechanics.engine.threads import while_compiling
from flexband.mechanics.kernels.forms import Form, Vector
from flexband.mechanics.loads.load import InTime
from flexband.mechanics.model.mechanism import Mechanism


@dataclass(frozen=True)
class Configuration:
    """The state z of one sample at time zero, shape (rows,); see `kernels.state`."""

    sample: int
    z: np.ndarray

    def value(self, form: Form) -> float:
        """Return the value of a form."""
        return self.number(form.at([*self.z]))

    def vector(self, vector: Vector) -> np.ndarray:
        """Return the X and Y components of a vector, shape (2,)."""
        return np.array([self.value(form) for form in vector])

    def number(self, value: InTime) -> float:
        """Return this sample's value of a parameter, at time zero if it is a function."""
        values = np.ravel(np.asarray(evaluate_function(value, 0.0) if callable(value) else value))
        return float(values[min(self.sample, len(values) - 1)])

    def along(self, value: Property, x: np.ndarray) -> np.ndarray:
        """Return this sample's values of a property at positions x [m], both of shape (points,)."""
        if not callable(value):
            return np.full(len(x), self.number(value))
        values = np.atleast_2d(np.asarray(value(x), dtype=float))
        return np.broadcast_to(values[min(self.sample, len(values) - 1)], x.shape)


def assembled_configuration(mechanism: Mechanism, sample: int = 0) -> Configuration:
    """Return the configuration in which a sample starts, with its constraints met."""
    check_instance("mechanism", mechanism, Mechanism)
    with without_warnings(ResolutionWarning):  # the start needs no fine elements
        system = assemble(mechanism)
    sample = check_integer("sample", sample, 0, system.samples - 1)
    failures = np.zeros((system.samples, 4))
    values = pack(system, AT_START, np.array([sample]))(0)
    work, failure = while_compiling(lambda: begin(system, values))
    failures[sample] = failure[:, 0]
    raise_failures(failures, system, np.zeros(1))
    return Configuration(sample, work.z[:, 0].copy())


def given_configuration(mechanism: Mechanism, sample: int = 0) -> Configuration:
    """Return the configuration that the bodies of a sample state, in which joints may be open."""
    with without_warnings(ResolutionWarning):
        system = assemble(mechanism)
    z = np.zeros(system.structure.state.rows)
    z[: len(system.nominal_start)] = system.nominal_start[
        :, min(sample, system.nominal_start.shape[1] - 1)
    ]
    return Configuration(sample, z)
