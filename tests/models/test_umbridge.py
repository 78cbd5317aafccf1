"""UM-Bridge both ways, with the protocol's rules, and with the package's own client and server."""

import inspect
import json
import pickle
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, HTTPServer

import numpy as np
import pytest
import xarray as xr

import flexband as fb
from flexband.execution.fingerprint import fingerprint

T = np.linspace(0.0, 1.0, 5)
NOMINAL = {"x": 1.0, "e": 0.7}


def response(x, e):
    if np.any(x > 100.0):
        raise ArithmeticError("too large")
    values = np.stack([e[:, None] * np.cos(x[:, None] * T), 0 * x[:, None] + T], axis=1)
    values[x < 0.0] = np.nan
    return xr.DataArray(values, dims=("sample", "output", "time"), coords={"output": ["u", "v"]})


@pytest.fixture(scope="module")
def server():
    with fb.models.UMBridgeServer(response, NOMINAL, name="cosine", port=0) as server:
        yield server


def ask(server, path, body=None):
    """Return status and answer."""
    data = None if body is None else body if isinstance(body, bytes) else json.dumps(body).encode()
    try:
        with urllib.request.urlopen(f"{server.url}/{path}", data, timeout=10) as answer:
            return answer.status, json.load(answer)
    except urllib.error.HTTPError as error:
        return error.code, json.load(error)


def test_the_protocol(server):
    name = {"name": "cosine"}
    assert ask(server, "Info") == (200, {"protocolVersion": 1.0, "models": ["cosine"]})
    status, info = ask(server, "ModelInfo", name)
    assert status == 200
    features = {"Evaluate": True, "Gradient": False, "ApplyJacobian": False, "ApplyHessian": False}
    assert info == {"support": features}
    assert ask(server, "InputSizes", name | {"config": {}}) == (200, {"inputSizes": [2]})
    assert ask(server, "OutputSizes", name | {"config": {}}) == (200, {"outputSizes": [5, 5]})
    status, answer = ask(server, "Evaluate", name | {"input": [[2, 0.5]], "config": {}})
    assert status == 200
    np.testing.assert_array_equal(answer["output"], [0.5 * np.cos(2 * T), T])


@pytest.mark.parametrize(
    ("path", "body", "status", "kind"),
    [
        ("Evaluate", {"name": "sine"}, 400, "ModelNotFound"),
        ("InputSizes", {}, 400, "ModelNotFound"),
        ("ModelInfo", b"{", 400, "InvalidInput"),
        ("ModelInfo", [1], 400, "InvalidInput"),
        ("Gradient", {"name": "cosine"}, 400, "UnsupportedFeature"),
        ("ApplyJacobian", {"name": "cosine"}, 400, "UnsupportedFeature"),
        ("ApplyHessian", {"name": "cosine"}, 400, "UnsupportedFeature"),
        ("TestShMem", {"name": "cosine"}, 404, "UnsupportedFeature"),
        ("Evaluate", {"name": "cosine"}, 400, "InvalidInput"),
        ("Evaluate", {"name": "cosine", "input": [[1.0, 2.0, 3.0]]}, 400, "InvalidInput"),
        ("Evaluate", {"name": "cosine", "input": [[1.0], [2.0]]}, 400, "InvalidInput"),
        ("Evaluate", {"name": "cosine", "input": [1.0, 2.0]}, 400, "InvalidInput"),
        ("Evaluate", {"name": "cosine", "input": [["a", 2.0]]}, 400, "InvalidInput"),
        ("Evaluate", {"name": "cosine", "input": [[True, 2.0]]}, 400, "InvalidInput"),
        ("Evaluate", {"name": "cosine", "input": [[np.nan, 2.0]]}, 400, "InvalidInput"),
        ("Evaluate", {"name": "cosine", "input": [[1.0, 2.0]], "config": {"a": 1}}, 400,
         "InvalidInput"),
        ("Evaluate", {"name": "cosine", "input": [[101.0, 2.0]]}, 500, "InvalidOutput"),
        ("Evaluate", {"name": "cosine", "input": [[-1.0, 2.0]]}, 500, "InvalidOutput"),
    ],
)  # fmt: skip
def test_errors_of_the_protocol(server, path, body, status, kind):
    answer = ask(server, path, body)
    assert answer[0] == status
    assert answer[1].keys() == {"error"}
    assert answer[1]["error"].keys() == {"type", "message"}
    assert answer[1]["error"]["type"] == kind


