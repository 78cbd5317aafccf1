"""At which frequencies runs differ from one step to half of it, and what shorter steps leave.

With the step h a vibration of the frequency f lags by 2π f t (2π f h)²/12 after the time t
(docs/how-to/numerics.md). Its error is as large as the vibration while this is above 1, and
falls with h² once it is below.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class ErrorSpectrum(NamedTuple):
    """How the change of a run from a step to half of it is distributed over frequencies."""

    frequency: np.ndarray  # per unit of time, shape (frequencies,)
    energy: np.ndarray  # of each output, (outputs, frequencies), with a sum of one
    resolved: bool  # whether the run is known at all of its steps

    @staticmethod
    def from_change(change: np.ndarray, dt: float, *, resolved: bool) -> ErrorSpectrum:
        """Return the spectrum of changes of shape (runs, outputs, times), at steps of dt."""
        times = change.shape[-1]
        energy = (np.abs(np.fft.rfft(change * np.hanning(times))) ** 2).sum(axis=0)
        total = np.maximum(energy.sum(axis=-1, keepdims=True), 1e-300)
        return ErrorSpectrum(np.fft.rfftfreq(times, dt), energy / total, resolved)

    @property
    def largest(self) -> np.ndarray:
        """The frequency of each output at which it changes most, (outputs,)."""
        return self.frequency[self.energy.argmax(axis=-1)]

    def lag(self, duration: float, step: float) -> np.ndarray:
        """Return the phase error [rad] of each frequency at the end, (frequencies,)."""
        angular_frequency = 2 * np.pi * self.frequency
        return angular_frequency * duration * (angular_frequency * step) ** 2 / 12

    def after(self, halvings: int, lag: np.ndarray) -> np.ndarray:
        """Return the energy that is left after further halvings, (outputs, frequencies).

        `lag` is that of each frequency before them.
        """
        before = np.maximum(np.minimum(lag, 1.0), 1e-12)
        return self.energy * (np.minimum(lag / 4.0 ** max(halvings, 0), 1.0) / before) ** 2
