"""Natural frequencies, damping and mode shapes about a state, subject to the constraints.

Small motions δq(t) about an equilibrium satisfy M δq̈ + D δq̇ + (K + L) δq + Φ_qᵀ δλ = 0 and
Φ_q δq = 0, where K includes the curvature of the constraints under their multipliers, and L and D
are those of all loads. About a steady rotation the same holds in axes that turn with it: every
vector of the plane has the components R(Ωt)(q₀ + x), so that q̈ gives the Coriolis term 2ΩMJ ẋ and
the centrifugal term −Ω²M x.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Literal

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from flexband.arguments import frozen
from flexband.errors import (
    InputError,
    check_finite,
    check_flag,
    check_instance,
    check_integer,
    check_option,
    warn,
)
from flexband.mechanics.assembly.mechanism import Mechanism
from flexband.mechanics.assembly.packing import AT_START, pack
from flexband.mechanics.assembly.stacking import count_samples
from flexband.mechanics.assembly.structure import Values
from flexband.mechanics.assembly.system import System, assemble
from flexband.mechanics.bodies.body import Point, point
from flexband.mechanics.engine.batch import begin, derive, run
from flexband.mechanics.engine.entries import SENSE, statics
from flexband.mechanics.engine.failures import raise_failures
from flexband.mechanics.engine.redundancy import require_inertia
from flexband.mechanics.engine.threads import interruptible, while_compiling
from flexband.mechanics.equilibrium import MAX_STEPS, rest
from flexband.mechanics.kernels.lanes import WIDTH
from flexband.mechanics.linearization.balance import Balance
from flexband.mechanics.linearization.eigenmodes import Eigenmodes, eigenmodes
from flexband.mechanics.linearization.linearize import Equations, Linear, Spin
from flexband.mechanics.linearization.rotation import check_rotation
from flexband.mechanics.linearization.thickness import Thickness

PERTURBATION = 1e-6
"""Displacement of the central differences that differentiate the sensors, relative to the size."""

MIN_SPEED = 1e-7
"""Velocity, relative to the size of the mechanism per second, that counts as none."""

UNBALANCED = 1e3
"""Excess of the forces, as `Balance` measures it, from which on the start is no equilibrium."""


@frozen()
class SteadyRotation:
    """A steady rotation of the whole mechanism, about which `modes` finds small motions.

    Parameters
    ----------
    rate : Ω [rad/s], positive from X to Y: a number or an array of shape (n,).
    center : centre of the rotation (X, Y) [m].

    Raises
    ------
    InputError
        If a number is not finite.
    """

    rate: ArrayLike
    center: Point = (0.0, 0.0)

    def __post_init__(self) -> None:
        check_finite("SteadyRotation rate [rad/s]", self.rate)
        point("SteadyRotation center", self.center)


def modes(
    mechanism: Mechanism,
    count: int,
    *,
    about: Literal["start", "equilibrium"] | SteadyRotation = "equilibrium",
    steps: int = 1,
    thickness: bool = False,
) -> xr.Dataset:
    """Compute the modes of lowest frequency of a mechanism, with damping.

    A mode is a small motion exp(st) φ about a state at rest or in steady rotation. All loads enter
    with their derivatives by position and velocity, whether they have a potential or not.

    Parameters
    ----------
    count : number of modes; all are returned if there are fewer.
    about : "equilibrium" (as `equilibrium` finds it), "start", the assembled guess, which must not
        move, or a `SteadyRotation`. The last one is about the state in which everything turns with
        the given rate, whatever the velocities at the start; frequencies and shapes are those that
        an observer sees who turns with it.
    steps : as in `equilibrium`; centrifugal forces are raised as well.
    thickness : whether to list modes of thickness, too: vibrations of the sections of beams across
        their axis, which Timoshenko's beam does not have. Their frequencies depend on the mesh, and
        are high in slender beams.

    Returns
    -------
    Dataset with the dims "mode" and "output", and the variables

    - `eigenvalue`, s [1/s], with one of each conjugate pair;
    - `frequency`, |s|/2π [Hz], in ascending order: negative if the motion grows without
      oscillating, 0 if it is free;
    - `damping_ratio`, −Re s/|s|, negative if the motion grows;
    - `unstable`, whether the motion grows;
    - `thickness`, whether most of the kinetic energy is in changes of the sections' thickness;
    - `shape`, dims (mode, output), the change of the sensors' outputs with a mode φ of modal mass
      φᴴMφ = 1 kg. It is complex if parts of the mechanism move out of phase.

    An overdamped motion is two modes with damping ratio 1. There is a first dim "sample" if a
    parameter is an array of more than one value; a sample with fewer modes than others ends with
    NaN. ``attrs["unbalanced"]`` lists samples whose loads are not in equilibrium at the start:
    modes about the start lack the stresses that these loads would cause.

    Raises
    ------
    InputError
        If a number is out of its range, numbers of samples do not fit, the mechanism has no degree
        of freedom, it moves at the start although `about` is "start", or it cannot rotate steadily.
    AssemblyError
        If the constraints cannot be met or no equilibrium is found for a sample.
    """
    check_instance("mechanism", mechanism, Mechanism)
    count, steps = check_integer("count", count, 1), check_integer("steps", steps, 1, MAX_STEPS)
    thickness = check_flag("thickness", thickness)
    system, all_modes, unbalanced = found_modes(mechanism, count, about, steps, thickness)
    result = _dataset(system, [(sample_modes, shapes) for sample_modes, shapes, _ in all_modes])
    if unbalanced:
        result.attrs["unbalanced"] = unbalanced
    return result if system.samples > 1 else result.isel(sample=0)


Found = tuple[Eigenmodes, np.ndarray, np.ndarray]
"""Modes of a sample, the outputs' derivatives along them, and their momenta Mφ as columns."""


