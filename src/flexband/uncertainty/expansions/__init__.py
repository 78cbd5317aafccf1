"""Polynomials, sparse sets of them and the hybrid expansion of Eq. (11); no responses or runs."""
