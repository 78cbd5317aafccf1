"""Warnings of members that are strained beyond what linear elasticity can mean.

A four-bar that cannot be closed at some angles of its crank still turns if its coupler is flexible
and is stretched by a third. The strains are those of states that runs have kept, and are found from
the slopes g of the axis at the nodes: |g| − 1, and the height of the section times the curvature.
"""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from flexband.basics.warning import warn
from flexband.basics.words import number_of
from flexband.errors import StrainWarning
from flexband.mechanics.assembly.structure import KEPT
from flexband.mechanics.assembly.system import System
from flexband.mechanics.bodies.beam import Beam
from flexband.mechanics.bodies.centre_line import CentreLine
from flexband.mechanics.engine.rounds import kept_at
from flexband.remarks.remark import Remark, RemarkKind


class LargestStrains(NamedTuple):
    """The largest axial strains of some samples, those of surfaces by bending, and turns.

    The turns are those of elements from one node to the next [rad].
    """

    strain: np.ndarray  # (members, 3, samples)
    snapshots: np.ndarray  # numbers of their states, (members, 3, samples)

    @staticmethod
    def zeros(members: int, samples: int) -> LargestStrains:
        """Return no strains."""
        size = members, 3, samples
        return LargestStrains(np.zeros(size), np.zeros(size, dtype=int))

    def place(self, samples: np.ndarray | slice, strains: LargestStrains) -> None:
        """Take over the strains of some samples."""
        self.strain[..., samples], self.snapshots[..., samples] = strains


class Members:
    """The flexible members of a mechanism."""

    def __init__(self, system: System):
        bodies = system.model.bodies.items()
        self.bodies = {name: body for name, body in bodies if isinstance(body, CentreLine)}
        self.axes = [system.model.axes[name][:, 0] for name in self.bodies]

    @cached_property
    def turn_strains(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Turns of elements at the start, and the strain per further turn, (elements, n or 1)."""
        pairs = []
        for body in self.bodies.values():
            half = np.zeros((1, body.elements))  # a cable has no height
            if isinstance(body, Beam):
                half = body.profile.across(body.at_gauss_points).mean(axis=-1) / 2
            pairs.append((np.diff(body.axis()[2]).T, (half / body.element_lengths).T))
        return pairs

    def largest(self, states: np.ndarray, samples: np.ndarray) -> LargestStrains:
        """Return the largest strains of states (states, rows of [1, q], samples)."""
        strain, snapshots = largest = LargestStrains.zeros(len(self.bodies), len(samples))
        for m, (body, axes) in enumerate(zip(self.bodies.values(), self.axes, strict=True)):
            gx, gy = (states[:, rows] for rows in axes.T)
            i = body.element_rows // body.per_node
            turn = np.arctan2(
                gx[:, i] * gy[:, i + 1] - gy[:, i] * gx[:, i + 1],
                gx[:, i] * gx[:, i + 1] + gy[:, i] * gy[:, i + 1],
            )
            start, per_turn = (
                values[:, samples] if values.shape[1] > 1 else values
                for values in self.turn_strains[m]
            )
            kinds = np.hypot(gx, gy) - 1, (turn - start) * per_turn, turn
            for kind, strains in enumerate(kinds):
                size = np.abs(strains).max(axis=1)
                snapshots[m, kind] = size.argmax(axis=0)
                peaks = strains[snapshots[m, kind], :, np.arange(len(samples))]  # (samples, places)
                place = np.abs(peaks).argmax(axis=1)
                strain[m, kind] = peaks[np.arange(len(samples)), place]
        return largest


def kept_steps(steps: int) -> np.ndarray:
    """Return at which of so many steps a run keeps its states."""
    return np.array([kept_at.py_func(k, steps) for k in range(KEPT)])


def warn_of_large_strains(
    system: System,
    largest: LargestStrains,
    failed: np.ndarray,
    times: np.ndarray | None = None,
    *,
    max_strain: float = 0.1,  # metals yield far below it; only rubbers reach it
) -> None:
    """Warn of the largest strain of all samples that did not fail."""
    size = np.where(failed, 0.0, np.abs(largest.strain[:, :2]))
    if not size.max(initial=0.0) > max_strain:
        return
    names = list(Members(system).bodies)

    def remark(sample: int) -> Remark:
        m, kind = np.unravel_index(size[..., sample].argmax(), size.shape[:2])
        strain = float(largest.strain[m, kind, sample])
        way = "stretched" if strain > 0 else "compressed"
        if kind:
            way = "bent so much that its surface is strained"
        time = np.nan if times is None else float(times[largest.snapshots[m, kind, sample]])
        where = "" if np.isnan(time) else f" at about t = {time:.3g} s"
        text = f"{names[m]!r} is {way} by {100 * abs(strain):.2g} %{where}"
        return Remark(
            RemarkKind.LARGE_STRAIN,
            f"{text}, beyond linear elasticity",
            size=abs(strain),
            part=names[m],
            time=time,
            sample=sample,
        )

    remarks = [remark(int(k)) for k in np.flatnonzero(size.max(axis=(0, 1)) > max_strain)]
    worst = max(remarks, key=lambda candidate: candidate.size)
    where = f"in sample {worst.sample}, " if len(failed) > 1 else ""
    warn(
        f"{where}{worst.text}, whose strains are small: below 1 % in metals. "
        "Unless it is as soft as rubber, check the lengths of all parts, and whether they let the "
        "mechanism move without stretching it",
        StrainWarning,
        remarks,
    )


def fold_advice(
    system: System, largest: LargestStrains, failed: np.ndarray, *, max_turn: float = 1.2
) -> str:
    """Say which member has an element that turns by more than `max_turn` where a sample failed."""
    turns = np.abs(largest.strain[:, 2][:, failed])
    if not turns.max(initial=0.0) > max_turn:
        return ""
    m, sample = np.unravel_index(turns.argmax(), turns.shape)
    name, body = list(Members(system).bodies.items())[int(m)]
    element_count = int(np.ceil(body.elements * turns[m, sample] / 0.6 / 10) * 10)
    return (
        f"An element of {name!r} is folded by {turns[m, sample]:.2g} rad, which shorter steps do "
        f"not prevent: give it more than its {number_of(body.elements, 'element')}, "
        f"such as {element_count}"
    )
