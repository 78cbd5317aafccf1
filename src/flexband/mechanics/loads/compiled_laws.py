"""Force laws as compiled code: checked, and compiled once for each meaning.

Numba freezes the globals and the closure of a function when it compiles it. A law is therefore
known here by its code and by the values that the code reads. The same lambda made again in a loop
is compiled once, and a law whose globals have changed is compiled anew.
"""

from __future__ import annotations

import ctypes
import threading
from collections.abc import Callable, Hashable, Iterable, Iterator
from dataclasses import dataclass
from functools import singledispatch
from hashlib import sha256
from types import CellType, CodeType, FunctionType, ModuleType, NoneType
from typing import NamedTuple, cast

import numpy as np
from numba import cfunc, njit
from numba.core.dispatcher import Dispatcher
from numba.np.numpy_support import carray

from flexband.errors import InputError, warn
from flexband.mechanics.kernels.lane_type import WIDTH
from flexband.mechanics.kernels.laws import AXES

Law = Callable[..., None]
"""``law(t, x, v, p, force)``: time [s], positions and velocities of the points, the parameters.

Rows of `x` are (X, Y, θ), turns counted, rows of `v` their rates, shape (points, 3). It fills the
rows of `force`, (F_X, F_Y, M): force [N] on each point and moment [N m] on its body.
"""

Functions = tuple[FunctionType, ...]

Report = ctypes.CFUNCTYPE(None, ctypes.c_int64, ctypes.c_int64, ctypes.c_int64)

_laws: dict[Hashable, CompiledLaw] = {}
_lock = threading.Lock()
_own = threading.local()


class LawFailure(NamedTuple):
    """What a law did in one lane of the block that a thread was running."""

    law: CompiledLaw
    lane: int
    time: float
    reason: str


def take_failures() -> list[LawFailure]:
    """Return the first failure of each law and lane in this thread, and forget them."""
    failures = _own.__dict__.pop("failures", {})
    return list(failures.values())


@dataclass(frozen=True, eq=False)
class CompiledLaw:
    """A law as a C function of the memory that `kernels.laws` describes, for all lanes.

    Attributes
    ----------
    address : where the engine calls it.
    kept : what has to live as long as the code.
    """

    address: int
    kept: tuple


def compiled_law(law: Law, points: int, parameters: int, *, many: int = 200) -> CompiledLaw:
    """Return a law for so many points and parameters; indices are checked when it runs.

    The compilation of `many` laws is warned of: Numba does not give back the 2 MB of each.

    Raises
    ------
    InputError
        If it does not compile, returns a value or calls itself.
    """
    kept: list = [law]
    try:
        key = _meaning(law, kept, ()), points, parameters
        with _lock:
            if key not in _laws:
                _laws[key] = _compile(law, points, parameters, kept)
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


def _compile(law: Law, points: int, parameters: int, kept: list) -> CompiledLaw:
    dispatcher = _checked(law, {})
    size = points * AXES
    start_x = 1 + parameters
    start_v, start_force, rows = start_x + size, start_x + 2 * size, start_x + 3 * size

    @Report
    def report(address: int, lane: int, ran: int) -> None:
        memory = (ctypes.c_double * (rows * WIDTH)).from_address(address)
        column = np.array(memory).reshape(rows, WIDTH)[:, lane]
        x, v = (column[k : k + size].reshape(points, AXES) for k in (start_x, start_v))
        reason = _reason(dispatcher.py_func, ran, float(column[0]), x, v, column[1:start_x])
        failures = _own.__dict__.setdefault("failures", {})
        failures.setdefault((id(done), lane), LawFailure(done, lane, float(column[0]), reason))

    def every_lane(memory):
        lanes = carray(memory, (rows, WIDTH))
        p = np.empty(parameters)
        x, v, force = np.empty((points, 3)), np.empty((points, 3)), np.empty((points, 3))
        for lane in range(WIDTH):
            known, ran, good = True, False, True
            for k in range(parameters):
                p[k] = lanes[1 + k, lane]
            for k in range(size):
                x.flat[k] = lanes[start_x + k, lane]
                v.flat[k] = lanes[start_v + k, lane]
                force.flat[k] = 0.0
                known = known and np.isfinite(x.flat[k]) and np.isfinite(v.flat[k])
            if known:  # not after the run of this lane has failed
                try:
                    dispatcher(lanes[0, lane], x, v, p, force)
                    ran = True
                except Exception:
                    ran = False
            for k in range(size):
                good = good and np.isfinite(force.flat[k])
                lanes[start_force + k, lane] = force.flat[k] if ran else np.nan
            if known and not (ran and good):
                report(lanes.ctypes.data, lane, 1 if ran else 0)

    code = cfunc("void(CPointer(float64))", error_model="numpy")(every_lane)
    returned = {str(signature.return_type) for signature in dispatcher.nopython_signatures}
    if returned != {"none"}:
        raise InputError(
            f"the law {law!r} must fill `force` and return nothing; it returns {returned.pop()}"
        )
    done = CompiledLaw(cast(int, code.address), (code, report, *kept))
    return done


