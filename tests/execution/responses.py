"""Responses that go wrong in every way, in processes of their own; NumPy only, to start quickly."""

import os
import signal
import sys
import time
from pathlib import Path

import numpy as np

LIMIT = 0.8416
"""Runs with a larger `b` at the end of `a` go wrong: two of ten strata of the normal one."""


def wrong(a, b, limit=LIMIT):
    return (np.asarray(a) > 1.9) & (np.asarray(b) > limit)


def true_response(a, b):
    return np.stack([a * b, a + np.sin(b)], axis=-1)


def logged(a, b, log, seconds=0.0):
    """Write the inputs of every run that begins to a file, and take some time for each."""
    with Path(log).open("a") as file:
        file.writelines(f"{x.hex()} {y.hex()}\n" for x, y in zip(a, b, strict=True))
    time.sleep(seconds * len(a))
    return true_response(a, b)


def bad(a, b, fault, limit=LIMIT, once=""):
    """Go wrong in some runs; with `once`, the path of a file, the first time only."""
    if not wrong(a, b, limit).any() or (once and Path(once).exists()):
        return true_response(a, b)
    if once:
        Path(once).touch()
    return globals()[fault](a, b, limit)


def raises(a, b, limit):
    raise ZeroDivisionError("the spring is slack")


def hangs(a, b, limit):
    time.sleep(60.0)


def returns_nan(a, b, limit):
    return np.where(wrong(a, b, limit)[..., None], np.nan, true_response(a, b))


def returns_another_shape(a, b, limit):
    return true_response(a, b)[..., :1]


def calls_exit(a, b, limit):
    sys.exit(0)


def exits(a, b, limit):
    os._exit(3)


def kills_its_process(a, b, limit):
    os.kill(os.getpid(), signal.SIGKILL)


IN_PROCESS = ("raises", "returns_nan", "returns_another_shape", "calls_exit")
FAULTS = (*IN_PROCESS, "hangs", "exits", "kills_its_process")
