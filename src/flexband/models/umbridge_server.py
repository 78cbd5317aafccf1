"""A UM-Bridge server that offers a response or a surrogate to other programs."""

from __future__ import annotations

import inspect
import json
import math
import threading
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from flexband.basics.arguments import arguments_checked
from flexband.basics.checks import check_finite
from flexband.basics.words import number_of, value_text
from flexband.errors import InputError
from flexband.models.limited_server import LimitedHandler, LimitedServer, ServerLimits
from flexband.models.umbridge_client import PROTOCOL

LOOPBACK = ("127.0.0.1", "localhost", "[::1]", "::1")
"""Names of this computer for itself."""

UNSUPPORTED = ("Gradient", "ApplyJacobian", "ApplyHessian")


class _RefusedError(Exception):
    """An error of the protocol: its type, its message, and the status of HTTP."""

    def __init__(self, kind: str, message: str, status: int = 400):
        super().__init__(message)
        self.kind = kind
        self.status = status


@dataclass(frozen=True)
class _Offered:
    """A response as a model of UM-Bridge: one vector of numbers to vectors of numbers."""

    name: str
    response: Callable[..., Any]
    inputs: Mapping[str, np.ndarray]
    lock: threading.Lock = field(default_factory=threading.Lock)
    output_sizes: list[int] = field(default_factory=list)

    @property
    def input_size(self) -> int:
        return sum(value.size for value in self.inputs.values())

    def outputs(self, numbers: np.ndarray) -> np.ndarray:
        """Return the values of the response, shape (vectors, entries)."""
        values = {}
        begin = 0
        for name, like in self.inputs.items():
            entries = numbers[begin : begin + like.size]
            values[name] = entries if like.ndim == 0 else entries[None]
            begin += like.size
        with self.lock:  # a response need not be one for several threads
            outputs = self.response(**values)
        if isinstance(outputs, xr.DataArray) and "sample" in outputs.dims:
            outputs = outputs.transpose("sample", ...)
        result = np.asarray(outputs, dtype=float)
        if result.shape[:1] != (1,):
            raise InputError(
                f"the response must return shape (1, ...); got shape {result.shape}. A function of "
                "one sample becomes a response by fb.models.samplewise"
            )
        return result.reshape(-1, result.shape[-1])

    def answer(self, path: str, payload: dict[str, Any]) -> dict[str, Any]:
        """Return the answer to a request; raise `_RefusedError` if it breaks the protocol."""
        if path == "Info":
            return {"protocolVersion": PROTOCOL, "models": [self.name]}
        answers = {
            "ModelInfo": lambda: {
                "support": {"Evaluate": True} | dict.fromkeys(UNSUPPORTED, False)
            },
            "InputSizes": lambda: {"inputSizes": [self.input_size]},
            "OutputSizes": lambda: {"outputSizes": self.output_sizes},
            "Evaluate": lambda: {"output": self.evaluate(payload)},
        }
        if path not in (*answers, *UNSUPPORTED):
            raise _RefusedError("UnsupportedFeature", f"there is no /{path}", 404)
        if payload.get("name") != self.name:
            raise _RefusedError(
                "ModelNotFound", f"the model is {self.name!r}; got {payload.get('name')!r}"
            )
        if path in UNSUPPORTED:
            raise _RefusedError("UnsupportedFeature", f"{path} is not supported")
        if payload.get("config"):
            raise _RefusedError(
                "InvalidInput", f"config must be empty; got {value_text(payload['config'])}"
            )
        return answers[path]()

    def evaluate(self, payload: dict[str, Any]) -> list[list[float]]:
        """Evaluate a request and return its output vectors."""
        vectors = payload.get("input")
        if not isinstance(vectors, list) or [_length(v) for v in vectors] != [self.input_size]:
            raise _RefusedError(
                "InvalidInput",
                f"input must be one vector of {number_of(self.input_size, 'number')}, "
                f"{', '.join(self.inputs)}; got {value_text(vectors)}",
            )
        for number in vectors[0]:
            if type(number) not in (int, float) or not _is_finite(number):
                raise _RefusedError(
                    "InvalidInput", f"input must be finite numbers; got {value_text(number)}"
                )
        try:
            outputs = self.outputs(np.array(vectors[0], dtype=float))
        except InputError as error:
            raise _RefusedError("InvalidInput", str(error)) from error
        except Exception as error:
            kind = type(error).__name__
            raise _RefusedError(
                "InvalidOutput", f"the model fails: {kind}: {error}", 500
            ) from error
        if [len(row) for row in outputs] != self.output_sizes or not np.isfinite(outputs).all():
            raise _RefusedError(
                "InvalidOutput", f"the model must return finite vectors of lengths "
                f"{self.output_sizes}; got {value_text(outputs.tolist())}", 500,
            )  # fmt: skip
        return outputs.tolist()


