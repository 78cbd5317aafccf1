"""How results of a study are shown: in which units, and under which title."""
