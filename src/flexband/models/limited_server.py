"""An HTTP server that grants its clients so much time, so many connections and so much memory."""

from __future__ import annotations

import io
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, NamedTuple


class ServerLimits(NamedTuple):
    """What a server grants its clients."""

    body: int = 2**28
    """Bytes of the body of one request, and of all that are read at the same time."""
    request: float = 60.0
    """Time to send one request, once it has begun, and to take its answer [s]."""
    idle: float = 60.0
    """Time in which a connection may wait for its next request [s]."""
    connections: int = 64
    """At the same time; further ones are closed at once."""


class TimedReader(io.RawIOBase):
    """Reads from a connection: a request that has begun has a time limit, whatever its pace."""

    def __init__(self, connection: socket.socket, *, idle: float, request: float):
        self.connection = connection
        self.idle = idle
        self.request = request
        self.deadline: float | None = None  # of the request; None until it begins

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        remaining = self.idle if self.deadline is None else self.deadline - time.monotonic()
        if remaining <= 0:
            raise TimeoutError
        self.connection.settimeout(remaining)
        count = self.connection.recv_into(buffer)
        if self.deadline is None:
            self.deadline = time.monotonic() + self.request
        self.connection.settimeout(self.request)  # to take the answer
        return count


class MemoryBudget:
    """Bytes that all requests may take together."""

    def __init__(self, size: int):
        self.remaining = size
        self.lock = threading.Lock()

    @contextmanager
    def reserve(self, size: int) -> Iterator[bool]:
        """Reserve so many bytes, and give them back; tell whether there are so many."""
        with self.lock:
            granted = size <= self.remaining
            self.remaining -= size if granted else 0
        try:
            yield granted
        finally:
            with self.lock:
                self.remaining += size if granted else 0


class LimitedServer(ThreadingHTTPServer):
    """A server with a thread for each connection, as many as are allowed."""

    daemon_threads = True

    def __init__(self, address: tuple[str, int], handler: Any, limits: ServerLimits):
        self.limits = limits
        self.bodies = MemoryBudget(limits.body)
        self.connection_slots = threading.BoundedSemaphore(limits.connections)
        super().__init__(address, handler)

    def process_request(self, request: Any, client_address: Any) -> None:
        """Serve a connection in a thread, or close it if there are too many."""
        if not self.connection_slots.acquire(blocking=False):
            self.shutdown_request(request)
            return
        try:
            super().process_request(request, client_address)
        except BaseException:
            self.connection_slots.release()
            raise

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        try:
            super().process_request_thread(request, client_address)
        finally:
            self.connection_slots.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Print nothing where a client hangs up, or takes too long."""


class LimitedHandler(BaseHTTPRequestHandler):
    """Requests, each of which has its own time limit."""

    limits: ServerLimits
    bodies: MemoryBudget

    def setup(self) -> None:
        super().setup()
        assert isinstance(self.server, LimitedServer)
        self.limits = self.server.limits
        self.bodies = self.server.bodies
        self.timed = TimedReader(
            self.connection, idle=self.limits.idle, request=self.limits.request
        )
        self.rfile = io.BufferedReader(self.timed)

    def handle_one_request(self) -> None:
        """Serve a request, whose time begins with its first byte."""
        self.timed.deadline = None
        super().handle_one_request()
