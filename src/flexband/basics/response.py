"""What a study runs: a function of its inputs, and what it says about itself."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from copy import copy
from typing import Any, NamedTuple, TypeVar

Answer = TypeVar("Answer")

ResponseFunction = Callable[..., Any]
"""``response(**values)``: takes one array of shape (n,) per input, or a function of position for a
field, and returns an array of shape (n, ...). `as_response` makes it a `Response`."""


class Description(NamedTuple):
    """What a response says about itself for values of its inputs; the defaults say nothing."""

    left_out: Sequence[str] = ()
    """What of the discretization is not given, so that the method chooses it."""
    by_default: Sequence[str] = ()
    """What of it has a default, which a study makes finer where that is too coarse."""
    discretization: Mapping[str, float] = {}
    """The numbers of the discretization, such as the step, by name."""
    refinements: Callable[[], Mapping[str, Response]] = dict
    """Returns the response on finer discretizations, by name; the finest may refuse to."""
    quantities: Sequence[str] = ()
    """Of which vector or tensor each output is a component, by name."""
    tensors: Sequence[str] = ()
    """Which of the quantities are tensors, by name."""
    impacts: bool = False
    """Whether bodies may hit each other, so that small differences grow."""


class Response(ABC):
    """A function of the inputs, and what it says about itself; the defaults say nothing.

    Attributes
    ----------
    elsewhere : whether it cannot be called, since other people run it: its runs are in a store.
    one_by_one : whether it is called with one sample at a time.
    refines : whether it has `refinements`.
    """

    elsewhere: bool = False
    one_by_one: bool = False
    refines: bool = False

    @abstractmethod
    def __call__(self, **values: Any) -> Any:
        """Return the outputs, dims (sample, ...).

        Parameters
        ----------
        values : every input by name: an array of shape (n,), or a function of position that returns
            shape (n, points).
        """

    @property
    def original(self) -> ResponseFunction:
        """The object that a user made: it is hashed, sent to other processes, and shown."""
        return self

    @property
    def source(self) -> Response:
        """The response whose outputs this one makes its own of: a simulation, for example."""
        return self

    def description(self, **values: Any) -> Description:
        """Return what it says about itself; values are those of a call, as in all methods."""
        return Description()

    @property
    def branch(self) -> str:
        """Text that tells its runs from those that follow other inputs, where they may differ."""
        return ""

    def on_branch_of(self, **nominal: Any) -> Response:
        """Return the response whose runs follow that of nominal values by continuity.

        It matters for what is known but for whole turns, as angles are.
        """
        return self

    def refinements(self, **values: Any) -> Mapping[str, Response]:
        """Return the response on finer discretizations, by the name of what is finer."""
        return self.description(**values).refinements()

    def at_more_times(self, **values: Any) -> Response | None:
        """Return the response at times that divide each of its steps; None if it has no others."""
        return None

    def started_softly(self, duration: float) -> Response | None:
        """Return the response whose motion starts at rest within a duration [s]; None if none."""
        return None

    def free_bodies(self, **values: Any) -> list[str]:
        """Return the bodies whose motion is not prescribed, as far as that is known."""
        return []

    def instantaneous(self, **values: Any) -> list[str] | None:
        """Return the outputs that follow from the inputs' values of one instant; None if unknown.

        Bounds of these hold for inputs that vary in time, too.
        """
        return None


def as_response(function: ResponseFunction) -> Response:
    """Return a function, or an object that says something about itself, as a `Response`."""
    return function if isinstance(function, Response) else FunctionResponse(function)


class FunctionResponse(Response):
    """A user's function as a response.

    It may have the methods `at_more_times`, `instantaneous` and `free_bodies` of a `Response`, and
    one for each field of a `Description`, which takes the values of a call. A method ``refined()``
    that returns one finer response is enough for estimates.
    """

    def __init__(self, function: ResponseFunction) -> None:
        self.function = function
        self.elsewhere = bool(self._attribute("elsewhere", default=False))
        self.one_by_one = bool(self._attribute("one_by_one", default=False))
        self.refines = callable(self._attribute("refinements", self._attribute("refined", None)))

    def __call__(self, **values: Any) -> Any:
        return self.function(**values)

    @property
    def original(self) -> ResponseFunction:
        return self.function

    def description(self, **values: Any) -> Description:
        def refine() -> Mapping[str, Response]:
            refined = self._attribute("refined", None)
            default_levels = {"discretization": refined()} if callable(refined) else {}
            levels = self._answer("refinements", default_levels, values)
            return {name: as_response(level) for name, level in levels.items()}

        answers = Description(refinements=refine)._asdict()
        for name in answers.keys() - {"refinements"}:
            answers[name] = self._answer(name, answers[name], values)
        return Description(**answers)

    def at_more_times(self, **values: Any) -> Response | None:
        response = self._answer("at_more_times", None, {})
        return None if response is None else as_response(response)

    def free_bodies(self, **values: Any) -> list[str]:
        return self._answer("free_bodies", [], values)

    def instantaneous(self, **values: Any) -> list[str] | None:
        return self._answer("instantaneous", None, values)

    def _attribute(self, name: str, default: Answer) -> Answer:
        return getattr(self.function, name, default)

    def _answer(self, name: str, default: Answer, values: Mapping[str, Any]) -> Answer:
        """Return what a method of the function returns, or the default if it has none."""
        method = self._attribute(name, None)
        return method(**values) if callable(method) else default


class WrappingResponse(FunctionResponse):
    """A response that flexband makes of another one, and has its source."""

    @property
    def original(self) -> ResponseFunction:
        return self

    @property
    def source(self) -> Response:
        return as_response(self.function).source

    @property
    def branch(self) -> str:
        return as_response(self.function).branch

    def on_branch_of(self, **nominal: Any) -> Response:
        bound = copy(self)
        function = as_response(self.function).on_branch_of(**nominal).original
        object.__setattr__(bound, "function", function)
        return bound

    def description(self, **values: Any) -> Description:
        return as_response(self.function).description(**values)

    def free_bodies(self, **values: Any) -> list[str]:
        return as_response(self.function).free_bodies(**values)

    def instantaneous(self, **values: Any) -> list[str] | None:
        return as_response(self.function).instantaneous(**values)

    def at_more_times(self, **values: Any) -> Response | None:
        return as_response(self.function).at_more_times(**values)
