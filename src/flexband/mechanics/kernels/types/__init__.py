"""Numba's types of what kernels compute with, which are imported only to compile them."""
