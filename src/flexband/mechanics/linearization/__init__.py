"""All derivatives at a state: equilibria, modes, steady motions."""
