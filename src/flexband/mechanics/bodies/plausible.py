"""Remarks on numbers that are likely in other units than those of the SI.

Nothing is refused: gels, giants and models without dimensions exist.
"""

from __future__ import annotations

import numpy as np

from flexband.errors import warn

SOFTEST, STIFFEST = 10.0, 5e4
"""Speed of sound √(E/ρ) [m/s]: below that of the softest rubbers, and above that of diamond."""

THICKEST = 2.0
"""Size [m] across a part of a machine."""


def plausible_material(density: np.ndarray, youngs_modulus: np.ndarray) -> None:
    """Warn if no solid has this density [kg/m³] and this modulus [Pa]."""
    modulus, rho = float(np.median(youngs_modulus)), float(np.median(density))
    speed = np.sqrt(modulus / rho)
    if not SOFTEST < speed < STIFFEST:
        warn(
            f"a beam with a Young's modulus of about {modulus:.1g} Pa and a density of about "
            f"{rho:.2g} kg/m³ is {'softer' if speed <= SOFTEST else 'stiffer'} than any common "
            "solid; are these numbers in Pa and kg/m³?"
        )


def plausible_section(height: np.ndarray) -> None:
    """Warn if a section is so high [m] that the number may be in millimetres."""
    least = float(np.median(height))
    if least > THICKEST:
        warn(f"the section of a beam is about {least:.1g} m high; is this number in metres?")


def plausible_block(*sizes: np.ndarray) -> None:
    """Warn if the smallest size of a rigid body [m] may be in millimetres."""
    least = min(float(np.median(size)) for size in sizes)
    if least > THICKEST:
        warn(f"the smallest side of a rigid body is about {least:.1g} m; is this number in metres?")
