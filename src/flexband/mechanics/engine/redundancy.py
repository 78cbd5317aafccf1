"""Redundant constraints, and motions without inertia, from the Jacobian in one configuration."""

from __future__ import annotations

import numpy as np
from scipy.linalg import null_space

from flexband.basics.user_functions import evaluate_function
from flexband.basics.warning import warn
from flexband.errors import InputError, ResolutionWarning
from flexband.mechanics.assembly.structure import Values, VectorValues
from flexband.mechanics.assembly.system import System
from flexband.remarks.remark import Remark, RemarkKind

RANK = 1e-9
"""Singular values below this fraction of the largest one count as zero."""


DETERMINED = 1e-6
"""Displacement of what has mass, relative to that of massless bodies, that determines theirs."""

INVOLVED = 0.1
"""Part of a constraint in the combination that is nearest to zero, from which on it is named."""


def jacobian(system: System, z: np.ndarray, samples: np.ndarray) -> np.ndarray:
    """Return Φ_q of states z (rows, samples), shape (multipliers, coordinates, samples)."""
    c = of_samples(system.values.terms, samples).copy()
    for t, f in enumerate(system.structure.terms.f):
        if f > 0:
            factor = np.atleast_1d(evaluate_function(system.functions[f - 1], system.first_time))
            c[t] *= of_samples(factor, samples)
    vectors = VectorValues(*(of_samples(parts, samples) for parts in system.values.vectors))
    return derivatives(system, c, vectors, z)


def of_samples(values: np.ndarray, samples: np.ndarray) -> np.ndarray:
    """Return the values of samples along the last axis, whose length is 1 if they are the same."""
    return values[..., np.minimum(samples, values.shape[-1] - 1)]


def rank_deficiency(system: System, values: Values, z: np.ndarray) -> np.ndarray:
    """Return how many constraints depend on others at the start, per lane or once for all."""
    c = values.terms * values.functions[system.structure.terms.f]
    lanes = derivatives(system, c, values.vectors, z).transpose(2, 0, 1)
    matrices = _unit_rows(lanes[:1] if (lanes == lanes[0]).all() else lanes)
    sound = np.isfinite(matrices).all(axis=(1, 2), keepdims=True)
    sizes = np.linalg.svd(np.where(sound, matrices, 0.0), compute_uv=False)
    return np.sum(sizes < RANK * sizes[:, :1], axis=1) + matrices.shape[1] - sizes.shape[1]


def require_inertia(system: System, values: Values, z: np.ndarray, samples: np.ndarray) -> None:
    """Raise `InputError` if massless bodies can move while all that has mass is at rest."""
    entries = system.structure.mass.massless
    if not len(entries):
        return
    lanes = slice(z.shape[1])
    coordinates = slice(1, 1 + system.structure.state.coordinates)
    massless = (values.mass != values.regular_mass)[entries, lanes]
    places = system.structure.mass.i[entries] - 1
    c = (values.terms * values.functions[system.structure.terms.f])[:, lanes]
    vectors = VectorValues(*(parts[:, lanes] for parts in values.vectors))
    Phi = derivatives(system, c, vectors, z) / values.inverse_scale[coordinates, lanes]
    for lane, sample in enumerate(samples):
        massless_columns = places[massless[:, lane]]
        motion = np.zeros(Phi.shape[1])
        matrix = _unit_rows(Phi[:, :, lane])[:, massless_columns]
        if not len(massless_columns) or not np.isfinite(matrix).all():
            continue
        _, sizes, directions = np.linalg.svd(matrix)
        motion[massless_columns] = directions[-1]
        if len(sizes) < len(massless_columns) or sizes[-1] < DETERMINED:
            where = f" (sample {sample})" if system.samples > 1 else ""
            raise InputError(_without_inertia(system, motion) + where)


def _without_inertia(system: System, motion: np.ndarray) -> str:
    """Return which body can move without inertia, and how; coordinates are relative to the size."""
    bodies = {name: motion[rows - 1] for name, rows in system.model.node_vectors.items()}
    name = max(bodies, key=lambda name: np.abs(bodies[name]).max())
    place, *axes = np.concatenate(bodies[name])
    what = "mass"
    way = f"move along ({', '.join(f'{x + 0.0:.2g}' for x in place)})"
    if np.abs(axes).max(initial=0.0) > DETERMINED:
        what = "inertia" if np.abs(place).max() < DETERMINED else "mass or inertia"
        way = "turn"
    return (
        f"body {name!r} has no {what} and can still {way} while all that has mass is at rest; give "
        f"it {what}, or a joint that determines this motion"
    )


def derivatives(system: System, c: np.ndarray, numbers: VectorValues, z: np.ndarray) -> np.ndarray:
    """Return Φ_q from the coefficients of terms and vectors; all have a last axis of samples."""
    terms = system.structure.terms
    state = system.structure.state
    vectors = system.structure.vectors
    count = state.coordinates
    dense = np.zeros((state.friction, 1 + count, z.shape[-1]))
    plain = slice(terms.polynomials)
    k = terms.k[plain]
    i = terms.i[plain]
    j = terms.j[plain]
    np.add.at(dense, (k, i), c[plain] * z[j])
    np.add.at(dense, (k, j), c[plain] * z[i])
    for t in range(terms.polynomials, len(terms.k)):
        a = terms.j[t] - state.angle
        entries = slice(vectors.start[a], vectors.start[a + 1])
        (nx, ny), (vx, vy) = vector_and_gradient(system, numbers, a, z)
        square = nx * nx + ny * ny + 1e-100  # as in `kernels.angles`
        gradient = (nx * vy - ny * vx) / square
        if vectors.length[a]:
            gradient = (nx * vx + ny * vy) / np.sqrt(square)
        np.add.at(dense, (terms.k[t], vectors.coordinate[entries]), c[t] * gradient)
    return dense[1 + count :, 1:]


