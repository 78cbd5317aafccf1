"""Shared settings of the tests."""

import gc
import os
import sys
from functools import cache

import typer.main
from hypothesis import settings

settings.register_profile("flexband", deadline=None, max_examples=25, derandomize=True)
settings.load_profile("flexband")

# CLI tests call the application again and again; Typer reads all signatures each time.
typer.main.get_params_from_function = cache(typer.main.get_params_from_function)

os.fsync = lambda _: None  # files need not outlast a loss of power

LONGEST = (
    "test_report", "test_examples", "test_options", "test_kills", "test_adaptive", "test_chance",
    "test_probability", "test_what_if", "test_cli", "test_folder", "test_caching", "test_motion",
    "test_failed_runs", "test_damage", "test_unconverged", "test_rebuilt", "test_fuzz",
    "test_interrupts", "test_threads", "test_honesty", "test_correction", "test_random_functions",
    "test_surrogate_files", "test_law_states", "test_memory", "test_phase_resolved",
)  # fmt: skip
"""Files that are begun first, the longest first, so that no process waits for one in the end."""


def pytest_collection_modifyitems(items):
    order = {name: place for place, name in enumerate(LONGEST)}
    items.sort(key=lambda item: order.get(item.path.stem, len(order)))


def pytest_collection_finish():
    """Leave what was imported to no search for garbage, of which there are many."""
    gc.freeze()


def pytest_runtest_logreport(report):
    """Name a test at once when it fails, not only when all have ended."""
    if report.failed and "PYTEST_XDIST_WORKER" not in os.environ:
        print(f"\nFAILED {report.nodeid}", file=sys.stderr, flush=True)


def pytest_xdist_auto_num_workers(config):
    """One process per core, and one for tests that wait."""
    return len(os.sched_getaffinity(0)) + 1 if hasattr(os, "sched_getaffinity") else None