def test_there_and_back(server):
    model = fb.models.UMBridgeModel(server.url, "cosine", ["x", "e"], outputs=["u", "v"], times=T)
    model = pickle.loads(pickle.dumps(model))
    assert list(inspect.signature(model).parameters) == ["x", "e"]
    inputs = {"x": fb.Normal(1.0, 0.1), "e": fb.Interval(0.5, 1.0)}
    bands = fb.propagate(model, inputs, fb.PCCI(2, 2))
    expected = fb.propagate(response, inputs, fb.PCCI(2, 2))
    np.testing.assert_allclose(bands["error_bar"], expected["error_bar"], rtol=1e-12)
    assert bands["mean"].dims == ("bound", "output", "time")
    assert list(bands["output"].values) == ["u", "v"]


def test_labels_of_outputs():
    def sizes(x):
        return x[:, None] * np.arange(1.0, 4.0)

    with fb.models.UMBridgeServer(sizes, {"x": 1.0}, port=0) as server:
        result = fb.models.UMBridgeModel(server.url, "flexband", ["x"])(x=[2.0, 3.0])
    assert result.dims == ("sample", "output", "entry")
    np.testing.assert_array_equal(result[:, 0], [[2.0, 4.0, 6.0], [3.0, 6.0, 9.0]])
    with fb.models.UMBridgeServer(lambda x: x**2, {"x": 1.0}, port=0) as server:
        result = fb.models.UMBridgeModel(server.url, "flexband", ["x"])(x=[2.0])
    assert result.dims == ("sample", "output")
    assert result.item() == 4.0


def test_a_surrogate_is_served():
    inputs = {"e": fb.Interval(0.5, 1.0),
              "f": fb.RandomField(1.0, 0.1, correlation_length=2.0, domain=(0.0, 1.0))}  # fmt: skip
    surrogate = fb.expand(lambda e, f: e[:, None] * f(np.linspace(0, 1, 3)), inputs, fb.PCCI(1, 1))
    terms = surrogate.space.random_dimension
    nominal = {"e": 0.7, "f": np.zeros(terms)}
    with fb.models.UMBridgeServer(surrogate, nominal, port=0) as server:
        xi = np.linspace(-1.0, 1.0, terms)
        model = fb.models.UMBridgeModel(
            server.url, "flexband", ["e", *(f"z{k}" for k in range(terms))]
        )
        result = model(e=[0.8], **{f"z{k}": [z] for k, z in enumerate(xi)})
        np.testing.assert_array_equal(result[:, 0], surrogate.evaluate(e=0.8, f=xi[None]))
        with pytest.raises(fb.errors.ModelError, match=r"InvalidInput.*e: values"):
            model(e=[2.0], **{f"z{k}": [0.0] for k in range(terms)})


@pytest.mark.parametrize(
    ("settings", "text"),
    [
        ({"url": "localhost:4242"}, "url must begin with http:// or https://; got 'localhost"),
        ({"name": "sine"}, "name must be 'cosine'; got 'sine'"),
        ({"inputs": ["x"]}, r"inputs must be 2 names, for input vectors of lengths \[2\]; got 1"),
        ({"inputs": "xe"}, "inputs must be a list of different names; got 'xe'"),
        ({"inputs": ["x", "x"]}, "inputs must be a list of different names"),
        ({"outputs": ["u"]}, r"outputs must be 2 names, for output vectors of lengths \[5, 5\]"),
        ({"times": [0.0, 1.0]}, r"times \[s\] must be as many as the entries .*\[5, 5\]; got 2"),
        ({"config": [1]}, "config must be a dict"),
        ({"time_limit": -1.0}, "time_limit"),
    ],
)
def test_bad_descriptions_are_refused(server, settings, text):
    arguments = {"url": server.url, "name": "cosine", "inputs": ["x", "e"], **settings}
    with pytest.raises(fb.errors.InputError, match=text):
        fb.models.UMBridgeModel(**arguments)


