"""Sensors of power, and of what another sensor does over time: extremes, integrals, averages."""

from typing import TYPE_CHECKING

from flexband.namespaces import lazy_names

if TYPE_CHECKING:
    from flexband.mechanics.sensors.averages import Average as Average
    from flexband.mechanics.sensors.energies import Power as Power
    from flexband.mechanics.sensors.extremes import (
        Integral as Integral,
        Largest as Largest,
        Smallest as Smallest,
    )
else:
    __all__, __getattr__, __dir__ = lazy_names(__name__, __file__)
