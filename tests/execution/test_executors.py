"""How many calls an executor has at a time, and how many of them one worker makes in turn."""

import time
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from threading import Lock

import numpy as np
import pytest

import flexband as fb
from flexband.execution.executors import with_executor

INPUTS = {"a": fb.Interval(1.0, 2.0), "b": fb.Normal(0.0, 1.0)}


class Remote(Executor):
    """Threads of which nothing is known but `submit`; counts what they are given."""

    def __init__(self, workers):
        self.threads = ThreadPoolExecutor(workers)
        self.lock = Lock()
        self.submissions = 0
        self.under_way = 0
        self.peak = 0

    def submit(self, function, /, *arguments, **_):
        with self.lock:
            self.submissions += 1
            self.under_way += 1
            self.peak = max(self.peak, self.under_way)
        future: Future = self.threads.submit(function, *arguments)
        future.add_done_callback(self._end)
        return future

    def _end(self, _):
        with self.lock:
            self.under_way -= 1


def quick(a, b):
    return np.array([a * b, a + b])


def delay(a):
    time.sleep(0.05)
    return a


def test_quick_calls_are_submitted_several_at_a_time_with_the_same_results():
    executor = Remote(4)
    method = fb.LHSScanning(1000, 4)
    response = fb.models.samplewise(quick)
    bands = fb.propagate(response, INPUTS, method, executor=executor)
    assert executor.submissions < 2500  # of 4000 runs
    assert fb.propagate(response, INPUTS, method).equals(bands)


@pytest.mark.parametrize("workers", [2, 40])
def test_as_many_calls_are_under_way_as_keep_the_workers_busy(workers):
    executor = Remote(workers)
    perform = with_executor(executor, first=4, least_work=0.0)
    tasks = [lambda k=k: {"a": float(k)} for k in range(60 * workers // 8)]
    outcomes = dict(perform(delay, tasks))
    assert [outcomes[k].value for k in range(len(tasks))] == list(range(len(tasks)))
    assert workers <= executor.peak <= 6 * workers


def test_a_call_that_fails_leaves_the_others_of_its_submission():
    def reciprocal(a):
        return 1.0 / a

    perform = with_executor(Remote(1), first=1, least_work=10.0)
    tasks = [lambda k=k: {"a": float(k % 10)} for k in range(100)]
    outcomes = dict(perform(reciprocal, tasks))
    failures = {k for k, outcome in outcomes.items() if outcome.error is not None}
    assert failures == set(range(0, 100, 10))
    assert outcomes[99].value == 1 / 9
