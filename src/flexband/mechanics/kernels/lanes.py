"""A lane: one number for each of eight samples, held in one SIMD register.

Physics is written once as scalar formulas. Compiled for ``float`` it serves one sample; compiled
for a lane, the same function serves eight samples, each multiply-add on a whole register. LLVM's
own loop vectorizer cannot be relied on for this: it gives up where it cannot rule out aliasing.

Lanes rest in C-ordered arrays whose last axis has length `WIDTH`; `load` and `store` move a row.
They take an array or its address: an address is one number to hand on, an array nine, and handing
on is what most of the time to compile goes to.
Inside compiled code lanes support ``+ - * /``, also mixed with floats, and the functions below.
A mask is a lane that holds 1.0 (true) or 0.0 (false). No operation mixes lanes, so the result of
a sample never depends on its neighbours.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba import njit, types
from numba.core.cgutils import get_or_insert_function
from numba.core.imputils import lower_builtin, lower_cast
from numba.core.typeconv.castgraph import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, models, overload, register_model

WIDTH = 8
"""Samples in a lane: one AVX-512 register, or two to four narrower ones."""

_VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)
_BITS = ir.IntType(WIDTH)
_FLAGS = ("contract", "arcp")  # fused multiply-add; NaN and infinity keep their meaning


# No interpreter lock, division as the processor does it, and no memory management: arrays come
# from outside, so that calls cost nothing and compiling takes two thirds of the time.
_OPTIONS = {"nogil": True, "error_model": "numpy", "_nrt": False}


def compiled(function: Callable) -> Any:
    """Compile a part of the engine, which only compiled code can call."""
    return njit(**_OPTIONS, no_cpython_wrapper=True)(function)  # pyright: ignore[reportCallIssue]


def inlined(function: Callable) -> Any:
    """Make a part of the engine part of its callers: for what calls kernels, so that these are not
    optimized once more at every level on the way up to an entry.
    """  # noqa: D205
    return njit(**_OPTIONS, inline="always")(function)


def entry(function: Callable) -> Any:
    """Compile what Python calls."""
    return njit(**_OPTIONS)(function)


def cached(function: Callable) -> Any:
    """Compile what Python calls and keep the result on disk."""
    return njit(**_OPTIONS, cache=True)(function)


def instruction(function: Callable) -> Any:
    """Make a function of Numba's code generator callable from compiled code."""
    return intrinsic(function)


class LaneType(types.Type):
    """Numba's type of a lane; a float converts to it by filling all places."""

    def __init__(self):
        super().__init__(name="Lane")

    def can_convert_from(self, typingctx, other):
        return Conversion.promote if isinstance(other, types.Float) else None

    def unify(self, typingctx, other):
        return self if isinstance(other, types.Float) else None


lane = LaneType()


@register_model(LaneType)
class _LaneModel(models.PrimitiveModel):
    def __init__(self, manager, lane_type):
        super().__init__(manager, lane_type, _VECTOR)


def _filled(builder, value):
    """Return a vector with `value` in every place."""
    one = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), value, ir.IntType(32)(0))
    places = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), None)
    return builder.shuffle_vector(one, ir.Constant(_VECTOR, ir.Undefined), places)


@lower_cast(types.Float, LaneType)
def _float_to_lane(context, builder, from_type, to_type, value):
    return _filled(builder, context.cast(builder, value, from_type, types.float64))


# --- arithmetic -----------------------------------------------------------------------------


class _Arithmetic(AbstractTemplate):
    def generic(self, args, kws):
        if lane in args and all(isinstance(a, LaneType | types.Float) for a in args):
            return signature(lane, *([lane] * len(args)))
        return None


def _lower_arithmetic(function, name):
    def lowered(context, builder, sig, args):
        return getattr(builder, name)(*args, flags=_FLAGS)

    template = type(f"_{name}", (_Arithmetic,), {})
    infer_global(function)(template)  # pyright: ignore[reportOptionalCall]
    lower_builtin(function, *([lane] * (1 if function is operator.neg else 2)))(lowered)


for _function, _name in (
    (operator.add, "fadd"),
    (operator.sub, "fsub"),
    (operator.mul, "fmul"),
    (operator.truediv, "fdiv"),
    (operator.iadd, "fadd"),
    (operator.isub, "fsub"),
    (operator.imul, "fmul"),
    (operator.itruediv, "fdiv"),
    (operator.neg, "fneg"),
):
    _lower_arithmetic(_function, _name)


# --- memory ---------------------------------------------------------------------------------


def _row_pointer(context, builder, array_type, array, row):
    """Return the address of ``array[row]``, a row of `WIDTH` doubles."""
    if isinstance(array_type, types.Integer):
        data = builder.inttoptr(array, ir.DoubleType().as_pointer())
    else:
        data = context.make_array(array_type)(context, builder, array).data
    index = builder.mul(row, ir.Constant(row.type, WIDTH))
    return builder.bitcast(builder.gep(data, [index]), _VECTOR.as_pointer())


@instruction
def load(typingctx, array, row):
    """Return row `row` of an array of shape (rows, WIDTH) as a lane."""

    def code(context, builder, sig, args):
        return builder.load(_row_pointer(context, builder, sig.args[0], *args), align=8)

    return lane(array, types.intp), code


