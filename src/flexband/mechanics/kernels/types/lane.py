"""The lane, a Numba type: one number for each of eight samples, held in one SIMD register.

Inside compiled code lanes support ``+ - * /`` and their in-place forms, also mixed with floats. No
operation mixes the samples of a lane, so the result of a sample never depends on its neighbours.
Numba needs this module, which imports it, only where kernels are compiled.
"""

from __future__ import annotations

import math
import operator

from llvmlite import ir
from numba import types
from numba.core.imputils import lower_builtin, lower_cast
from numba.core.typeconv.castgraph import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import models, overload, register_model

from flexband.mechanics.kernels import lanes
from flexband.mechanics.kernels.lanes import FLAGS, VECTOR, WIDTH


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
    def lower(context, builder, sig, args):
        return getattr(builder, name)(*args, flags=FLAGS)

    template = type(f"_{name}", (_Arithmetic,), {})
    infer_global(function)(template)  # pyright: ignore[reportOptionalCall]
    lower_builtin(function, *([lane] * (1 if function is operator.neg else 2)))(lower)


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


@overload(lanes.sqrt)
def _sqrt(a):
    def of_lane(a):
        return lanes.elementwise_sqrt(a)

    def of_float(a):
        return math.sqrt(a)

    return of_lane if isinstance(a, LaneType) else of_float
