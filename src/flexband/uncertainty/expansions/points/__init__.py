"""Points at which responses are run: nested and Sobol' points."""
