"""Loads from tables, elastic bearings, and strains of members without stress."""

from typing import TYPE_CHECKING

from flexband.basics.namespaces import lazy_names

if TYPE_CHECKING:
    from flexband.mechanics.loads.bushings import Bushing as Bushing
    from flexband.mechanics.loads.characteristic import Characteristic as Characteristic
    from flexband.mechanics.loads.free_strain import FreeCurvature as FreeCurvature
    from flexband.mechanics.loads.free_strain import FreeStrain as FreeStrain
else:
    __all__, __getattr__, __dir__ = lazy_names(__name__, __file__)