def found_modes(
    mechanism: Mechanism, count: int, about: object, steps: int, thickness: bool = False
) -> tuple[System, list[Found], list[int]]:
    """Return the modes of every sample, and which samples are not in equilibrium.

    `thickness` is whether those of thickness are among them.
    """
    system, spins = assemble(mechanism), None
    if isinstance(about, SteadyRotation):
        system, spins = _spins(mechanism, system, about)
    else:
        check_option("about", about, ["start", "equilibrium"])
    packed = pack(system, AT_START)
    sections = Thickness(mechanism)
    failures = np.zeros((system.samples, 4))
    all_modes, unbalanced, moving = [], [], False
    for block in range(-(-system.samples // WIDTH)):
        numbers = np.arange(system.samples)[block * WIDTH :][:WIDTH]
        own_spins = None if spins is None else spins[numbers[0] : numbers[-1] + 1]
        solve = partial(
            _solve,
            system,
            packed(block),
            about,
            steps,
            numbers,
            own_spins,
            count,
            sections,
            thickness,
        )
        wait = interruptible if statics.signatures else while_compiling
        failure, results, forced, moves = wait(solve)
        failures[numbers] = failure.T[: len(numbers)]
        all_modes += results
        unbalanced += forced
        moving = moving or moves
    raise_failures(failures, system, np.zeros(1))
    if moving:
        warn(
            "the mechanism moves at the start; modes(about='equilibrium') are those at rest. "
            "For a rotation give about=SteadyRotation(rate)"
        )
    return system, all_modes, unbalanced


def _spins(
    mechanism: Mechanism, system: System, about: SteadyRotation
) -> tuple[System, list[Spin]]:
    """Return the rotation of each sample, and the system with as many samples."""
    rate, (x, y) = np.asarray(about.rate, dtype=float), about.center
    given = [np.atleast_1d(np.asarray(v, dtype=float)) for v in (rate, x, y)]
    samples = count_samples([*given, np.zeros(system.samples)])
    centre = np.zeros((system.structure.state.coordinates, samples))
    for name, body in mechanism.bodies.items():
        for node in body.nodes:
            first = mechanism.first_coordinates[name] + node - 1
            centre[first], centre[first + 1] = given[1], given[2]
    rates = np.broadcast_to(given[0], samples)
    spins = [Spin(float(rates[k]), centre[:, k]) for k in range(samples)]
    return replace(system, samples=samples), spins


def _solve(
    system: System,
    values: Values,
    about: object,
    steps: int,
    own: np.ndarray,
    spins: Sequence[Spin] | None,
    count: int,
    sections: Thickness,
    thickness: bool,
) -> tuple[np.ndarray, list[Found], list[int], bool]:
    """Return failures (4, WIDTH), modes with shapes, unbalanced samples, and whether they move."""
    work, failure = begin(system, values)
    state = system.structure.state
    v = work.z[state.velocity + 1 : state.acceleration, : len(own)]
    scale = values.inverse_scale[1 : 1 + state.coordinates, : len(own)]
    moving = bool(np.any(np.abs(v * scale) > MIN_SPEED)) and spins is None
    still = Spin(0.0, np.zeros(state.coordinates))
    if about == "start":
        if moving:
            raise InputError(
                "about must not be 'start' if the mechanism moves at the start; give "
                "about='equilibrium', or about=SteadyRotation(rate) for a rotation"
            )
        balances = [
            Balance(Equations(system, values, lane), z, still) for lane, z in enumerate(work.z.T)
        ][: len(own)]
    else:
        _, failure, balances, _ = rest(system, values, steps, spins or [still] * len(own))
    results, unbalanced = [], []
    for lane, balance in enumerate(balances):
        if failure[0, lane]:
            continue
        if not balance.free:
            raise InputError("the mechanism has no degree of freedom, so it has no modes")
        z, linear, sample = balance.z, balance.linear, int(own[lane])
        if about == "start":
            z = work.z[:, lane]
            linear = balance.equations.linear(z, still)  # with the multipliers of the motion
            if balance.excess > UNBALANCED:
                unbalanced.append(sample)
        require_inertia(system, balance.equations.values, z[:, None], own[lane : lane + 1])
        linear = linear._replace(M=balance.equations.mass)
        share = partial(sections.share, sample, z)
        sample_modes = _eigenmodes(linear, balance, share, count, thickness)
        if spins is not None and spins[lane].rate:
            check_rotation(system, sample, balance, sample_modes, spins[lane])
        shapes = _shapes(balance.equations, z, sample_modes.vectors)
        results.append((sample_modes, shapes, linear.M @ sample_modes.vectors))
    return failure, results, unbalanced, moving


def _eigenmodes(
    linear: Linear,
    balance: Balance,
    share: Callable[[np.ndarray], np.ndarray],
    count: int,
    thickness: bool,
) -> Eigenmodes:
    """Return the modes of lowest frequency, with those of thickness or without.

    `share` returns the share of their kinetic energy that vectors have in changes of thickness.
    """
    asked = count
    while True:
        candidates = eigenmodes(linear, balance.basis, asked)
        across = share(candidates.vectors) > 0.5
        candidates = candidates._replace(thickness=across)
        listed = np.flatnonzero(thickness | ~across)
        if len(listed) >= count or len(candidates.s) < asked:
            return candidates.selected(listed[:count])
        asked *= 2


def _shapes(equations: Equations, z: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    """Return the outputs' derivatives along each vector, shape (modes, outputs)."""
    system, work = equations.system, equations.work
    rows = np.zeros((system.sensed, WIDTH))
    shapes = []
    for vector in vectors.T:
        size = PERTURBATION / np.abs(vector / equations.size).max()
        work.z[:] = z[:, None]
        for lane, step in enumerate((1.0, -1.0, 1.0j, -1.0j)):
            work.z[equations.q, lane] += (step.conjugate() * size * vector).real
        run(SENSE, system, equations.values, work, rows[None], equations.failure)
        outputs = derive(system, rows[:, None].copy())[:, 0]
        parts = [(outputs[:, k] - outputs[:, k + 1]) / (2 * size) for k in (0, 2)]
        shapes.append(parts[0] + 1j * parts[1] if np.iscomplexobj(vectors) else parts[0])
    return np.stack(shapes)


def _dataset(system: System, found: list[tuple[Eigenmodes, np.ndarray]]) -> xr.Dataset:
    """Return the results of all samples, those with fewer modes than others filled up by NaN."""
    most = max(len(modes.s) for modes, _ in found)
    complex_shapes = any(np.iscomplexobj(shapes) for _, shapes in found)
    kinds = {
        "eigenvalue": (complex, lambda modes: modes.s, {"units": "1/s"}),
        "frequency": (float, lambda modes: modes.frequency, {"units": "Hz"}),
        "damping_ratio": (float, lambda modes: modes.damping_ratio, {}),
        "unstable": (bool, lambda modes: modes.unstable, {}),
        "thickness": (bool, lambda modes: modes.thickness, {}),
    }
    variables = {}
    for name, (kind, of, attrs) in kinds.items():
        array = np.full((len(found), most), False if kind is bool else np.nan, dtype=kind)
        for row, (modes, _) in zip(array, found, strict=True):
            row[: len(modes.s)] = of(modes)
        variables[name] = (("sample", "mode"), array, attrs)
    shape = np.full(
        (len(found), most, len(system.outputs)), np.nan, dtype=complex if complex_shapes else float
    )
    for row, (_, shapes) in zip(shape, found, strict=True):
        row[: len(shapes)] = shapes
    return xr.Dataset(
        {**variables, "shape": (("sample", "mode", "output"), shape)},
        coords={"output": system.outputs, "unit": ("output", system.units)},
    )
