"""Cross-sections of beams, and how stresses are integrated over them."""

from typing import TYPE_CHECKING

from flexband.basics.namespaces import lazy_names

if TYPE_CHECKING:
    from flexband.mechanics.bodies.section_stiffness import (
        FullIntegration as FullIntegration,
        SelectiveIntegration as SelectiveIntegration,
    )
    from flexband.mechanics.bodies.sections import (
        Circle as Circle,
        GeneralSection as GeneralSection,
        Rectangle as Rectangle,
    )
else:
    __all__, __getattr__, __dir__ = lazy_names(__name__, __file__)
