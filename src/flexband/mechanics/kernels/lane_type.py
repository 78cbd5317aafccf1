"""The lane, a Numba type: one number for each of eight samples, held in one SIMD register.

Inside compiled code lanes support ``+ - * /`` and their in-place forms, also mixed with floats. No
operation mixes the samples of a lane, so the result of a sample never depends on its neighbours.
Arrays of lanes are C-ordered, of shape (rows, WIDTH).
"""

from __future__ import annotations

import operator
from ctypes import addressof, c_char
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.imputils import lower_builtin, lower_cast
from numba.core.typeconv.castgraph import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import models, register_model

WIDTH = 8
"""Samples in a lane: one AVX-512 register, or two to four narrower ones."""

VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)
"""LLVM's type of a lane."""

FLAGS = ("contract", "arcp")
"""Fast-math flags: fused multiply-add and reciprocals. NaN and infinity keep their meaning."""


class LaneType(types.Type):
    """Numba's type of a lane; a float converts to a lane that holds it for every sample."""

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
        super().__init__(manager, lane_type, VECTOR)


def filled_vector(builder, value):
    """Return a vector that holds `value` for every sample."""
    vector = builder.insert_element(ir.Constant(VECTOR, ir.Undefined), value, ir.IntType(32)(0))
    places = ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), None)
    return builder.shuffle_vector(vector, ir.Constant(VECTOR, ir.Undefined), places)


@lower_cast(types.Float, LaneType)
def _float_to_lane(context, builder, from_type, to_type, value):
    return filled_vector(builder, context.cast(builder, value, from_type, types.float64))


class _Arithmetic(AbstractTemplate):
    def generic(self, args, kws):
        if lane in args and all(isinstance(a, LaneType | types.Float) for a in args):
            return signature(lane, *([lane] * len(args)))
        return None


def _lower_arithmetic(function, name):
    def lowered(context, builder, sig, args):
        return getattr(builder, name)(*args, flags=FLAGS)

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


# --- arrays of lanes ------------------------------------------------------------------------


def zeros(rows: int) -> np.ndarray:
    """Return zeros of shape (rows, WIDTH), each row aligned to cache lines."""
    memory = np.zeros(rows * WIDTH + WIDTH)
    skipped = -memory.ctypes.data % (8 * WIDTH) // 8
    return memory[skipped : skipped + rows * WIDTH].reshape(rows, WIDTH)


def address(array: Any) -> int:
    """Return the address of an array, 0 if it is empty."""
    return addressof(c_char.from_buffer(array)) if array.size else 0  # faster than NumPy's ways


def to_lanes(values: np.ndarray, block: int) -> np.ndarray:
    """Return block `block` of values of shape (rows, n or 1) as lanes, shape (rows, WIDTH).

    The last block is filled up with copies of the last sample.
    """
    lanes = zeros(len(values))
    if values.shape[1] == 1:  # much faster than by index, in tables of many times
        lanes[:] = values
        return lanes
    sample = np.arange(block * WIDTH, (block + 1) * WIDTH)
    lanes[:] = values[:, np.minimum(sample, values.shape[1] - 1)]
    return lanes
