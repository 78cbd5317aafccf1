"""The rounding errors of outputs that are zero in theory.

Coordinates are rounded to their digits. What is computed from them over a step h has these errors
divided by h, accelerations by h², and inertia and stiffness make forces of them.
"""

from __future__ import annotations

import numpy as np

from flexband.basics.rounding import rounding_attributes
from flexband.mechanics.assembly.stacking import stack
from flexband.mechanics.assembly.system import System


def attributes_of_units(system: System, h: float = np.inf) -> dict[str, str]:
    """Return rounding errors by unit, for the attributes of "unit"; steps h [s], ∞ in statics."""
    model = system.model
    values = system.values
    start = system.values.start
    places = model.places
    relative = 128 * np.finfo(float).eps  # of some tens of operations, with angles of some turns
    size = max(np.max(1 / values.inverse_scale[places[:, 0]]), np.max(np.abs(start[places])))
    mass = np.max(np.sum(stack([model.mass[n, n] for n in places[:, 0]]), axis=0))
    members = [v for v in (values.beams, values.continua, values.cables) if v.stiffness.size]
    springs = [spring for _, spring in model.springs]
    forces = [mass * size / h**2]
    forces += [np.max(np.abs(v.stiffness)) * np.max(v.inverse_length) for v in members]
    forces += [
        np.max(spring.stiffness) * size ** (-1 if spring.angular else 1) for spring in springs
    ]
    force = max(forces)
    size_of = {
        "m": size, "rad": 1.0, "m/s": size / h, "rad/s": 1 / h, "m/s²": size / h**2,
        "N": force, "N m": force * size, "J": force * size,
    }  # fmt: skip
    errors = {unit: float(relative * unit_size) for unit, unit_size in size_of.items()}
    return rounding_attributes(errors)
