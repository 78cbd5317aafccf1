"""Whether requirements are met: margins for the worst tolerances, and the yield."""
