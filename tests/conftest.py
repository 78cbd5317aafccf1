"""Shared settings of the tests."""

from hypothesis import settings

settings.register_profile("flexband", deadline=None, max_examples=25, derandomize=True)
settings.load_profile("flexband")
