"""Step and elements: which runs are refined, and what of the bands is corrected by them."""
