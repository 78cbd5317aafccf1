"""Steps that every sample chooses, and events: contacts, sticking, switches."""
