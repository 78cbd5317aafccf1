"""Operations on lanes: memory, masks and functions, and the options kernels are compiled with.

Physics is written once as scalar formulas. Compiled for ``float`` it serves one sample; compiled
for a lane, the same function serves eight samples, each multiply-add on a whole register. The loop
vectorizer of LLVM does not achieve this: it gives up if it cannot rule out aliasing.

Lanes are stored in C-ordered arrays whose last axis has length `WIDTH`; `load` and `store` move a
row. They accept an array or its address: passing an address takes one number, passing an array
nine, and passing arguments takes most of the compile time. A mask is a lane that holds 1.0 (true)
or 0.0 (false).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial, wraps
from typing import Any

from llvmlite import ir

from flexband.compilation.caching import cached_on_disk
from flexband.compilation.functions import Deferred, instruction
from flexband.compilation.functions import compiled as compiled_with_memory
from flexband.mechanics.kernels.lane_arrays import WIDTH

TYPES = "flexband.mechanics.kernels.types.lane"
"""The module with Numba's type of a lane."""

lane_type = Deferred(TYPES)
types = Deferred("numba.core.types")
cgutils = Deferred("numba.core.cgutils")

VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)
"""LLVM's type of a lane."""

FLAGS = ("contract", "arcp")
"""Fast-math flags: fused multiply-add and reciprocals. NaN and infinity keep their meaning."""

# No memory management: all arrays come from outside. That makes calls free and cuts the compile
# time by a third.
_OPTIONS: dict[str, Any] = {"_nrt": False}


def compiled(function: Callable) -> Any:
    """Compile a function that only compiled code calls."""
    return compiled_with_memory(function, **_OPTIONS)


def cached(function: Callable) -> Any:
    """Compile a function that Python calls, and cache the machine code on disk."""
    return cached_on_disk(function, types_in=(TYPES,), **_OPTIONS)


def unpack_tuple(builder: ir.IRBuilder, values: ir.Value) -> list[ir.Value]:
    """Return the parts of a tuple."""
    return cgutils.unpack_tuple(builder, values)


def _row_pointer(context, builder, array_type, array, row):
    """Return the address of ``array[row]``, a row of `WIDTH` doubles."""
    if isinstance(array_type, types.Integer):
        data = builder.inttoptr(array, ir.DoubleType().as_pointer())
    else:
        data = context.make_array(array_type)(context, builder, array).data
    index = builder.mul(row, ir.Constant(row.type, WIDTH))
    return builder.bitcast(builder.gep(data, [index]), VECTOR.as_pointer())


@instruction
def load(typingctx, array, row):
    """Return row `row` of an array of shape (rows, WIDTH) as a lane."""

    def code(context, builder, sig, args):
        return builder.load(_row_pointer(context, builder, sig.args[0], *args), align=8)

    return lane_type.lane(array, types.intp), code


@partial(instruction, constants=True)
def load_rows(typingctx, array, row, count):
    """Return `count` rows, a constant, that start at row `row` as a tuple of lanes."""
    kind = types.UniTuple(lane_type.lane, count.literal_value)

    def code(context, builder, sig, args):
        first = _row_pointer(context, builder, sig.args[0], *args[:2])
        pointers = (builder.gep(first, [ir.IntType(64)(k)]) for k in range(kind.count))
        return context.make_tuple(builder, kind, [builder.load(p, align=8) for p in pointers])

    return kind(array, types.intp, count), code


@instruction
def store(typingctx, array, row, value):
    """Write a lane to row `row` of an array of shape (rows, WIDTH)."""

    def code(context, builder, sig, args):
        pointer = _row_pointer(context, builder, sig.args[0], *args[:2])
        builder.store(args[2], pointer, align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, lane_type.lane), code


@instruction
def store_rows(typingctx, array, row, values):
    """Write a tuple of lanes to the rows that start at row `row`."""

    def code(context, builder, sig, args):
        first = _row_pointer(context, builder, sig.args[0], *args[:2])
        for k, value in enumerate(unpack_tuple(builder, args[2])):
            builder.store(value, builder.gep(first, [ir.IntType(64)(k)]), align=8)
        return context.get_dummy_value()

    return types.void(array, types.intp, values), code


@instruction
def load_each(typingctx, arrays, row):
    """Return row `row` of each array of a tuple as a tuple of lanes."""
    kind = types.UniTuple(lane_type.lane, len(arrays))

    def code(context, builder, sig, args):
        pairs = zip(sig.args[0], unpack_tuple(builder, args[0]), strict=True)
        pointers = [_row_pointer(context, builder, *pair, args[1]) for pair in pairs]
        return context.make_tuple(builder, kind, [builder.load(p, align=8) for p in pointers])

    return kind(arrays, types.intp), code


@instruction
def store_each(typingctx, arrays, row, values):
    """Write each lane of a tuple to row `row` of one array of another tuple."""

    def code(context, builder, sig, args):
        arrays = unpack_tuple(builder, args[0])
        values = unpack_tuple(builder, args[2])
        for kind, array, value in zip(sig.args[0], arrays, values, strict=True):
            builder.store(value, _row_pointer(context, builder, kind, array, args[1]), align=8)
        return context.get_dummy_value()

    return types.void(arrays, types.intp, values), code


@compiled
def add_to(array, row, value):
    """Add a lane to row `row` of an array of shape (rows, WIDTH)."""
    store(array, row, load(array, row) + value)


@compiled
def clear(array, rows):
    """Set the first `rows` rows to zero."""
    for row in range(rows):
        store(array, row, splat(0.0))