class _Handler(LimitedHandler):
    """Requests of UM-Bridge."""

    protocol_version = "HTTP/1.1"
    disable_nagle_algorithm = True

    def __init__(self, offered: _Offered, listening: str, *arguments: Any):
        self.offered = offered
        self.listening = listening
        super().__init__(*arguments)

    def do_GET(self) -> None:  # noqa: N802
        self._reply(0)

    def do_POST(self) -> None:  # noqa: N802
        text = self.headers.get("Content-Length", "0")
        max_size = self.limits.body
        size = int(text) if text.isdecimal() and len(text) < 10 else max_size + 1
        if size > max_size:
            message = f"Content-Length must be {max_size} or less; got {text}"
            self._refuse_unread(413, value_text(message))
            return
        with self.bodies.reserve(size) as granted:
            if granted:
                self._reply(size)
            else:
                self._refuse_unread(503, "other requests take all the memory; send it again")

    def _refuse_unread(self, status: int, message: str) -> None:
        """Refuse a request whose body is not read, so that nothing can follow."""
        self.close_connection = True
        self._answer(status, {"error": {"type": "InvalidInput", "message": message}})

    def _reply(self, size: int) -> None:
        try:
            self._check_host()
            try:
                payload = json.loads(self.rfile.read(size) or "{}")
            except (ValueError, RecursionError) as error:
                raise _RefusedError("InvalidInput", f"the request must be JSON: {error}") from None
            if not isinstance(payload, dict):
                raise _RefusedError(
                    "InvalidInput", f"the request must be an object; got {value_text(payload)}"
                )
            status = 200
            answer = self.offered.answer(self.path.strip("/"), payload)
        except _RefusedError as error:
            status = error.status
            answer = {"error": {"type": error.kind, "message": str(error)}}
        except MemoryError:
            self._refuse_unread(503, "the request takes more memory than is free")
            return
        self._answer(status, answer)

    def _check_host(self) -> None:
        """Refuse requests that a page of another host makes a browser send to this computer."""
        listening = self.listening
        host = self.headers.get("Host", listening).rpartition(":")
        name = host[0] if host[2].isdecimal() and host[0] else self.headers.get("Host", listening)
        if listening in LOOPBACK and name not in LOOPBACK:
            message = f"the host must be {' or '.join(LOOPBACK)}; got {value_text(name)}"
            raise _RefusedError("InvalidInput", message, 403)
        origin = self.headers.get("Origin")
        if origin is not None and origin.partition("://")[2] != self.headers.get("Host"):
            message = f"requests of web pages must be of this server; got {value_text(origin)}"
            raise _RefusedError("InvalidInput", message, 403)

    def _answer(self, status: int, answer: Any) -> None:
        data = json.dumps(answer).encode()
        self.send_response(status)
        self.send_header("Content-Type", "application/json")
        self.send_header("Content-Length", str(len(data)))
        self.end_headers()
        self.wfile.write(data)

    def log_message(self, format: str, *args: Any) -> None:
        """Write no log."""


@arguments_checked
class UMBridgeServer:
    """A server that offers a response or a surrogate by the protocol UM-Bridge 1.0.

    ``with UMBridgeServer(...) as server:`` serves in the background, at ``server.url``. The model
    has one input vector, of all inputs in their order, and one output vector for each output (for
    every combination of all dims but the last). It does not take a `config`. Calls of the response
    are made one after another.

    Parameters
    ----------
    response : vectorized response, or a surrogate.
    inputs : name of each input -> a value at which the response is run once, to know the lengths of
        its outputs: a number; standard variables, shape (terms,), for a field of a surrogate.
    name : of the model.
    host : address on which the server listens; by default, other computers cannot reach it. Anybody
        who can reach it can run the model.
    port : 0 for any free one.

    Raises
    ------
    InputError
        If the inputs are not the arguments of the response, or it does not return shape (1, ...)
        for them.
    OSError
        If the port is not free.
    """

    def __init__(
        self,
        response: Any,
        inputs: Mapping[str, ArrayLike],
        *,
        name: str = "flexband",
        host: str = "127.0.0.1",
        port: int = 4242,
    ):
        function = response if callable(response) else getattr(response, "evaluate", None)
        if not callable(function):
            raise InputError(
                f"response must be a function or a surrogate; got {value_text(response)}"
            )
        if not isinstance(inputs, Mapping) or not inputs:
            raise InputError(f"inputs must be a dict of names and values; got {value_text(inputs)}")
        if not all(isinstance(input_name, str) for input_name in inputs):
            raise InputError(f"names of inputs must be texts; got {value_text(list(inputs))}")
        values = {k: check_finite(k, np.asarray(value), rank=1) for k, value in inputs.items()}
        try:
            inspect.signature(function).bind(**values)
        except TypeError as error:
            raise InputError(f"inputs must be the arguments of the response: {error}") from None
        offered = _Offered(name, function, values)
        first = offered.outputs(np.concatenate([np.ravel(v) for v in values.values()]))
        offered.output_sizes.extend(len(vector) for vector in first)
        self._server = LimitedServer((host, port), partial(_Handler, offered, host), ServerLimits())
        self.url = f"http://{host}:{self._server.server_port}"

    def serve_forever(self) -> None:
        """Serve until the program is interrupted."""
        with self._server:
            self._server.serve_forever()

    def __enter__(self) -> UMBridgeServer:
        threading.Thread(target=self._server.serve_forever, daemon=True).start()
        return self

    def __exit__(self, *of_error: object) -> None:
        self._server.shutdown()
        self._server.server_close()


def serve(
    response: Any,
    inputs: Mapping[str, ArrayLike],
    *,
    name: str = "flexband",
    host: str = "127.0.0.1",
    port: int = 4242,
) -> None:
    """Offer a response or a surrogate by UM-Bridge until the program is interrupted.

    Parameters and errors are those of `UMBridgeServer`, which serves in the background.
    """
    server = UMBridgeServer(response, inputs, name=name, host=host, port=port)
    print(f"{name} is served by UM-Bridge at {server.url}; Ctrl-C ends it", flush=True)
    try:
        server.serve_forever()
    except KeyboardInterrupt:
        print("stopped")


def _is_finite(number: float) -> bool:
    """Return whether a number is finite as a float, which long integers are not."""
    try:
        return math.isfinite(number)
    except OverflowError:
        return False


def _length(vector: object) -> int | None:
    return len(vector) if isinstance(vector, list) else None