@instruction
def store(typingctx, array, row, value):
    """Write a lane to row `row` of an array of shape (rows, WIDTH)."""

    def code(context, builder, sig, args):
        pointer = _row_pointer(context, builder, sig.args[0], *args[:2])
        builder.store(args[2], pointer, align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, lane), code


@compiled
def add_to(array, row, value):
    """Add a lane to row `row` of an array of shape (rows, WIDTH)."""
    store(array, row, load(array, row) + value)


# --- masks and functions --------------------------------------------------------------------


@instruction
def less(typingctx, a, b):
    """Return the mask of ``a < b``; false where either is NaN."""

    def code(context, builder, sig, args):
        return builder.uitofp(builder.fcmp_ordered("<", *args), _VECTOR)

    return lane(lane, lane), code


@instruction
def where(typingctx, mask, a, b):
    """Return `a` where the mask is true and `b` elsewhere, whatever the other one holds."""

    def code(context, builder, sig, args):
        true = builder.fcmp_unordered("!=", args[0], ir.Constant(_VECTOR, None))
        return builder.select(true, args[1], args[2])

    return lane(lane, lane, lane), code


@instruction
def any_true(typingctx, mask):
    """Return whether the mask is true anywhere."""

    def code(context, builder, sig, args):
        true = builder.fcmp_unordered("!=", args[0], ir.Constant(_VECTOR, None))
        return builder.icmp_unsigned("!=", builder.bitcast(true, _BITS), _BITS(0))

    return types.boolean(lane), code


@instruction
def filled(typingctx, value):
    """Return a lane with one float in every place."""

    def code(context, builder, sig, args):
        return _filled(builder, args[0])

    return lane(types.float64), code


def _call(builder, name, args):
    """Call LLVM's own elementwise function `name`."""
    kind = ir.FunctionType(_VECTOR, [_VECTOR])
    function = get_or_insert_function(builder.module, kind, f"llvm.{name}.v{WIDTH}f64")
    return builder.call(function, args)


@instruction
def _sqrt(typingctx, a):
    def code(context, builder, sig, args):
        return _call(builder, "sqrt", args)

    return lane(lane), code


@instruction
def magnitude(typingctx, a):
    """Return the absolute value."""

    def code(context, builder, sig, args):
        return _call(builder, "fabs", args)

    return lane(lane), code


def sqrt(a):
    """Return the square root of a float or a lane."""
    return math.sqrt(a)


@overload(sqrt)
def _overload_sqrt(a):
    def of_lane(a):
        return _sqrt(a)

    def of_float(a):
        return math.sqrt(a)

    return of_lane if isinstance(a, LaneType) else of_float


@instruction
def nearest_whole(typingctx, a):
    """Return the whole number nearest to each."""

    def code(context, builder, sig, args):
        return _call(builder, "rint", args)

    return lane(lane), code


@instruction
def atan2(typingctx, y, x):
    """Return the angles of the directions (x, y), one call of the C library each."""

    def code(context, builder, sig, args):
        double = types.float64
        function = context.get_function(math.atan2, signature(double, double, double))
        angles = ir.Constant(_VECTOR, ir.Undefined)
        for k in map(ir.IntType(32), range(WIDTH)):
            angle = function(builder, [builder.extract_element(a, k) for a in args])
            angles = builder.insert_element(angles, angle, k)
        return angles

    return lane(lane, lane), code


@instruction
def call_at(typingctx, address, array, row):
    """Call the function void(double *) at an address with that of row `row` of an array."""

    def code(context, builder, sig, args):
        double = ir.DoubleType().as_pointer()
        pointer = builder.bitcast(_row_pointer(context, builder, sig.args[1], *args[1:]), double)
        kind = ir.FunctionType(ir.VoidType(), [double]).as_pointer()
        builder.call(builder.inttoptr(args[0], kind), [pointer])
        return context.get_dummy_value()

    return types.void(types.int64, array, types.intp), code


@instruction
def maximum(typingctx, a, b):
    """Return the larger of two lanes, and NaN where either is NaN."""

    def code(context, builder, sig, args):
        first = builder.fcmp_unordered(">", *args)  # true where a is NaN or b is NaN
        larger = builder.select(first, *args)
        b_is_nan = builder.fcmp_unordered("uno", args[1], args[1])
        return builder.select(b_is_nan, args[1], larger)

    return lane(lane, lane), code


# --- NumPy's side ---------------------------------------------------------------------------


def zeros(rows: int) -> np.ndarray:
    """Return zeros of shape (rows, WIDTH), each row in cache lines of its own."""
    memory = np.zeros(rows * WIDTH + WIDTH)
    skipped = -memory.ctypes.data % (8 * WIDTH) // 8
    return memory[skipped : skipped + rows * WIDTH].reshape(rows, WIDTH)


def addresses(arrays: Any) -> Any:
    """Return a named tuple of arrays of lanes, or of such tuples, with the arrays' addresses."""
    if isinstance(arrays, tuple):
        return type(arrays)(*map(addresses, arrays))
    return arrays.__array_interface__["data"][0]


def to_lanes(values: np.ndarray, block: int) -> np.ndarray:
    """Return block `block` of values of shape (rows, n or 1) as lanes, shape (rows, WIDTH).

    What is left over in the last block is filled with copies of the last sample.
    """
    lanes = zeros(len(values))
    sample = np.arange(block * WIDTH, (block + 1) * WIDTH)
    lanes[:] = values[:, np.minimum(sample, values.shape[1] - 1)]
    return lanes
