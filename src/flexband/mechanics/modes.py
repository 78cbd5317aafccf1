"""Natural frequencies, damping and mode shapes about a state, subject to the constraints.

Small motions δq(t) about an equilibrium satisfy M δq̈ + D δq̇ + (K + L) δq + Φ_qᵀ δλ = 0 and
Φ_q δq = 0, where K includes the curvature of the constraints under their multipliers, and L and D
are those of all loads. About a steady rotation the same holds in axes that turn with it: every
vector of the plane has the components R(Ωt)(q₀ + x), so that q̈ gives the Coriolis term 2ΩMJ ẋ and
the centrifugal term −Ω²M x.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Literal, NamedTuple

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from flexband.basics.arguments import frozen
from flexband.basics.checks import (
    check_finite,
    check_flag,
    check_instance,
    check_integer,
    check_option,
)
from flexband.basics.warning import warn
from flexband.mechanics.assembly.packing import AT_START, pack
from flexband.mechanics.assembly.stacking import count_samples
from flexband.mechanics.assembly.system import System, assemble
from flexband.mechanics.bodies.body import Point, point
from flexband.mechanics.engine.entries import statics
from flexband.mechanics.engine.failures import raise_failures
from flexband.mechanics.engine.threads import interruptible, while_compiling
from flexband.mechanics.equilibrium import check_steps
from flexband.mechanics.kernels.lane_arrays import WIDTH
from flexband.mechanics.linearization.block_modes import ModeSolver, SampleModes
from flexband.mechanics.linearization.spin import Spin
from flexband.mechanics.linearization.thickness import Thickness
from flexband.mechanics.model.mechanism import Mechanism


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
    about: Literal["start", "equilibrium", "sliding"] | SteadyRotation = "equilibrium",
    steps: int = 1,
    thickness: bool = False,
) -> xr.Dataset:
    """Compute the modes of lowest frequency of a mechanism, with damping.

    A mode is a small motion exp(st) φ about a state at rest, in steady rotation or steady sliding.
    All loads enter with their derivatives by position and velocity, whether they have a potential
    or not.

    Parameters
    ----------
    count : number of modes; all are returned if there are fewer.
    about : "equilibrium" (as `equilibrium` finds it), "start", the assembled guess, which must not
        move, or a `SteadyRotation`. The last one is about the state in which everything turns with
        the given rate, whatever the velocities at the start; frequencies and shapes are those that
        an observer sees who turns with it. About "sliding", drives keep their speeds at the start
        and everything else rests. Friction with a sliding speed is a load, which may cause squeal;
        friction without one sticks, in every state, if it has a normal force.
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
    modes about the start lack the stresses that these loads would cause. With friction,
    ``attrs["sliding"]`` lists the parts in which it slides, ``attrs["stuck"]`` those that it holds.
    Friction that can hold nothing in this state, without a normal force, is free. Sensors of a
    motion, such as extremes, are left out, and listed in ``attrs["left_out"]``.

    Raises
    ------
    InputError
        If a number is out of its range, numbers of samples do not fit, the mechanism has no degree
        of freedom, it moves at the start although `about` is "start", it cannot rotate or slide
        steadily, or friction jams or follows a reaction that is not unique.
    AssemblyError
        If the constraints cannot be met or no equilibrium is found for a sample.

    Examples
    --------
    >>> cart = fb.Mechanism(
    ...     bodies={"cart": fb.PointMass(mass=2.0, position=(1.0, 0.0))},
    ...     joints={"rail": fb.Slot("cart", (0.0, 0.0), axis=(1.0, 0.0))},
    ...     loads={"spring": fb.Spring("cart", (0.0, 0.0), stiffness=800.0, damping=4.0)},
    ... )
    >>> modes = fb.modes(cart, 1)
    >>> modes["frequency"].values.round(3), modes["damping_ratio"].values.round(3)
    (array([3.183]), array([0.05]))
    """
    check_instance("mechanism", mechanism, Mechanism)
    count = check_integer("count", count, 1)
    steps = check_steps(steps)
    thickness = check_flag("thickness", thickness)
    system, samples, unbalanced = sample_modes(mechanism, count, about, steps, thickness=thickness)
    result = _dataset(system, samples)
    names = np.array([name for name, _ in system.model.frictions])
    for kind in ("sliding", "stuck") if len(names) else ():
        friction_mask = np.any([getattr(of_sample, kind) for of_sample in samples], axis=0)
        result.attrs[kind] = list(dict.fromkeys(names[friction_mask].tolist()))
    result.attrs |= mechanism.left_out_at_rest()
    if unbalanced:
        result.attrs["unbalanced"] = unbalanced
    return result if system.samples > 1 else result.isel(sample=0)


class AllModes(NamedTuple):
    """The modes of every sample, and which samples are not in equilibrium."""

    system: System
    samples: list[SampleModes]
    unbalanced: list[int]


def sample_modes(
    mechanism: Mechanism,
    count: int,
    about: str | SteadyRotation,
    steps: int,
    *,
    thickness: bool = False,
) -> AllModes:
    """Return the modes of every sample; `thickness` is whether to list those of thickness."""
    mechanism = mechanism.at_rest()
    system = assemble(mechanism)
    spins = None
    if isinstance(about, SteadyRotation):
        system, spins = _spins(mechanism, system, about)
    else:
        check_option("about", about, ["start", "equilibrium", "sliding"])
    values_of = pack(system, AT_START)
    solver = ModeSolver(
        system, Thickness(mechanism), count, about == "start", steps, thickness, spins,
        about == "sliding",
    )  # fmt: skip
    # Solve block by block.
    failures = np.zeros((system.samples, 4))
    samples = []
    unbalanced = []
    moving = False
    for block in range(-(-system.samples // WIDTH)):
        numbers = np.arange(system.samples)[block * WIDTH :][:WIDTH]
        wait = interruptible if statics.codes else while_compiling
        modes = wait(partial(solver.block, values_of(block), numbers))
        failures[numbers] = modes.failure.T[: len(numbers)]
        samples += modes.samples
        unbalanced += modes.unbalanced
        moving = moving or modes.moving
    raise_failures(failures, system, np.zeros(1))
    if moving:
        warn(
            "the mechanism moves at the start; modes(about='equilibrium') are those at rest. "
            "For a rotation give about=SteadyRotation(rate), for drives that go on about='sliding'"
        )
    return AllModes(system, samples, unbalanced)


def _spins(
    mechanism: Mechanism, system: System, about: SteadyRotation
) -> tuple[System, list[Spin]]:
    """Return the rotation of each sample, and the system with as many samples."""
    rate, (x, y) = np.asarray(about.rate, dtype=float), about.center
    parameters = [np.atleast_1d(np.asarray(v, dtype=float)) for v in (rate, x, y)]
    samples = count_samples([*parameters, np.zeros(system.samples)])
    centre = np.zeros((system.structure.state.coordinates, samples))
    for x_row, y_row in mechanism.model.places:
        centre[x_row - 1] = parameters[1]
        centre[y_row - 1] = parameters[2]
    rates = np.broadcast_to(parameters[0], samples)
    spins = [Spin(float(rates[k]), centre[:, k]) for k in range(samples)]
    return replace(system, samples=samples), spins


def _dataset(system: System, samples: Sequence[SampleModes]) -> xr.Dataset:
    """Return the results of all samples, those with fewer modes than others filled up by NaN."""
    mode_count = max(len(of_sample.modes.s) for of_sample in samples)
    is_complex = any(np.iscomplexobj(of_sample.shapes) for of_sample in samples)

    def pad_rows(rows: Sequence[np.ndarray], kind: type, *size: int) -> np.ndarray:
        array = np.full(
            (len(rows), mode_count, *size), False if kind is bool else np.nan, dtype=kind
        )
        for row, values in zip(array, rows, strict=True):
            row[: len(values)] = values
        return array

    modes = [of_sample.modes for of_sample in samples]
    variables = {
        "eigenvalue": (pad_rows([m.s for m in modes], complex), {"units": "1/s"}),
        "frequency": (pad_rows([m.frequency for m in modes], float), {"units": "Hz"}),
        "damping_ratio": (pad_rows([m.damping_ratio for m in modes], float), {}),
        "unstable": (pad_rows([m.unstable for m in modes], bool), {}),
        "thickness": (pad_rows([m.thickness for m in modes], bool), {}),
    }
    shapes = [of_sample.shapes for of_sample in samples]
    shape = pad_rows(shapes, complex if is_complex else float, len(system.outputs))
    return xr.Dataset(
        {name: (("sample", "mode"), *variable) for name, variable in variables.items()}
        | {"shape": (("sample", "mode", "output"), shape)},
        coords={"output": system.outputs, "unit": ("output", system.units)},
    )
