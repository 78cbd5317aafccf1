"""A UM-Bridge server ends what half-hearted or hostile clients begin, and says nothing of it."""

import json
import socket
import time
from urllib.parse import urlsplit

import numpy as np
import pytest

import flexband as fb
from flexband.models import umbridge_server
from flexband.models.limited_server import MemoryBudget, ServerLimits

LIMITS = ServerLimits(body=1000, request=0.3, idle=0.5, connections=4)


@pytest.fixture
def server(monkeypatch):
    monkeypatch.setattr(umbridge_server, "ServerLimits", lambda: LIMITS)
    inputs = {"x": 1.0}
    with fb.models.UMBridgeServer(lambda x: x[:, None], inputs, name="same", port=0) as served:
        yield served


def connect(server):
    address = urlsplit(server.url)
    return socket.create_connection((address.hostname, address.port), timeout=5)


def answer(connection):
    data = b""
    with connection:
        while part := connection.recv(4096):
            data += part
    return data


def request(server, body, *, size=None, head=""):
    connection = connect(server)
    length = len(body) if size is None else size
    connection.sendall(
        f"POST /Evaluate HTTP/1.1\r\nHost: {urlsplit(server.url).netloc}\r\n{head}"
        f"Connection: close\r\nContent-Length: {length}\r\n\r\n{body}".encode()
    )
    return connection


def evaluation(number="2.0"):
    return f'{{"name": "same", "input": [[{number}]]}}'


@pytest.mark.parametrize(
    "request_start",
    [b"", b"POST /Ev", b"POST /Evaluate HTTP/1.1\r\nContent-Length: 90\r\n\r\n{"],
)
def test_requests_that_are_not_finished_are_ended(server, request_start, capfd):
    connection = connect(server)
    start = time.monotonic()
    connection.sendall(request_start)
    assert answer(connection) == b""
    assert time.monotonic() - start < 3.0
    assert capfd.readouterr().err == ""


def test_a_request_that_comes_a_byte_at_a_time_is_ended(server):
    def send_slowly(connection):
        for byte in b"POST /Evaluate HTTP/1.1\r\n" + 1000 * b"X: a\r\n":
            connection.sendall(bytes([byte]))
            time.sleep(0.02)

    with connect(server) as connection, pytest.raises(ConnectionError):
        send_slowly(connection)


def test_further_connections_are_closed(server):
    connections = [connect(server) for _ in range(LIMITS.connections)]
    time.sleep(0.1)
    start = time.monotonic()
    assert answer(connect(server)) == b""
    assert time.monotonic() - start < 0.3  # at once, not after the time of idle ones
    for connection in connections:
        connection.close()
    time.sleep(0.2)
    assert b"200 OK" in answer(request(server, evaluation()))


def test_bodies_share_their_memory(server):
    pending = request(server, "{", size=900)
    time.sleep(0.1)
    assert b"503" in answer(request(server, evaluation().ljust(200)))
    assert answer(pending) == b""  # after its time
    assert b"200 OK" in answer(request(server, evaluation().ljust(900)))
    assert b"413" in answer(request(server, "", size=1001))
    budget = MemoryBudget(10)
    with budget.reserve(6) as first, budget.reserve(5) as second:
        assert (first, second) == (True, False)
    assert budget.remaining == 10


@pytest.mark.parametrize("origin", ["https://example.com", "null", "http://127.0.0.1:1"])
def test_requests_of_other_pages_are_refused(server, origin):
    refusal = answer(request(server, evaluation(), head=f"Origin: {origin}\r\n"))
    assert b"403" in refusal
    reply = answer(request(server, evaluation(), head=f"Origin: {server.url}\r\n"))
    assert json.loads(reply.partition(b"\r\n\r\n")[2]) == {"output": [[2.0]]}


@pytest.mark.parametrize("number", ["1" + 309 * "0", "-1" + 400 * "0", "1e999", "NaN", "true"])
def test_numbers_that_are_no_floats_are_refused(server, number, capfd):
    refusal = answer(request(server, evaluation(number)))
    assert b"400" in refusal
    assert b"must be finite numbers" in refusal
    assert capfd.readouterr().err == ""


def test_a_client_that_hangs_up_leaves_no_traceback(capfd):
    def response(x):
        time.sleep(0.3)
        return np.zeros((1, 100_000)) + x[:, None]

    with fb.models.UMBridgeServer(response, {"x": 1.0}, name="same", port=0) as server:
        connection = request(server, evaluation())
        connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, b"\1\0\0\0\0\0\0\0")
        connection.close()
        time.sleep(0.8)
    assert capfd.readouterr().err == ""
