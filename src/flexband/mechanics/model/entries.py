"""What loads, and joints that are held by contacts or springs, enter in the equations of motion."""

from __future__ import annotations

from collections.abc import Mapping

from flexband.basics.checks import check_instance
from flexband.errors import InputError
from flexband.mechanics.joints.joint import Joint
from flexband.mechanics.loads.contacts import contact_entries
from flexband.mechanics.loads.load import Entries, Load, LoadModel
from flexband.mechanics.loads.springs import spring_entries
from flexband.mechanics.model.parts import name_errors


def entries_of(
    joints: Mapping[str, Joint], loads: Mapping[str, Load], model: LoadModel
) -> dict[str, Entries]:
    """Return what each part enters, by its name."""
    entries = {
        name: name_errors(f"load {name!r}", enter_load, load, model) for name, load in loads.items()
    }
    for name, joint in joints.items():
        contacts = joint.contacts(model.frame)
        compliances = joint.compliances(model.frame)
        if name in entries and (contacts or compliances or entries[name].frictions):
            raise InputError(
                f"joint {name!r} must not have the name of a load, since one of them has "
                "contacts, springs or friction"
            )
        if compliances:
            entries[name] = name_errors(f"joint {name!r}", spring_entries, compliances)
        if contacts:
            first, second = map(model.frame, joint.points)
            entries[name] = contact_entries(contacts, first, second, closed_at_start=False)
    return entries


def enter_load(load: Load, model: LoadModel) -> Entries:
    """Return what a load enters; raise `InputError` if that is something else than `Entries`."""
    entries = load.enters(model)
    check_instance("what it enters", entries, Entries, "Entries")
    return entries
