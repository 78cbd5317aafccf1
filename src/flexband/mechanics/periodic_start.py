"""Starts on a periodic motion: the fixed point of the map from a state to that one period later.

The map x → P(x) is a simulation over the period, from coordinates q and velocities v. Its fixed
point is found by Anderson's acceleration of x ← P(x), which is GMRES where the map is linear. The
differences of all iterates span the directions in which the motion is slow to become periodic; the
eigenvalues of the map in this space tell its spectral radius ρ. An error of a state is at most
1/(1 − ρ) of what it changes in a period, so that the motion is refused where ρ is near 1.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from flexband.basics.user_functions import evaluate_function, function_text
from flexband.basics.warning import without_warnings
from flexband.errors import InputError
from flexband.mechanics.assembly.packing import pack
from flexband.mechanics.assembly.structure import Values, WorkSpace
from flexband.mechanics.assembly.system import System
from flexband.mechanics.assembly.vectors import time as of_time
from flexband.mechanics.engine.batch import BlockStart, Run, Start, begin, hold, march_block
from flexband.mechanics.engine.newton import NEWTON
from flexband.mechanics.engine.threads import stop_flag
from flexband.mechanics.kernels.failure_codes import FAILURE
from flexband.mechanics.kernels.forms import Composed
from flexband.mechanics.kernels.lane_arrays import WIDTH
from flexband.mechanics.kernels.laws.states import rows_of_states


@dataclass(frozen=True)
class PeriodicStart(Start):
    """The state of a motion that is the same one period later."""

    period: float  # of all functions of time [s], a multiple of the step
    tolerance: float = 1e-10
    """Change of a state in a period, relative to the mechanism's size."""
    max_radius: float = 0.98
    """Largest spectral radius of the map that is accepted."""
    max_periods: int = 100
    """The most that are simulated."""
    memory: int = 40
    """The most differences of iterates that are used."""
    independent: float = 1e-7
    """Least relative singular value of differences that is no rounding."""

    def of_blocks(self, run: Run) -> Callable[[int, Values], BlockStart]:
        """Return what begins a block. Raise `InputError` if a function of time is not periodic."""
        system = run.system
        step = run.times[1] - run.times[0]
        self._check_functions(system, float(run.times[-1]))
        limits = run.integrator.step_limits(system.structure.state, step)
        method = run.integrator.coefficients(step)
        method = method._replace(
            attempts=2, matrices=NEWTON.factorizations if limits else method.matrices
        )
        # Functions of time over one period.
        times = step * np.arange(round(self.period / step) + 1)
        with without_warnings():
            values_of = pack(system, times, run.samples, limits and limits.tolerance)
        rounds, newton = len(values_of.schedule.parts), float(run.integrator.tolerance)
        rows = _rows(system)

        def begin_block(number: int, values: Values) -> BlockStart:
            work, failure = begin(system, values)
            size = _sizes(system, values, self.period / math.tau)

            def after_period(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
                over_period = values_of(number)
                over_period.springs.rest[:] = values.springs.rest
                start_block = self._start_block(system, over_period, work, x * size)
                motion = march_block(
                    system,
                    method,
                    newton,
                    over_period,
                    rounds,
                    limits=limits,
                    block_start=start_block,
                )
                motion.failure[1] = 0.0
                return motion.work.z[rows] / size, motion.failure

            x, period_failure = self._fixed_point(after_period, work.z[rows] / size, failure)
            start_work, failure = self._start_block(system, values, work, x * size)
            return BlockStart(
                start_work, np.where(period_failure[0] > 0, period_failure, failure), work.z
            )

        return begin_block

    @staticmethod
    def _start_block(
        system: System, values: Values, work: WorkSpace, x: np.ndarray
    ) -> tuple[WorkSpace, np.ndarray]:
        """Start a block from a state, shape (rows, WIDTH); return it and its failures."""
        z = work.z.copy()
        start_work = WorkSpace.from_structure(system.structure)
        z[_rows(system)] = x
        start_work.smallest[:] = work.smallest
        start_work.z[:] = work.z
        return start_work, hold(system, values, start_work, z, velocities=True)

    def _fixed_point(
        self,
        after_period: Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]],
        x: np.ndarray,
        failure: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the fixed point of each lane, and its failure."""
        # Iterate until all lanes are done or have failed.
        lanes = [_Iteration(self) for _ in range(WIDTH)]
        for _ in range(self.max_periods):
            g, period_failure = after_period(x)
            new_mask = period_failure[0] > 0
            failure = np.where(new_mask & (failure[0] == 0), period_failure, failure)
            for lane, iteration in enumerate(lanes):
                if not failure[0, lane] and not iteration.done:
                    x[:, lane] = iteration.next(x[:, lane], g[:, lane])
            if stop_flag().any() or all(
                iteration.done or failure[0, lane] for lane, iteration in enumerate(lanes)
            ):
                break
        # Refuse motions that do not converge, or hardly become periodic.
        for lane, iteration in enumerate(lanes):
            radius = iteration.spectral_radius()
            if not failure[0, lane] and (not iteration.done or radius > self.max_radius):
                failure[:, lane] = FAILURE.not_periodic, 0.0, -1.0, radius
        return x, failure

    def _check_functions(self, system: System, duration: float) -> None:
        """Raise `InputError` if a function of time does not repeat itself, sampled irregularly."""
        golden = (5**0.5 - 1) / 2
        span = max(self.period, duration - self.period)
        moments = span * ((golden * np.arange(1, 65)) % 1.0)
        for function in system.functions:
            if function is of_time:  # laws are given the time, which they need not use
                continue
            now, later = (
                np.array(
                    [evaluate_function(function, float(t)) for t in moments + shift], dtype=float
                )
                for shift in (0.0, self.period)
            )
            if np.abs(later - now).max() > 1e-6 * max(np.abs(now).max(), 1e-300):
                inner = function.inner if isinstance(function, Composed) else function
                raise InputError(
                    f"start='periodic' needs functions of time that repeat themselves after the "
                    f"period of {self.period:g} s; {function_text(inner)} does not"
                )


class _Iteration:
    """Anderson's acceleration in one lane."""

    def __init__(self, options: PeriodicStart) -> None:
        self.options = options
        self.done = False
        self.points: list[np.ndarray] = []
        self.images: list[np.ndarray] = []

    def next(self, x: np.ndarray, g: np.ndarray) -> np.ndarray:
        """Return the next iterate after x, which is at `g` one period later."""
        max_points = self.options.memory + 1
        self.points = [*self.points, x.copy()][-max_points:]
        self.images = [*self.images, g][-max_points:]
        self.done = bool(np.abs(g - x).max() <= self.options.tolerance)
        if self.done or len(self.points) == 1:
            return g
        point_steps, image_steps = self._differences()
        weights = np.linalg.lstsq(image_steps - point_steps, g - x, rcond=1e-12)[0]
        return g - image_steps @ weights

    def spectral_radius(self) -> float:
        """Return the largest eigenvalue of the map in the space of the differences."""
        if len(self.points) < 2:
            return 0.0
        point_steps, image_steps = self._differences()
        u, s, vt = np.linalg.svd(point_steps, full_matrices=False)
        rank_mask = s > self.options.independent * s[0]
        matrix = (u[:, rank_mask].T @ image_steps @ vt[rank_mask].T) / s[rank_mask]
        return float(np.abs(np.linalg.eigvals(matrix)).max())

    def _differences(self) -> tuple[np.ndarray, np.ndarray]:
        """Return differences of iterates, of length one, and those that they are mapped to."""
        point_steps = np.diff(self.points, axis=0).T
        image_steps = np.diff(self.images, axis=0).T
        length = np.linalg.norm(point_steps, axis=0)
        return point_steps[:, length > 0] / length[length > 0], image_steps[:, length > 0] / length[
            length > 0
        ]


def _rows(system: System) -> np.ndarray:
    """Return the rows of z that are its state: q, v and the states of force laws."""
    state = system.structure.state
    q = np.arange(1, 1 + state.coordinates)
    laws = state.law_state + np.arange(rows_of_states.py_func(state).states)
    return np.concatenate([q, state.velocity + q, laws])


def _sizes(system: System, values: Values, time: float) -> np.ndarray:
    """Return the sizes of a state by which it is compared, those of velocities per `time` [s]."""
    size = 1 / values.inverse_scale[1 : 1 + system.structure.state.coordinates]
    laws = len(_rows(system)) - 2 * len(size)
    return np.concatenate([size, size / time, np.ones((laws, WIDTH))])
