"""The cheapest tolerances that still meet the requirements."""
