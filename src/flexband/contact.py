"""Contacts: their geometry, normal laws, stops, and sensors of gaps and impacts."""

from typing import TYPE_CHECKING

from flexband.basics.namespaces import lazy_names

if TYPE_CHECKING:
    from flexband.mechanics.contact.friction import Coulomb as Coulomb
    from flexband.mechanics.contact.geometry.circle_on_line import CircleOnLine as CircleOnLine
    from flexband.mechanics.contact.geometry.circles import (
        CircleInCircle as CircleInCircle,
        CircleOnCircle as CircleOnCircle,
    )
    from flexband.mechanics.contact.geometry.geometry import Geometry as Geometry
    from flexband.mechanics.contact.normal_laws import (
        Flores as Flores,
        HuntCrossley as HuntCrossley,
        KeepsRestitution as KeepsRestitution,
        LankaraniNikravesh as LankaraniNikravesh,
        NormalLaw as NormalLaw,
        hertz_stiffness as hertz_stiffness,
    )
    from flexband.mechanics.joints.switched import Switched as Switched
    from flexband.mechanics.loads.brakes import (
        Brake as Brake,
        Clutch as Clutch,
        OneWayClutch as OneWayClutch,
    )
    from flexband.mechanics.loads.bristles import LuGre as LuGre
    from flexband.mechanics.loads.contacts import (
        AngularStop as AngularStop,
        Contact as Contact,
        Stop as Stop,
    )
    from flexband.mechanics.sensors.contacts import (
        ContactForce as ContactForce,
        Contacts as Contacts,
        FrictionForce as FrictionForce,
        Gap as Gap,
    )
else:
    __all__, __getattr__, __dir__ = lazy_names(__name__, __file__)