def test_errors_of_the_model_are_told(server):
    model = fb.models.UMBridgeModel(server.url, "cosine", ["x", "e"])
    with pytest.raises(fb.errors.ModelError, match=r"InvalidOutput.*ArithmeticError: too large"):
        model(x=[101.0], e=[1.0])
    with pytest.raises(fb.errors.InputError, match="the inputs are x, e; got x"):
        model(x=[1.0])
    with pytest.raises(fb.errors.InputError, match=r"x must be finite numbers; got 'a'|x must be"):
        model(x=["a"], e=[1.0])


@contextmanager
def answering(answers, delay=0.0):
    """Serve fixed answers, texts by path."""

    class Handler(BaseHTTPRequestHandler):
        def do_GET(self):
            self.rfile.read(int(self.headers.get("Content-Length", 0)))
            time.sleep(delay if self.path == "/Evaluate" else 0.0)
            self.send_response(200)
            self.end_headers()
            self.wfile.write(answers[self.path].encode())

        do_POST = do_GET  # noqa: N815

        def log_message(self, *args):
            pass

    server = HTTPServer(("127.0.0.1", 0), Handler)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    try:
        yield f"http://127.0.0.1:{server.server_port}"
    finally:
        server.shutdown()
        server.server_close()


GOOD = {
    "/Info": '{"protocolVersion": 1.0, "models": ["m"]}',
    "/ModelInfo": '{"support": {"Evaluate": true}}',
    "/InputSizes": '{"inputSizes": [1, 2]}',
    "/OutputSizes": '{"outputSizes": [1, 2]}',
    "/Evaluate": '{"output": [[1.0], [2.0, 3.0]]}',
}


@pytest.mark.parametrize(
    ("wrong", "kind", "text"),
    [
        (
            {"/Info": '{"protocolVersion": 2.0, "models": ["m"]}'},
            fb.errors.InputError,
            "it is of 2.0",
        ),
        (
            {"/ModelInfo": '{"support": {}}'},
            fb.errors.InputError,
            "model that can be evaluated; got 'm'",
        ),
        (
            {"/InputSizes": '{"inputSizes": "3"}'},
            fb.errors.ModelError,
            "/InputSizes as whole numbers",
        ),
        (
            {"/Evaluate": '{"output": [[1.0]]}'},
            fb.errors.ModelError,
            r"of lengths \[1, 2\]; got \[\[1.0",
        ),
        (
            {"/Evaluate": '{"output": [[1.0], ["a", 2]]}'},
            fb.errors.ModelError,
            r"vectors of lengths",
        ),
        ({"/Evaluate": '{"output": 1}'}, fb.errors.ModelError, "vectors of lengths"),
        ({"/Evaluate": '{"output": [[nan], [1, 2]]}'}, fb.errors.ModelError, "must be JSON; got"),
        (
            {"/Evaluate": '{"error": {"type": "A", "message": "b"}}'},
            fb.errors.ModelError,
            "reports {'type",
        ),
    ],
)
def test_wrong_answers_of_a_server(wrong, kind, text):
    with answering(GOOD | wrong) as url, pytest.raises(kind, match=text):
        fb.models.UMBridgeModel(url, "m", ["a", "b", "c"])(a=1.0, b=2.0, c=3.0)


def test_vectors_of_different_lengths_and_a_time_limit():
    with answering(GOOD) as url:
        result = fb.models.UMBridgeModel(url, "m", ["a", "b", "c"], outputs=["p", "q"])(
            a=1.0, b=2.0, c=3.0
        )
        models = [
            fb.models.UMBridgeModel(url, "m", ["a", "b", "c"], config={"n": n}) for n in (1, 2, 2)
        ]
    assert len(set(map(fingerprint, models))) == 2
    assert list(result["output"].values) == ["p[0]", "q[0]", "q[1]"]
    np.testing.assert_array_equal(result, [[1.0, 2.0, 3.0]])
    with answering(GOOD, delay=1.0) as url:
        model = fb.models.UMBridgeModel(url, "m", ["a", "b", "c"], time_limit=0.2)
        with pytest.raises(fb.errors.ModelError, match=r"no answer from .*/Evaluate: .*timed out"):
            model(a=1.0, b=2.0, c=3.0)
    with pytest.raises(fb.errors.ModelError, match=r"no answer from http://127.0.0.1:9/Info"):
        fb.models.UMBridgeModel("http://127.0.0.1:9", "m", ["a"])


