"""A function of one sample as a response."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from flexband.errors import check_function
from flexband.models.one_by_one import OneByOne


@dataclass(frozen=True)
class Samplewise(OneByOne):
    """``response(**values)``: call a function once per sample and stack what it returns."""

    function: Callable[..., Any]

    @property
    def __wrapped__(self) -> Callable[..., Any]:
        """The function that reads the arguments."""
        return self.function

    @property
    def __signature__(self) -> inspect.Signature:
        return inspect.signature(self.function)

    def sample(self, **values: Any) -> Any:
        return self.function(**values)


def samplewise(function_of_one: Callable[..., Any]) -> Samplewise:
    """Return a function of one sample as a response, which is called once per sample.

    Parameters
    ----------
    function_of_one : function that takes every input by name, as a plain number or text, or, for a
        field, as a function of positions of shape (points,) that returns as many values. It returns
        a number, an array or a `xarray.DataArray`, of the same shape and with the same labels for
        all samples.

    Raises
    ------
    InputError
        If it is no function.

    Examples
    --------
    >>> import math
    >>> import flexband as fb
    >>> response = fb.models.samplewise(lambda x: math.sin(x) if x > 0 else 0.0)
    >>> response(x=[0.0, math.pi / 2])
    array([0., 1.])
    """
    check_function("function_of_one", function_of_one)
    return Samplewise(function_of_one)
