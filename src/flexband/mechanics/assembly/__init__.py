"""From the model of a mechanism to arrays, and from arrays to lanes."""