def test_what_cannot_be_served():
    with pytest.raises(
        fb.errors.InputError, match=r"shape \(1, ...\); got shape \(\). A function of one"
    ):
        fb.models.UMBridgeServer(lambda x: 1.0, {"x": 1.0}, port=0)
    with pytest.raises(
        fb.errors.InputError, match=r"inputs must be a dict of names and values; got {}"
    ):
        fb.models.UMBridgeServer(lambda x: x, {}, port=0)
    with pytest.raises(
        fb.errors.InputError, match="inputs must be the arguments of the response: missi"
    ):
        fb.models.UMBridgeServer(lambda x, y: x, {"x": 1.0}, port=0)
    with pytest.raises(
        fb.errors.InputError, match="response must be a function or a surrogate; got 3"
    ):
        fb.models.UMBridgeServer(3, {"x": 1.0}, port=0)


def free_port():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


def wait_for(url):
    deadline = time.monotonic() + 20.0
    while True:
        try:
            return urllib.request.urlopen(f"{url}/Info", timeout=1).read()
        except OSError:
            assert time.monotonic() < deadline
            time.sleep(0.05)


def test_serve_ends_with_an_interrupt():
    port = free_port()
    code = f"import flexband as fb; fb.models.serve(lambda x: 2 * x, {{'x': 1.0}}, port={port})"
    process = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    try:
        wait_for(f"http://127.0.0.1:{port}")
        model = fb.models.UMBridgeModel(f"http://localhost:{port}", "flexband", ["x"])
        assert model(x=[3.0]).item() == 6.0
        process.send_signal(signal.SIGINT)
        out = process.communicate(timeout=60)[0]
        assert process.returncode == 0
        assert f"served by UM-Bridge at http://127.0.0.1:{port}" in out
    finally:
        process.kill()
        process.wait()


# --- the package's own client and server ---------------------------------------------------------


def test_the_packages_client(server):
    umbridge = pytest.importorskip("umbridge")
    client = umbridge.HTTPModel(server.url, "cosine")
    assert client.get_input_sizes() == [2]
    assert client.get_output_sizes() == [5, 5]
    assert client.supports_evaluate()
    assert not client.supports_gradient()
    np.testing.assert_array_equal(client([[2.0, 0.5]]), [0.5 * np.cos(2 * T), T])
    with pytest.raises(Exception, match="InvalidInput: input must be one vector of 2 numbers"):
        client([[2.0]])


PACKAGES_SERVER = """
import sys, umbridge
class Model(umbridge.Model):
    def __init__(self): super().__init__("forward")
    def get_input_sizes(self, config): return [1, 2]
    def get_output_sizes(self, config): return [2]
    def supports_evaluate(self): return True
    def __call__(self, parameters, config):
        (a,), (b, c) = parameters
        return [[a * b * config["factor"], c]]
umbridge.serve_models([Model()], int(sys.argv[1]))
"""


def test_the_packages_server():
    pytest.importorskip("umbridge")
    port = free_port()
    process = subprocess.Popen(
        [sys.executable, "-c", PACKAGES_SERVER, str(port)],
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip
    try:
        url = f"http://127.0.0.1:{port}"
        wait_for(url)
        model = fb.models.UMBridgeModel(url, "forward", ["a", "b", "c"], config={"factor": 10.0})
        result = model(a=[2.0, 1.0], b=[3.0, 1.0], c=[0.5, 0.25])
        np.testing.assert_array_equal(result[:, 0], [[60.0, 0.5], [10.0, 0.25]])
    finally:
        process.kill()
        process.wait()
