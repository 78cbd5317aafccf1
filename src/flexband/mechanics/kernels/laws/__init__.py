"""Force laws on lanes: their memory, tangents, states and gaps, compiled."""
