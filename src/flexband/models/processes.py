"""Waiting for other processes."""

from __future__ import annotations

import os
import select
import subprocess

LONGEST = 2**31 - 1
"""Milliseconds that the system waits."""


def has_ended(process: subprocess.Popen, time_limit: float | None) -> bool:
    """Wait for the end of a process; return whether it has ended within the time limit [s].

    Where the system allows, its number stays taken, so that its group can safely be killed.
    """
    try:
        descriptor = os.pidfd_open(process.pid)
    except (AttributeError, OSError):  # not Linux
        try:
            process.wait(time_limit)
        except subprocess.TimeoutExpired:
            return False
        return True
    try:
        poll = select.poll()
        poll.register(descriptor, select.POLLIN)
        return bool(poll.poll(None if time_limit is None else min(1e3 * time_limit, LONGEST)))
    finally:
        os.close(descriptor)
