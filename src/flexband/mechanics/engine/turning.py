"""Warnings of steps in which bodies, or the rods of joints, turn too far."""

from __future__ import annotations

import numpy as np

from flexband.errors import ResolutionWarning, warn
from flexband.mechanics.assembly.system import System
from flexband.mechanics.engine.generalized_alpha import GeneralizedAlpha

LARGEST_ERROR = 0.01
"""Of the speed of a body over a run, without a warning."""


def warn_of_large_steps(
    turned: np.ndarray, system: System, times: np.ndarray, integrator: GeneralizedAlpha
) -> None:
    """Warn of the part whose speed is wrong by the most, if it is by more than one per cent.

    To the leading order, a free body that turns by φ in a step loses ((1 − ρ)/(1 + ρ))² φ⁴/8 of its
    speed, and its angle lags behind by φ²/12 of what it turns.

    Parameters
    ----------
    turned : Σ φ⁴ over the run, shape (samples, parts).
    """
    if not turned.size:
        return
    rho = float(integrator.spectral_radius)
    sample, part = np.unravel_index(np.argmax(turned), turned.shape)
    most = float(turned[sample, part])
    loss = -np.expm1(-(((1 - rho) / (1 + rho)) ** 2) * most / 8)
    angle = (most / (len(times) - 1)) ** 0.25
    lag = angle**2 / 12
    if max(loss, lag) > LARGEST_ERROR:
        warn(
            f"{system.turning[part]} turns by about {angle:.2g} rad per step: numerical "
            f"damping takes about {loss:.2%} of its speed and its angle lags by about {lag:.2%}, "
            "unless a drive holds it; take a shorter step"
            + (" or a spectral_radius nearer to 1" if loss > LARGEST_ERROR else ""),
            ResolutionWarning,
        )