def vector_and_gradient(
    system: System, numbers: VectorValues, a: int, z: np.ndarray
) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return both components of a vector, and their derivatives by the coordinate of each entry."""
    vectors = system.structure.vectors
    entries = slice(vectors.start[a], vectors.start[a + 1])
    partners = vectors.partner[entries, None]
    factor = np.where(partners > 0, z[partners[:, 0]], 1.0)
    q = z[vectors.coordinate[entries]] * np.where(partners > 0, 0.5, 1.0)
    gradient = [component[entries] * factor for component in numbers[:2]]
    return [(component * q).sum(axis=0) for component in gradient], gradient


def dependent(system: System, z: np.ndarray, sample: int = 0) -> tuple[int, list[str]]:
    """Return the number of redundant constraints, and the joints among the dependent ones."""
    ways = null_space(_unit_jacobian(system, z, sample).T, rcond=RANK)
    return ways.shape[1], _joints(_owners(system, np.abs(ways).max(axis=1, initial=0.0) > 1e-6))


def free_bodies(system: System, z: np.ndarray, sample: int = 0) -> list[str]:
    """Return the bodies that can move while all constraints are met, in their order."""
    directions = np.abs(null_space(_unit_jacobian(system, z, sample), rcond=RANK))
    moving = directions.max(axis=1, initial=0.0) > 1e-6
    return [name for name, rows in system.model.node_vectors.items() if moving[rows - 1].any()]


def joints_that_share(system: System, z: np.ndarray, sample: int) -> list[str]:
    """Return the joints whose forces are not unique; warn if constraints almost depend."""
    count, joints = dependent(system, z, sample)
    if count:
        return joints
    nearest = np.linalg.svd(_unit_jacobian(system, z, sample))[0][:, -1]
    owners = _owners(system, np.abs(nearest) > INVOLVED)
    text = (
        f"{' and '.join(owners)} almost depend on each other at the start: one of their "
        "constraints is left out there, so forces may be wrong, as may motions that it alone "
        "prevents; move the start away from this position"
    )
    warn(text, remarks=[Remark(RemarkKind.ALMOST_DEPENDENT, text, part=" and ".join(owners))])
    return _joints(owners)


def warn_of_shared(system: System, joints: list[str]) -> list[str]:
    """Warn of sensors of joints that share their forces; return these joints."""
    sensors = system.model.sensors
    joint_of = {k: getattr(sensor, "joint", None) for k, sensor in sensors.items()}
    touched = [k for k, joint in joint_of.items() if f"joint {joint!r}" in joints]
    if touched:
        read = [f"sensor {k!r}" for k in touched]
        text = (
            f"what {' and '.join(read)} measures is one "
            f"choice of many: {' and '.join(joints)} are redundant and share their forces; leave "
            "out what is redundant, or let a body between them be flexible"
        )
        outputs = tuple(name for sensor in touched for name, _ in system.model.outputs[sensor])
        warn(text, remarks=[Remark(RemarkKind.SHARED_REACTIONS, text, outputs=outputs)])
    return joints


def refuse_shared_friction(system: System, joints: list[str]) -> None:
    """Raise `InputError` if the friction of a joint depends on a reaction that is not unique."""
    friction_joints = [f"joint {name!r}" for name, _ in system.model.frictions]
    shared = [joint for joint in joints if joint in friction_joints]
    if shared:
        raise InputError(
            f"the friction of {' and '.join(shared)} depends on a reaction that is not unique, "
            f"since {' and '.join(joints)} are redundant; leave out what is redundant, or let a "
            "body between them be flexible"
        )


def warn_of_unresolved(system: System, unresolved: np.ndarray, times: np.ndarray) -> None:
    """Warn of sensors of forces of joints if the motion passes where more constraints depend.

    `unresolved` is the number of the first time where forces could not be shared, or where a
    constraint with a force was left out that is independent at the start; 0 if there is none.
    """
    samples = np.flatnonzero(unresolved)
    if not len(samples) or not system.impulsive:
        return
    sample = samples[np.argmin(unresolved[samples])]
    where = f" (sample {sample})" if system.samples > 1 else ""

    def text(sample: int, where: str = "") -> str:
        return (
            f"at t = {times[int(unresolved[sample])]:.4g} s{where} the mechanism is where more of "
            "its constraints depend on each other than at the start: next to it their forces can "
            "be arbitrarily large, and reactions there are not resolved; keep the motion away from "
            "this position, or let a body be flexible"
        )

    remarks = [
        Remark(
            RemarkKind.UNRESOLVED_REACTIONS,
            text(k),
            outputs=tuple(name for name in system.outputs if name in system.impulsive),
            time=float(times[int(unresolved[k])]),
            sample=k,
        )
        for k in samples.tolist()
    ]
    warn(text(int(sample), where), ResolutionWarning, remarks)


def _unit_jacobian(system: System, z: np.ndarray, sample: int) -> np.ndarray:
    """Return Φ_q with rows of length 1."""
    return _unit_rows(jacobian(system, z[:, None], np.array([sample]))[:, :, 0])


def _unit_rows(matrix: np.ndarray) -> np.ndarray:
    return matrix / np.maximum(np.linalg.norm(matrix, axis=-1, keepdims=True), 1e-300)


def _owners(system: System, involved: np.ndarray) -> list[str]:
    return list(dict.fromkeys(system.constraints[k] for k in np.flatnonzero(involved)))


def _joints(owners: list[str]) -> list[str]:
    return [owner for owner in owners if owner.startswith("joint")]
