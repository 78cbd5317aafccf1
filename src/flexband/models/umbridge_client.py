"""A model behind a UM-Bridge server as a response."""

from __future__ import annotations

import inspect
import json
import urllib.error
import urllib.request
from collections.abc import Mapping, Sequence
from dataclasses import field
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import ArrayLike

from flexband.basics.arguments import frozen
from flexband.basics.checks import (
    check_finite,
    check_instance,
    check_numbers,
    check_option,
    check_positive,
)
from flexband.basics.words import number_of, value_text
from flexband.errors import InputError, ModelError
from flexband.models.one_by_one import OneByOne

PROTOCOL = 1.0


@frozen()
class UMBridgeModel(OneByOne):
    """``response(**values)``: evaluate a model of a UM-Bridge server for each sample.

    The model's input vectors are filled with the inputs one after another. If its output vectors
    are equally long, the dims of the result are (sample, output, entry), with "time" in place of
    "entry" if `times` are given, or (sample, output) if each has one entry only. If they are not,
    all their entries together have the dim "output".

    Parameters
    ----------
    url, name : address of the server, such as ``"http://localhost:4242"``, and name of the model.
    inputs : names of the inputs, in the order of the numbers in the model's input vectors.
    outputs : names of the output vectors; "0", "1", … by default.
    times : of the entries of the output vectors [s].
    config : passed on to the model.
    time_limit : longest time of a run [s].

    Attributes
    ----------
    input_sizes, output_sizes : lengths of the model's input and output vectors.

    Raises
    ------
    InputError
        If the model does not exist, cannot be evaluated, or has not as many inputs, outputs or
        times; by a call, if its names are not those of the inputs, or a value is no finite number.
    ModelError
        Also by a call, if the server cannot be reached or reports an error.

    References
    ----------
    Seelinger, Cheng-Seelinger, Davis, Parno and Reinarz, *UM-Bridge: Uncertainty quantification
    and modeling bridge*, Journal of Open Source Software (2023), doi:10.21105/joss.04748; protocol
    1.0.
    """

    url: str
    name: str
    inputs: Sequence[str]
    outputs: Sequence[str] | None = None
    times: ArrayLike | None = None
    config: Mapping[str, Any] = field(default_factory=dict)
    time_limit: float | None = None
    input_sizes: tuple[int, ...] = field(init=False, default=())
    output_sizes: tuple[int, ...] = field(init=False, default=())

    def __post_init__(self) -> None:
        check_instance("url", self.url, str)
        if not self.url.startswith(("http://", "https://")):
            raise InputError(f"url must begin with http:// or https://; got {self.url!r}")
        if self.time_limit is not None:
            check_positive("time_limit [s]", check_numbers("time_limit [s]", self.time_limit))
        check_instance("config", self.config, Mapping, "a dict")
        inputs = _names("inputs", self.inputs)
        about = self._ask("Info")
        if about.get("protocolVersion") != PROTOCOL:
            raise InputError(
                f"url must be that of a server of UM-Bridge {PROTOCOL}; it is of "
                f"{about.get('protocolVersion')!r}"
            )
        check_option("name", self.name, about.get("models", []))
        of_model = {"name": self.name}
        if not self._ask("ModelInfo", of_model).get("support", {}).get("Evaluate"):
            raise InputError(f"name must be a model that can be evaluated; got {self.name!r}")
        of_model |= {"config": dict(self.config)}
        attributes = {
            "url": self.url.rstrip("/"),
            "inputs": inputs,
            "input_sizes": self._sizes("InputSizes", of_model),
            "output_sizes": self._sizes("OutputSizes", of_model),
            "times": None if self.times is None else _times(self.times),
        }
        if self.outputs is not None:
            attributes["outputs"] = _names("outputs", self.outputs)
        for name, value in attributes.items():
            object.__setattr__(self, name, value)
        self._check_sizes()
        kind = inspect.Parameter.KEYWORD_ONLY
        signature = inspect.Signature([inspect.Parameter(name, kind) for name in self.inputs])
        object.__setattr__(self, "__signature__", signature)  # of the instance, not of the class

    def _check_sizes(self) -> None:
        if len(self.inputs) != sum(self.input_sizes):
            raise InputError(
                f"inputs must be {number_of(sum(self.input_sizes), 'name')}, for input vectors of "
                f"lengths {list(self.input_sizes)}; got {len(self.inputs)}"
            )
        if self.outputs is not None and len(self.outputs) != len(self.output_sizes):
            raise InputError(
                f"outputs must be {number_of(len(self.output_sizes), 'name')}, for output vectors "
                f"of lengths {list(self.output_sizes)}; got {len(self.outputs)}"
            )
        if self.times is not None and {len(self._times)} != set(self.output_sizes):
            raise InputError(
                f"times [s] must be as many as the entries of the output vectors, "
                f"{list(self.output_sizes)}; got {len(self._times)}"
            )

    @property
    def identity(self) -> tuple[object, ...]:
        """What the results depend on, as far as it is known here."""
        config = json.dumps(dict(self.config), sort_keys=True)
        sizes = self.input_sizes, self.output_sizes
        return self.url, self.name, self.inputs, self.outputs, self.times, config, sizes

    @property
    def _times(self) -> tuple[float, ...]:
        return self.times  # pyright: ignore[reportReturnType]

    def sample(self, **values: Any) -> xr.DataArray:
        """Return the outputs of one evaluation."""
        if values.keys() != set(self.inputs):
            raise InputError(
                f"the inputs are {', '.join(self.inputs)}; got {', '.join(values) or 'nothing'}"
            )
        numbers = [float(check_numbers(name, values[name])) for name in self.inputs]
        ends = np.cumsum(self.input_sizes)
        vectors = [
            numbers[end - size : end] for size, end in zip(self.input_sizes, ends, strict=True)
        ]
        payload = {"name": self.name, "input": vectors, "config": dict(self.config)}
        output = self._ask("Evaluate", payload).get("output")
        try:
            vectors = [np.array(vector, dtype=float) for vector in output or ()]
        except (TypeError, ValueError):
            vectors = []
        if [vector.shape for vector in vectors] != [(size,) for size in self.output_sizes]:
            raise ModelError(
                f"{self.name} of {self.url} must return vectors of lengths "
                f"{list(self.output_sizes)}; got {value_text(output)}"
            )
        return self._label_outputs(vectors)

    def _label_outputs(self, vectors: list[np.ndarray]) -> xr.DataArray:
        names = list(self.outputs or map(str, range(len(vectors))))
        if len(set(self.output_sizes)) > 1:
            sized = zip(names, self.output_sizes, strict=True)
            names = [f"{name}[{k}]" for name, size in sized for k in range(size)]
            return xr.DataArray(np.concatenate(vectors), [("output", names)])
        values = np.stack(vectors)
        if self.times is not None:
            time = ("time", np.array(self._times), {"units": "s"})
            return xr.DataArray(values, [("output", names), time])
        if values.shape[1] == 1:
            return xr.DataArray(values[:, 0], [("output", names)])
        return xr.DataArray(values, dims=("output", "entry"), coords={"output": names})

    def _ask(self, path: str, payload: dict[str, Any] | None = None) -> dict[str, Any]:
        """Return the answer of the server; raise `ModelError` if it is an error, or none."""
        url = f"{self.url.rstrip('/')}/{path}"
        data = None if payload is None else json.dumps(payload).encode()
        request = urllib.request.Request(url, data, {"Content-Type": "application/json"})
        try:
            with urllib.request.urlopen(request, timeout=self.time_limit) as answer:
                body = answer.read()
        except urllib.error.HTTPError as error:
            body = error.read() or str(error).encode()
        except OSError as error:
            raise ModelError(f"no answer from {url}: {error}") from error
        try:
            content = json.loads(body)
        except ValueError:
            content = None
        if not isinstance(content, dict):
            raise ModelError(f"the answer of {url} must be JSON; got {value_text(body.decode())}")
        if "error" in content:
            raise ModelError(f"{self.name} of {self.url} reports {content['error']}")
        return content

    def _sizes(self, path: str, payload: dict[str, Any]) -> tuple[int, ...]:
        sizes = self._ask(path, payload).get(f"{path[0].lower()}{path[1:]}")
        if not isinstance(sizes, list) or not all(type(n) is int and n > 0 for n in sizes):
            raise ModelError(
                f"{self.url} must return /{path} as whole numbers; got {value_text(sizes)}"
            )
        return tuple(sizes)


def _names(kind: str, names: object) -> tuple[str, ...]:
    if isinstance(names, str) or not isinstance(names, Sequence) or len(set(names)) < len(names):
        raise InputError(f"{kind} must be a list of different names; got {value_text(names)}")
    for name in names:
        check_instance(kind, name, str, "a list of names")
    return tuple(names)


def _times(times: ArrayLike) -> tuple[float, ...]:
    return tuple(np.atleast_1d(check_finite("times [s]", times, rank=None)).tolist())
