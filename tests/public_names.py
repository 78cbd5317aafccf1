"""The public objects of flexband and of its namespaces, by name."""

import flexband as fb
from flexband.basics.namespaces import NAMESPACES

PLACES = {"flexband": fb} | {f"flexband.{name}": getattr(fb, name) for name in NAMESPACES}
PUBLIC = {name: getattr(place, name) for place in PLACES.values() for name in place.__all__}
