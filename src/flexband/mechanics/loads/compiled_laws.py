"""Force laws as compiled code: checked, and compiled once for each meaning.

Numba freezes the globals and the closure of a function when it compiles it. A law is therefore
known here by its code and by the values that the code reads. The same lambda made again in a loop
is compiled once, and a law whose globals have changed is compiled anew.
"""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable, Hashable, Iterable, Iterator
from functools import singledispatch
from hashlib import sha256
from itertools import accumulate
from types import CellType, CodeType, FunctionType, ModuleType, NoneType
from typing import Any, NamedTuple, cast

import numpy as np
from numba import cfunc, njit
from numba.core.dispatcher import Dispatcher
from numba.np.numpy_support import carray

from flexband.basics.warning import warn
from flexband.compilation.caching import cached_on_disk
from flexband.errors import InputError
from flexband.mechanics.kernels.lane_arrays import WIDTH
from flexband.mechanics.kernels.laws.forces import AXES, GAP_MEMORY
from flexband.mechanics.loads.law_shape import CompiledLaw, Law, LawFailure, LawShape, failures_here
from flexband.mechanics.loads.lines import add_lines, pass_on
from flexband.mechanics.loads.solved_states import (
    OUTCOME,
    LawArrays,
    LawCall,
    call_report,
    fill_stiffness,
    scratch_of,
    scratch_size,
    solve,
)

Functions = tuple[FunctionType, ...]

Report = ctypes.CFUNCTYPE(None, ctypes.c_int64, ctypes.c_int64, ctypes.c_int64)

_laws: dict[Hashable, CompiledLaw] = {}
_lock = threading.Lock()


def compiled_law(law: Law, shape: LawShape, *, many: int = 200) -> CompiledLaw:
    """Return a law for so many points, parameters and states; indices are checked when it runs.

    The compilation of `many` laws is warned of: Numba does not give back the 2 MB of each.
    """
    references: list = [law]
    try:
        key = law if shape.contact else _code_key(law, references, ()), shape
        with _lock:
            if key not in _laws:
                _laws[key] = _compile(law, shape, references)
                if len(_laws) == many:
                    warn(
                        f"{many} force laws have been compiled; each takes memory until the "
                        "process ends. Numbers that change should be parameters of a ForceLaw"
                    )
            return _laws[key]
    except InputError:
        raise
    except Exception as error:
        raise InputError(f"the law {law!r} does not compile: {error}") from None


class _MemoryRows(NamedTuple):
    """Where the memory of a law has x, v, force, …, and its end; see `kernels.laws.forces`."""

    x: int
    v: int
    force: int
    y: int
    b: int
    tau: int
    rate: int
    mode: int
    gap: int
    gap_end: int
    differentiated: int
    nudge: int
    pace: int
    stiffness: int
    end: int

    @staticmethod
    def from_shape(shape: LawShape) -> _MemoryRows:
        """Return the rows of a law."""
        axes = AXES * shape.points
        events = shape.events
        sizes = [1 + shape.parameters, *[axes] * 3, *[shape.states] * 4, events, events]
        sizes += [(GAP_MEMORY - 2) * events, 1, axes, axes, axes * axes]
        return _MemoryRows(*accumulate(sizes))


def _compile(law: Law, shape: LawShape, references: list) -> CompiledLaw:
    if shape.contact:
        code = cfunc("void(intp)", error_model="numpy")(law)
        return CompiledLaw(cast(int, code.address), (code, *references))
    dispatcher = _compile_with_checks(law, {})
    done = []
    pairs = np.array(shape.lines, dtype=np.int64).reshape(-1, 3)
    report = _reporter(dispatcher, shape, pairs, done)
    code = cfunc(f"int64(float64{8 * ', CPointer(float64)'})", error_model="numpy")(
        _one_sample(dispatcher, shape)
    )
    _check_return(law, dispatcher, shape)
    rows = _MemoryRows.from_shape(shape)
    report_address = ctypes.cast(report, ctypes.c_void_p).value
    address, entry_point = every_lane.at_address(
        np.zeros((rows.end, WIDTH)), rows, pairs, cast(int, code.address), report_address
    )
    done.append(CompiledLaw(address, (entry_point, code, pairs, report, *references)))
    return done[0]


def _reporter(
    dispatcher: Dispatcher, shape: LawShape, pairs: np.ndarray, done: list[CompiledLaw]
) -> Any:
    """Return a C function that notes why the law, which will be `done`, failed in a lane."""
    at, points, count = _MemoryRows.from_shape(shape), shape.points, shape.points + len(shape.lines)

    @Report
    def report(address: int, lane: int, outcome: int) -> None:
        memory = (ctypes.c_double * (at.end * WIDTH)).from_address(address)
        column = np.array(memory).reshape(at.end, WIDTH)[:, lane]
        x, v, force = np.zeros((3, count, AXES))
        x[:points], v[:points] = column[at.x : at.force].reshape(2, points, AXES)
        add_lines.py_func(pairs, points, x, v)
        y = column[at.y : at.b]
        p = column[1 : at.x]
        rate = np.zeros(shape.states)
        arguments = (x, v, y, p, force, rate) if shape.states else (x, v, p, force)
        gaps = np.zeros(shape.events)
        events = (column[at.mode : at.gap], gaps) if shape.events else ()
        time = float(column[0])
        reason = _reason(dispatcher.py_func, outcome, time, *arguments, *events)
        failures = failures_here()
        failures.setdefault((id(done[0]), lane), LawFailure(done[0], lane, time, reason))

    return report


