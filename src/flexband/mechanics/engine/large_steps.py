"""A warning of steps in which bodies turn so far that the integrator slows them down."""

from __future__ import annotations

import numpy as np

from flexband.errors import warn
from flexband.mechanics.assembly.system import System
from flexband.mechanics.engine.generalized_alpha import GeneralizedAlpha

LARGEST_LOSS = 0.01
"""Of the speed of a body over a run, without a warning."""


def warn_of_large_steps(
    turned: np.ndarray, system: System, times: np.ndarray, integrator: GeneralizedAlpha
) -> None:
    """Warn of the body that the numerical damping slows down most.

    A free body that turns by φ in a step loses ((1 − ρ)/(1 + ρ))² φ⁴/8 of its speed, to the leading
    order.

    Parameters
    ----------
    turned : Σ φ⁴ over the run, shape (samples, bodies).
    """
    if not turned.size:
        return
    rho = float(integrator.spectral_radius)
    sample, body = np.unravel_index(np.argmax(turned), turned.shape)
    most = float(turned[sample, body])
    loss = -np.expm1(-(((1 - rho) / (1 + rho)) ** 2) * most / 8)
    if loss > LARGEST_LOSS:
        angle = (most / (len(times) - 1)) ** 0.25
        warn(
            f"body {system.turning[body]!r} turns by about {angle:.2g} rad per step, and numerical "
            f"damping takes about {100 * loss:.2g} % of its speed, unless a drive holds it; take a "
            "shorter step or a spectral_radius nearer to 1"
        )