@compiled
def add_block(matrix, slot, i, j, factor, block):
    """Add `factor` times a block (xx, xy, yx, yy) to the entries i, i + 1 by j, j + 1 of a matrix.

    `slot` maps two coordinates of an element to a row of `matrix`, which holds (i, j), i ≤ j, once.
    """
    add_to(matrix, slot[i, j], factor * block[0])
    add_to(matrix, slot[i, j + 1], factor * block[1])
    if i != j:
        add_to(matrix, slot[i + 1, j], factor * block[2])
    add_to(matrix, slot[i + 1, j + 1], factor * block[3])


@instruction
def plus(typingctx, a, factor, b):
    """Return a + factor × b for tuples of lanes a and b of one length."""

    def code(context, builder, sig, args):
        pairs = zip(unpack_tuple(builder, args[0]), unpack_tuple(builder, args[2]), strict=True)
        sums = [
            builder.fadd(x, builder.fmul(args[1], y, flags=FLAGS), flags=FLAGS) for x, y in pairs
        ]
        return context.make_tuple(builder, a, sums)

    return a(a, lane_type.lane, b), code


@instruction
def times(typingctx, factor, a):
    """Return factor × a for a tuple of lanes a."""

    def code(context, builder, sig, args):
        products = [builder.fmul(args[0], x, flags=FLAGS) for x in unpack_tuple(builder, args[1])]
        return context.make_tuple(builder, a, products)

    return a(lane_type.lane, a), code


# --- masks and functions --------------------------------------------------------------------


def operation(function: Callable) -> Any:
    """Make a function that returns LLVM's code of a lane from those of lanes an `instruction`."""

    @wraps(function)
    def type_call(typingctx, *lanes):
        def code(context, builder, sig, args):
            return function(builder, *args)

        return lane_type.lane(*[lane_type.lane] * len(lanes)), code

    return instruction(type_call)


@operation
def splat(builder, value):
    """Return a lane that holds one float for every sample."""
    return value  # a float as an argument becomes a lane


@operation
def less(builder, a, b):
    """Return the mask of ``a < b``, which is false if either is NaN."""
    return builder.uitofp(builder.fcmp_ordered("<", a, b), VECTOR)


@operation
def where(builder, mask, a, b):
    """Return `a` where the mask is true and `b` elsewhere, even if the other one is NaN."""
    return builder.select(builder.fcmp_unordered("!=", mask, ir.Constant(VECTOR, None)), a, b)


@operation
def maximum(builder, a, b):
    """Return the larger of two lanes, or NaN if either is NaN."""
    larger = builder.select(builder.fcmp_unordered(">", a, b), a, b)  # a where either is NaN
    return builder.select(builder.fcmp_unordered("uno", b, b), b, larger)


@compiled
def minimum(a, b):
    """Return the smaller of two lanes."""
    return -maximum(-a, -b)


@instruction
def any_true(typingctx, mask):
    """Return whether the mask is true for any sample."""
    bits = ir.IntType(WIDTH)

    def code(context, builder, sig, args):
        true = builder.fcmp_unordered("!=", args[0], ir.Constant(VECTOR, None))
        return builder.icmp_unsigned("!=", builder.bitcast(true, bits), bits(0))

    return types.boolean(lane_type.lane), code


@instruction
def first_true(typingctx, a, mask):
    """Return what a lane holds for the first sample for which a mask is true; one must be."""
    bits = ir.IntType(WIDTH)

    def code(context, builder, sig, args):
        true = builder.fcmp_unordered("!=", args[1], ir.Constant(VECTOR, None))
        place = builder.cttz(builder.bitcast(true, bits), ir.Constant(ir.IntType(1), 1))
        return builder.extract_element(args[0], builder.zext(place, ir.IntType(32)))

    return types.float64(lane_type.lane, lane_type.lane), code


def _elementwise(name: str) -> Any:
    """Return LLVM's elementwise function `name` for lanes."""

    @operation
    def function(builder, a):
        kind = ir.FunctionType(VECTOR, [VECTOR])
        llvm = cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{WIDTH}f64")
        return builder.call(llvm, [a])

    return function


elementwise_sqrt = _elementwise("sqrt")
magnitude = _elementwise("fabs")
cosine = _elementwise("cos")
sine = _elementwise("sin")
nearest_whole = _elementwise("rint")


def sqrt(a):
    """Return the square root of a float or a lane."""
    return math.sqrt(a)


@operation
def power(builder, base, exponent):
    """Return powers of numbers that are not negative."""
    kind = ir.FunctionType(VECTOR, [VECTOR, VECTOR])
    llvm = cgutils.get_or_insert_function(builder.module, kind, f"llvm.pow.v{WIDTH}f64")
    return builder.call(llvm, [base, exponent])


@instruction
def atan2(typingctx, y, x):
    """Return the angles [rad] of the vectors (x, y), one call of the C library per sample."""

    def code(context, builder, sig, args):
        double = types.float64
        function = context.get_function(math.atan2, double(double, double))
        angles = ir.Constant(VECTOR, ir.Undefined)
        for k in map(ir.IntType(32), range(WIDTH)):
            angle = function(builder, [builder.extract_element(a, k) for a in args])
            angles = builder.insert_element(angles, angle, k)
        return angles

    return lane_type.lane(lane_type.lane, lane_type.lane), code


@instruction
def call_at(typingctx, address, array, row):
    """Call the C function void(double *) at `address` with the address of row `row` of an array."""

    def code(context, builder, sig, args):
        double = ir.DoubleType().as_pointer()
        pointer = builder.bitcast(_row_pointer(context, builder, sig.args[1], *args[1:]), double)
        kind = ir.FunctionType(ir.VoidType(), [double]).as_pointer()
        builder.call(builder.inttoptr(args[0], kind), [pointer])
        return context.get_dummy_value()

    return types.void(types.int64, array, types.intp), code