@cached_on_disk
def every_lane(lanes, at, lines, law, report):  # noqa: PLR0912
    """Fill the memory of a law in all lanes, `at` its `_MemoryRows`, by its C function for one.

    The memory has its forces, rates and gaps, or, where it is to be differentiated, its stiffness.
    Where all lanes are given the same, as for a single sample, the law is called for the first one.
    """
    axes = at.v - at.x
    states = at.b - at.y
    points = axes // 3
    count = points + len(lines)
    # Memory of one lane, and views of its parts.
    column = np.empty(at.end)
    places = np.empty((3, count, 3))
    scratch = scratch_of(np.empty(scratch_size(states, axes)), states, axes)
    x = places[0]
    v = places[1]
    force = places[2]
    b = column[at.b : at.tau]
    tau = column[at.tau : at.rate]
    mode = column[at.mode : at.gap]
    arrays = LawArrays(
        x, v, column[at.y : at.b], column[1 : at.x], force, column[at.rate : at.mode], mode,
        column[at.gap : at.gap_end],
    )  # fmt: skip
    stiffness = column[at.stiffness :]
    nudge = column[at.nudge : at.pace]
    pace = column[at.pace : at.stiffness]
    wants_stiffness = lanes[at.differentiated, 0] > 0.0
    first, last = (at.stiffness, at.end) if wants_stiffness else (at.force, at.gap_end)
    # See whether lanes differ in what the law reads.
    difference_count = 0
    for k in range(at.stiffness):
        is_filled = at.force <= k < at.y or at.rate <= k < at.mode
        if not (is_filled or at.gap <= k < at.differentiated):
            for lane in range(1, WIDTH):
                difference_count += lanes[k, lane] != lanes[k, 0]
    # Call the law lane by lane.
    success = False
    for lane in range(WIDTH):
        finite_inputs = True
        outcome = OUTCOME.ran
        if difference_count > 0 or not success:
            outcome = OUTCOME.error
            for k in range(at.stiffness):
                column[k] = lanes[k, lane]
            for k in range(at.force):
                finite_inputs = finite_inputs and (k < at.x or np.isfinite(column[k]))
            for k in range(len(mode)):
                mode[k] = np.copysign(1.0, mode[k])
            for k in range(states):
                finite_inputs = finite_inputs and np.isfinite(b[k])
            for k in range(axes):
                x.flat[k] = column[at.x + k]
                v.flat[k] = column[at.v + k]
            call = LawCall(law, column[0], points, lines, b, tau)
            if finite_inputs:  # not after the run of this lane has failed
                add_lines(lines, points, x, v)
                if wants_stiffness:
                    ran = fill_stiffness(call, arrays, nudge, pace, stiffness, scratch)
                    outcome = OUTCOME.ran if ran else OUTCOME.error
                else:
                    outcome = solve(call, arrays, scratch)
                    pass_on(lines, points, x, force)
                    for k in range(axes):
                        column[at.force + k] = force.flat[k]
        # Hand back the results, NaN where it failed.
        success = outcome == OUTCOME.ran
        for k in range(first, last):
            lanes[k, lane] = column[k] if success else np.nan
            success = success and np.isfinite(column[k])
        if finite_inputs and not success:
            call_report(report, lanes, lane, outcome)


def _one_sample(dispatcher: Dispatcher, shape: LawShape) -> Callable:
    """Return a function of the arrays of a law that Numba can compile as a C function."""
    parameters, states, events = shape[1:4]
    size = shape.points + len(shape.lines), AXES
    stateful = states > 0 and not events
    switched = events > 0 and not states
    plain = not (states or events)

    def one_sample(t, x, v, s, p, force, rate, mode, gap):
        x = carray(x, size)
        v = carray(v, size)
        p = carray(p, (parameters,))
        force = carray(force, size)
        try:
            if plain:  # Numba removes branches that are not taken
                dispatcher(t, x, v, p, force)
            elif stateful:
                dispatcher(t, x, v, carray(s, (states,)), p, force, carray(rate, (states,)))
            elif switched:
                dispatcher(t, x, v, p, force, carray(mode, (events,)), carray(gap, (events,)))
            else:
                dispatcher(
                    t, x, v, carray(s, (states,)), p, force, carray(rate, (states,)),
                    carray(mode, (events,)), carray(gap, (events,)),
                )  # fmt: skip
        except Exception:
            return 0
        return 1

    return one_sample


