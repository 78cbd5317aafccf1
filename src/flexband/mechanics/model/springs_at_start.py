"""Warnings of springs that likely start where nobody means them to: wound up, or stretched."""

from __future__ import annotations

import numpy as np

from flexband.basics.warning import warn
from flexband.mechanics.kernels.forms import section_normal
from flexband.mechanics.loads.load import PairLoad
from flexband.mechanics.model.model import Model


def warn_of_windings(model: Model) -> None:
    """Warn of springs that begin wound up since their bodies are given angles turns apart."""
    for name, load in model.loads.items():
        rest = load.rest_turn if isinstance(load, PairLoad) else None
        if rest is None:
            continue
        first, second = (model.drawn(section_normal(model.frame(point))) for point in load.points)
        difference = np.subtract(first, second)
        twist = np.subtract(first, second) - rest
        if np.any((np.abs(difference) > np.pi) & (np.abs(twist) > np.pi)):
            largest = np.ravel(twist)[np.argmax(np.abs(twist))]
            warn(
                f"load {name!r} starts {largest:.3g} rad from its rest angle, since angles "
                "count from those that bodies are given, turns included; give its bodies "
                "angles on the same turn, unless it is wound up"
            )


def warn_of_stretched_joints(model: Model, size: float, largest: float = 0.01) -> None:
    """Warn of joints that give and start far from where they hold, which moves no body.

    A displacement is far from a part `largest` of the size [m] of the mechanism on, and an
    angle from ten times as many radians on.
    """
    for name, joint in model.joints.items():
        for travel, _, _, angular, relaxed in joint.compliances(model.frame):
            scale, unit = (10.0, "rad") if angular else (size, "m")
            stretch = 0.0 if relaxed else float(np.abs(model.at_guess(travel)).max())
            if stretch > largest * scale:
                warn(
                    f"joint {name!r} starts {stretch:.3g} {unit} from where it holds, and "
                    "moves no body there: a Compliant joint is a spring; give its bodies "
                    "places where its points meet, unless it is preloaded"
                )
