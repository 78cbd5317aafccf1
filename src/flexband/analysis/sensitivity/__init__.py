"""How much of the scatter each input accounts for."""
