"""Sensors of power and force laws, and of what another sensor does over time."""

from typing import TYPE_CHECKING

from flexband.basics.namespaces import lazy_names

if TYPE_CHECKING:
    from flexband.mechanics.sensors.averages import Average as Average
    from flexband.mechanics.sensors.energies import Power as Power, SwitchingLoss as SwitchingLoss
    from flexband.mechanics.sensors.sensor_extremes import (
        Integral as Integral,
        Largest as Largest,
        Smallest as Smallest,
    )
    from flexband.mechanics.sensors.forces import LawForce as LawForce
else:
    __all__, __getattr__, __dir__ = lazy_names(__name__, __file__)