def _reason(law: Law, ran: int, time: float, *arrays: np.ndarray) -> str:
    """Return why a law failed; the text of an error comes from Python, which runs it again."""
    if ran:
        return "is not finite"
    try:
        with np.errstate(all="ignore"):
            law(time, *arrays, np.zeros_like(arrays[0]))
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
def _meaning(value, kept: list, within: Functions) -> Hashable:
    """Return a key that is equal for functions of the same code that read the same values.

    `kept` collects objects that are known by their identity, `within` holds the functions around.
    """
    kept.append(value)
    return id(value), ()


@_meaning.register
def _(value: Dispatcher, kept: list, within: Functions) -> Hashable:
    options = repr(sorted(value.targetoptions.items(), key=lambda option: option[0]))
    return "compiled", options, _meaning(value.py_func, kept, within)


@_meaning.register
def _(value: FunctionType, kept: list, within: Functions) -> Hashable:
    if any(value is outer for outer in within):
        raise InputError(f"a law must not call itself; {value.__qualname__} does")
    return value.__code__, _meanings(_read_by(value), kept, (*within, value))


@_meaning.register
def _(value: ModuleType, kept: list, within: Functions) -> Hashable:
    parts = ()  # attributes of libraries do not change
    if value.__name__.partition(".")[0] not in ("numpy", "math", "cmath", "numba"):
        names = sorted(set().union(*(_names(outer.__code__) for outer in within)))
        parts = tuple((name, vars(value)[name]) for name in names if name in vars(value))
    return ("module", value.__name__), _meanings(parts, kept, within)


@_meaning.register
def _(value: np.ndarray, kept: list, within: Functions) -> Hashable:
    digest = sha256(value.tobytes()).digest()
    return (value.dtype.str, value.shape, value.strides, digest), ()


@_meaning.register
def _(value: tuple | list, kept: list, within: Functions) -> Hashable:
    return type(value), _meanings(enumerate(value), kept, within)


@_meaning.register(int | float | complex | str | np.generic | NoneType)
def _(value: complex | str | np.generic | None, kept: list, within: Functions) -> Hashable:
    return (type(value), repr(value)), ()


def _meanings(parts: Iterable[tuple], kept: list, within: Functions) -> Hashable:
    return tuple((name, _meaning(part, kept, within)) for name, part in parts)


def _read_by(function: FunctionType) -> tuple[tuple, ...]:
    """Return the names and values that a function reads from outside."""
    known, keywords = function.__globals__, function.__kwdefaults__ or {}
    names = sorted(_names(function.__code__) & known.keys())
    read = [*((name, known[name]) for name in names), *_cells(function), *keywords.items()]
    return *read, ("defaults", function.__defaults__ or ())


def _checked(law, done: dict[int, Dispatcher]) -> Dispatcher:
    """Return a law compiled with checks of indices, as are all compiled functions that it calls."""
    if id(law) in done:
        return done[id(law)]
    options: dict = {"error_model": "numpy"}
    function = law
    if isinstance(law, Dispatcher):
        function, options = law.py_func, {**law.targetoptions}
    if not isinstance(function, FunctionType):
        raise TypeError("it is not a Python function")

    def replaced(value):
        return _checked(value, done) if isinstance(value, Dispatcher) else value

    reads = _names(function.__code__) | {"__builtins__", "__name__"}
    known = {n: replaced(v) for n, v in function.__globals__.items() if n in reads}
    cells = {n: CellType(replaced(v)) for n, v in _cells(function)}
    closure = tuple(cells.get(n, CellType()) for n in function.__code__.co_freevars)
    name, defaults = function.__name__, function.__defaults__
    copy = FunctionType(function.__code__, known, name, defaults, closure)
    copy.__kwdefaults__, copy.__module__ = function.__kwdefaults__, function.__module__
    options = {k: v for k, v in options.items() if k not in ("nopython", "boundscheck", "cache")}
    done[id(law)] = njit(**options, boundscheck=True)(copy)
    return done[id(law)]
