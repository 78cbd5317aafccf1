"""What was not refused, or only after hours: each ends at once, in words."""

import gc
import http.client
import json
import time

import numpy as np
import pytest
import xarray as xr
from typer.testing import CliRunner

import flexband as fb
from flexband.cli import app

INPUTS = {"a": fb.Interval(0.9, 1.1), "x": fb.Normal(0, 1)}


def response(a, x):
    return np.outer(a + 0.1 * x, np.linspace(0.5, 1.0, 4))


def of_field(**options):
    field = fb.RandomField(1.0, 0.1, 1.0, domain=(0.0, 1.0), **options)
    return fb.propagate(lambda f: f(np.linspace(0, 1, 4)), {"f": field}, fb.PCCI(1, 1))


def series_of(length):
    return fb.fields.karhunen_loeve(
        fb.fields.exponential, length=length, domain=(0.0, 1.0), nodes=5
    )


def driven(function):
    drive = fb.PrescribedRotation("c", function)
    parts = {"bodies": {"c": fb.RigidBody(mass=np.ones(3), inertia=1.0)},
             "joints": {"pin": fb.Revolute("c", (0.0, 0.0)), "drive": drive},
             "sensors": {"angle": fb.Angle("c")}}  # fmt: skip
    return fb.simulate(fb.Mechanism(**parts), duration=0.02, step=0.01)


def without_response():
    surrogate = fb.expand(response, INPUTS, fb.PCCI(1, 1))
    return fb.analysis.failure_probability(surrogate, fb.Requirement("response", below=2.0), runs=8)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: fb.propagate(response, INPUTS, fb.LHSScanning(10, 10**9)), "points=100000"),
        (lambda: fb.propagate(response, INPUTS, fb.MonteCarlo(10, points=2**63)), "points=100000"),
        (lambda: of_field(correlation=fb.fields.Matern(1e-300)), "tolerance 0.05 .* is not met"),
        (lambda: of_field(tolerance=1e-300), "tolerance 1e-300 .* is not met"),
        (lambda: series_of(1.7e308), "correlation_length 1.7e.308 is too long"),
        (lambda: driven(lambda t: t * np.ones((3, 1))), r"one per sample, .* got shape \(3, 1\)"),
        (
            lambda: fb.models.ExternalProgram(["true", "${a}"], read=len, keep=3),
            "keep must be the path",
        ),  # pyright: ignore[reportArgumentType]
        (lambda: fb.ScipyDistribution("norm", 3), "must be pairs of a name, .* got 3"),  # pyright: ignore[reportArgumentType]
        (without_response, "runs requires a response"),
    ],
)
def test_refused_at_once(call, message):
    begin = time.process_time()
    with pytest.raises(fb.errors.InputError, match=message):
        call()
    assert time.process_time() - begin < 1.5


def test_a_fine_tolerance_that_more_nodes_meet_is_not_refused():
    field = fb.RandomField(1.0, 0.1, 1.0, domain=(0.0, 1.0), tolerance=2e-3,
                           correlation=fb.fields.exponential)  # fmt: skip
    assert field.dimension > 50


@pytest.mark.parametrize("number", [np.longdouble(2.0), xr.DataArray(2.0)])
def test_numbers_of_other_types_are_taken_as_floats(number):
    assert repr(fb.LogNormal(number, std=0.5)) == repr(fb.LogNormal(2.0, std=0.5))
    for series in (fb.fields.eole, fb.fields.karhunen_loeve, fb.fields.orthogonal_series):
        actual, expected = (
            series(fb.fields.exponential, length=length, domain=(0.0, 1.0), nodes=5)
            for length in (number, 2.0)
        )
        np.testing.assert_array_equal(actual.eigenvalues, expected.eigenvalues)


@pytest.mark.parametrize(
    "text",
    ["[]", "3", "{}", '{"format": 1}', '{"format": 1, "file": 3}', "[" * 100_000,
     '{"format": 1, "file": "a.py", "result": 5}', '{"format": 1, "elapsed": "long"}'],
)  # fmt: skip
@pytest.mark.parametrize("name", ["study.json", "page.json"])
def test_json_of_another_shape_is_refused_in_words(name, text, tmp_path):
    (tmp_path / name).write_text(text, encoding="utf-8")
    for command in ("status", "resume", "report", "check"):
        result = CliRunner().invoke(app, [command, str(tmp_path)])
        assert result.exit_code in (0, 1, 2)
        assert "Error:" not in result.output, result.output
        assert "line " not in result.output.replace("line 1 column", ""), result.output


def test_a_server_refuses_deep_json_large_requests_and_other_hosts():
    with fb.models.UMBridgeServer(lambda a: a[:, None] * np.ones(2), {"a": 1.0}, port=0) as server:
        host = server.url.removeprefix("http://")

        def reply_to(body, **headers):
            connection = http.client.HTTPConnection(host, timeout=10)
            connection.request("POST", "/ModelInfo", body, headers)
            answer = connection.getresponse()
            content = json.loads(answer.read())
            connection.close()
            return answer.status, content.get("error", {}).get("message", "")

        assert reply_to(b"{}", Host=host)[0] in (200, 400)
        assert "must be JSON" in reply_to(b"[" * 100_000)[1]
        for size in ("99999999999999", "-1", "many"):
            status, message = reply_to(b"", **{"Content-Length": size})
            assert (status, "Content-Length must be" in message) == (413, True)
        status, message = reply_to(b"{}", Host="evil.example:80")
        assert (status, "the host must be" in message) == (403, True)


def test_a_bad_address_is_refused_before_there_is_a_client():
    """One that did not start waits for its own thread when it is collected, 10 s or more."""
    gc.collect()
    for address in ("", "x", "here.and.there", "foo://a:1"):
        with pytest.raises(
            fb.errors.InputError, match=f"executor '{address}' is no Dask scheduler"
        ):
            fb.propagate(response, INPUTS, fb.PCCI(1, 1), executor=address)
        assert not any(type(tracked).__name__ == "Client" for tracked in gc.get_objects())


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: fb.propagate(response, INPUTS, fb.PCCI(1, 1), progress=lambda: None),
            r"progress is called as progress\(done, total\); got",
        ),
        (
            lambda: fb.propagate(response, INPUTS, fb.PCCI(1, 1), check=lambda: None),
            r"check is called as check\(outputs\); got",
        ),
        (
            lambda: fb.execution.open_runs("a" * 10_000),
            "folder must be the path of a folder; got 'aaa",
        ),
        (
            lambda: fb.analysis.p_box(
                fb.expand(response, INPUTS, fb.PCCI(1, 1)), time=xr.Dataset()
            ),
            "must be labels; got",
        ),
    ],
)
def test_callbacks_paths_and_labels_of_other_kinds_are_refused(call, message):
    with pytest.raises(fb.errors.InputError, match=message):
        call()


def test_a_duration_may_be_an_array_without_dims():
    of_arrays = fb.dynamic_response(lambda a: None, duration=xr.DataArray(0.1), step=np.array(0.01))
    assert of_arrays == fb.dynamic_response(of_arrays.builder, duration=0.1, step=0.01)
