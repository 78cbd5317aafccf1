"""Rules for the moments of phases, and the second one that judges them."""
