"""Remarks on numbers that are likely in other units than those of the SI.

Nothing is refused: gels, giants and models without dimensions exist.
"""

from __future__ import annotations

import numpy as np

from flexband.basics.warning import warn


def plausible_material(density: np.ndarray, youngs_modulus: np.ndarray) -> None:
    """Warn if no solid has this density [kg/m³] and this modulus [Pa]."""
    modulus = float(np.median(youngs_modulus))
    rho = float(np.median(density))
    speed = np.sqrt(modulus / rho)  # of sound: lower in the softest rubbers, higher in diamond
    softest = 10.0
    stiffest = 5e4
    if not softest < speed < stiffest:
        warn(
            f"a beam with a Young's modulus of about {modulus:.1g} Pa and a density of about "
            f"{rho:.2g} kg/m³ is {'softer' if speed <= softest else 'stiffer'} than any common "
            "solid; are these numbers in Pa and kg/m³?"
        )


def plausible_thickness(what: str, size: np.ndarray, limit: float = 2.0) -> None:
    """Warn if a part of a machine is so thick [m] that the number may be in millimetres."""
    thickness = float(np.median(size))
    if thickness > limit:
        warn(f"{what.format(f'{thickness:.1g} m')}; is this number in metres?")


def plausible_length(what: str, length: np.ndarray, thickness: np.ndarray) -> None:
    """Warn if a bar is so long [m] and slender that its length may be in millimetres."""
    longest = float(np.median(length))
    thin = float(np.median(thickness))
    if longest > max(50.0, 2000.0 * thin):
        warn(
            f"{what} is about {longest:.3g} m long, {longest / thin:.2g} times its thickness of "
            f"{thin:.2g} m; is its length in metres?"
        )


def plausible_block(*sizes: np.ndarray) -> None:
    """Warn if the smallest size of a rigid body [m], or only its largest, may be in millimetres."""
    smallest, *_, longest = sorted(float(np.median(size)) for size in sizes)
    plausible_length("a rigid body", np.asarray(longest), np.asarray(smallest))
    plausible_thickness("the smallest side of a rigid body is about {}", np.asarray(smallest))
