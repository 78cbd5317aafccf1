"""Arrays of integers for compiled code, passed as an address and a count.

Compiled code passes a NumPy array as seven numbers, and the engine passes dozens of arrays; an
`Indices` is two numbers. Compiled code supports ``len(indices)`` and ``indices[k]``, without a
bounds check.
"""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
from numba import types
from numba.core.cgutils import create_struct_proxy
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import NativeValue, models, register_model, typeof_impl
from numba.extending import unbox as register_unbox


class Indices:
    """An array of integers or booleans, shape (count,), stored in 32 or 64 bits."""

    def __init__(self, values: np.ndarray):
        self.values = np.ascontiguousarray(
            values, np.int32 if values.dtype.itemsize <= 4 else np.int64
        )
        self.address = self.values.__array_interface__["data"][0]
        self.count = len(self.values)


class IndicesType(types.Type):
    """Numba's type of `Indices`."""

    def __init__(self, item: types.Integer):
        super().__init__(name=f"Indices({item})")
        self.item = item


@typeof_impl.register(Indices)
def _typeof(value, context):
    return IndicesType(types.int32 if value.values.dtype.itemsize == 4 else types.int64)


@register_model(IndicesType)
class _IndicesModel(models.StructModel):
    def __init__(self, manager, indices_type):
        members = [("address", types.CPointer(indices_type.item)), ("count", types.intp)]
        super().__init__(manager, indices_type, members)


@register_unbox(IndicesType)
def _unbox(indices_type, obj, c):
    native = create_struct_proxy(indices_type)(c.context, c.builder)
    for name in ("address", "count"):
        attribute = c.pyapi.object_getattr_string(obj, name)
        number = c.pyapi.long_as_longlong(attribute)
        c.pyapi.decref(attribute)
        if name == "address":
            number = c.builder.inttoptr(number, native.address.type)
        setattr(native, name, number)
    return NativeValue(native._getvalue())


@infer_global(operator.getitem)  # pyright: ignore[reportOptionalCall]
class _GetItem(AbstractTemplate):
    def generic(self, args, kws):
        indices, k = args
        if isinstance(indices, IndicesType) and isinstance(k, types.Integer):
            return signature(types.intp, indices, types.intp)
        return None


@infer_global(len)  # pyright: ignore[reportOptionalCall]
class _Len(AbstractTemplate):
    def generic(self, args, kws):
        return signature(types.intp, *args) if isinstance(args[0], IndicesType) else None


@lower_builtin(operator.getitem, IndicesType, types.intp)
def _getitem(context, builder, sig, args):
    address = builder.extract_value(args[0], 0)
    value = builder.load(builder.gep(address, [args[1]]))
    return context.cast(builder, value, sig.args[0].item, types.intp)


@lower_builtin(len, IndicesType)
def _len(context, builder, sig, args):
    return builder.extract_value(args[0], 1)


def as_indices(arrays: Any) -> Any:
    """Replace the one-dimensional arrays in a named tuple, which may be nested, by `Indices`."""
    if isinstance(arrays, tuple):
        return type(arrays)(*map(as_indices, arrays))
    if isinstance(arrays, np.ndarray) and arrays.ndim == 1:
        return Indices(arrays)
    return arrays
