"""Shared settings of the tests."""

import os
import sys

from hypothesis import settings

settings.register_profile("flexband", deadline=None, max_examples=25, derandomize=True)
settings.load_profile("flexband")


def pytest_runtest_logreport(report):
    """Name a test at once when it fails, not only when all have ended."""
    if report.failed and "PYTEST_XDIST_WORKER" not in os.environ:
        print(f"\nFAILED {report.nodeid}", file=sys.stderr, flush=True)


def pytest_xdist_auto_num_workers(config):
    """One process per core, and one for tests that wait."""
    return len(os.sched_getaffinity(0)) + 1 if hasattr(os, "sched_getaffinity") else None