def _check_return(law: Law, dispatcher: Dispatcher, shape: LawShape) -> None:
    """Raise `InputError` if a law returns something."""
    return_types = {str(signature.return_type) for signature in dispatcher.nopython_signatures}
    if return_types != {"none"}:
        optional = ["`rate`"] * (shape.states > 0) + ["`gap`"] * (shape.events > 0)
        fills = " and ".join(["`force`", *optional])
        raise InputError(
            f"the law {law!r} must fill {fills} and return nothing; it returns {return_types.pop()}"
        )


def _reason(law: Law, outcome: int, *arguments) -> str:
    """Return why a law failed; the text of an error comes from Python, which runs it again."""
    if outcome == OUTCOME.ran:
        return "is not finite"
    if outcome == OUTCOME.unsolved:
        return "has no states that agree with their rates"
    try:
        with np.errstate(all="ignore"):
            law(*arguments)
    except Exception as error:
        return f"raised {type(error).__name__}: {error}"
    return "raised an error"


def _names(code: CodeType) -> set[str]:
    """Return the global names and attributes that a function and those inside it use."""
    inner = (_names(c) for c in code.co_consts if isinstance(c, CodeType))
    return set(code.co_names).union(*inner)


def _cells(function: FunctionType) -> Iterator[tuple]:
    """Yield the variables of a closure that have a value."""
    for name, cell in zip(function.__code__.co_freevars, function.__closure__ or (), strict=True):
        try:
            yield name, cell.cell_contents
        except ValueError:  # not assigned yet
            continue


@singledispatch
def _code_key(value, references: list, within: Functions) -> Hashable:
    """Return a key that is equal for functions of the same code that read the same values.

    `references` collects objects that are known by their identity, `within` holds the functions
    around.
    """
    references.append(value)
    return id(value), ()


@_code_key.register
def _(value: Dispatcher, references: list, within: Functions) -> Hashable:
    options = repr(sorted(value.targetoptions.items(), key=lambda option: option[0]))
    return "compiled", options, _code_key(value.py_func, references, within)


@_code_key.register
def _(value: FunctionType, references: list, within: Functions) -> Hashable:
    if any(value is outer for outer in within):
        raise InputError(f"a law must not call itself; {value.__qualname__} does")
    return value.__code__, _meanings(_read_by(value), references, (*within, value))


@_code_key.register
def _(value: ModuleType, references: list, within: Functions) -> Hashable:
    parts = ()  # attributes of libraries do not change
    if value.__name__.partition(".")[0] not in ("numpy", "math", "cmath", "numba"):
        names = sorted(set().union(*(_names(outer.__code__) for outer in within)))
        parts = tuple((name, vars(value)[name]) for name in names if name in vars(value))
    return ("module", value.__name__), _meanings(parts, references, within)


@_code_key.register
def _(value: np.ndarray, references: list, within: Functions) -> Hashable:
    digest = sha256(value.tobytes()).digest()
    return (value.dtype.str, value.shape, value.strides, digest), ()


@_code_key.register
def _(value: tuple | list, references: list, within: Functions) -> Hashable:
    return type(value), _meanings(enumerate(value), references, within)


@_code_key.register(int | float | complex | str | np.generic | NoneType)
def _(value: complex | str | np.generic | None, references: list, within: Functions) -> Hashable:
    return (type(value), repr(value)), ()


def _meanings(parts: Iterable[tuple], references: list, within: Functions) -> Hashable:
    return tuple((name, _code_key(part, references, within)) for name, part in parts)


def _read_by(function: FunctionType) -> tuple[tuple, ...]:
    """Return the names and values that a function reads from outside."""
    global_values = function.__globals__
    keywords = function.__kwdefaults__ or {}
    names = sorted(_names(function.__code__) & global_values.keys())
    read = [*((name, global_values[name]) for name in names), *_cells(function), *keywords.items()]
    return *read, ("defaults", function.__defaults__ or ())


def _compile_with_checks(law, done: dict[int, Dispatcher]) -> Dispatcher:
    """Return a law compiled with checks of indices, as are all compiled functions that it calls."""
    if id(law) in done:
        return done[id(law)]
    options: dict = {"error_model": "numpy"}
    function = law
    if isinstance(law, Dispatcher):
        function = law.py_func
        options = {**law.targetoptions}
    if not isinstance(function, FunctionType):
        raise TypeError("it is not a Python function")

    def compile_value(value):
        return _compile_with_checks(value, done) if isinstance(value, Dispatcher) else value

    # Replace compiled functions among the globals and in the closure.
    reads = _names(function.__code__) | {"__builtins__", "__name__"}
    global_values = {n: compile_value(v) for n, v in function.__globals__.items() if n in reads}
    cells = {n: CellType(compile_value(v)) for n, v in _cells(function)}
    closure = tuple(cells.get(n, CellType()) for n in function.__code__.co_freevars)
    # Compile a copy that reads these.
    name = function.__name__
    defaults = function.__defaults__
    copy = FunctionType(function.__code__, global_values, name, defaults, closure)
    copy.__kwdefaults__ = function.__kwdefaults__
    copy.__module__ = function.__module__
    options = {k: v for k, v in options.items() if k not in ("nopython", "boundscheck", "cache")}
    done[id(law)] = njit(**options, boundscheck=True)(copy)
    return done[id(law)]
