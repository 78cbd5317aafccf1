"""Numba's type of a record, see `records`.

In compiled code the fields of a record are numbers, records, the addresses of arrays of floats, for
`lanes.load`, and arrays of integers or booleans, which support ``len(indices)``, ``indices[k]`` and
``indices[i, j]`` without a bounds check.
"""

from __future__ import annotations

import operator
from itertools import accumulate, zip_longest
from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core.cgutils import create_struct_proxy, unpack_tuple
from numba.core.imputils import lower_builtin, lower_getattr_generic
from numba.core.typing.templates import (
    AbstractTemplate,
    AttributeTemplate,
    infer_getattr,
    infer_global,
    signature,
)
from numba.extending import models, register_model

NUMBER = ir.IntType(64)


class RecordType(types.Type):
    """Numba's type of a `Record`, with the type and the place of each field by name."""

    def __init__(self, fields: Any):
        kinds = [*map(_numba_type, fields)]
        places = [0, *accumulate(map(_size, kinds))]
        self.fields = dict(zip(fields._fields, kinds, strict=True))
        self.places = dict(zip(fields._fields, places, strict=False))
        self.size = places[-1]
        super().__init__(name=f"{type(fields).__name__}({', '.join(map(str, kinds))})")

    @property
    def mangling_args(self):
        """A short name in those of compiled functions."""
        return self.name.partition("(")[0], ()


class IndicesType(types.Type):
    """Numba's type of an array of integers: its address, then its shape."""

    def __init__(self, integer: types.Integer, ndim: int):
        super().__init__(name=f"Indices({integer}, {ndim})")
        self.integer = integer
        self.ndim = ndim
        self.names = ("address", *(f"count{axis}" for axis in range(ndim)))


def _size(kind: types.Type) -> int:
    """Return how many numbers a field takes."""
    if isinstance(kind, RecordType):
        return kind.size
    return 1 + kind.ndim if isinstance(kind, IndicesType) else 1


def _numba_type(field: Any) -> types.Type:
    if isinstance(field, tuple):
        return RecordType(field)
    if isinstance(field, np.ndarray) and field.dtype.kind != "f":
        return IndicesType(types.Integer.from_bitwidth(8 * field.dtype.itemsize), field.ndim)
    return types.int64


@register_model(RecordType)
class _RecordModel(models.PrimitiveModel):
    def __init__(self, manager, record):
        super().__init__(manager, record, NUMBER.as_pointer())


@register_model(IndicesType)
class _IndicesModel(models.StructModel):
    def __init__(self, manager, indices):
        kinds = (types.CPointer(indices.integer), *[types.intp] * indices.ndim)
        super().__init__(manager, indices, [*zip(indices.names, kinds, strict=True)])


def _load(builder, pointer):
    """Load what never changes."""
    value = builder.load(pointer)
    value.set_metadata("invariant.load", builder.module.add_metadata([]))
    return value


@infer_getattr
class _Field(AttributeTemplate):
    key = RecordType

    def generic_resolve(self, record, name):
        return record.fields.get(name)


@lower_getattr_generic(RecordType)
def _field(context, builder, record, pointer, name):
    kind = record.fields[name]
    place = record.places[name]
    if isinstance(kind, RecordType):
        return builder.gep(pointer, [NUMBER(place)])
    numbers = [
        _load(builder, builder.gep(pointer, [NUMBER(place + k)])) for k in range(_size(kind))
    ]
    return _indices(context, builder, kind, *numbers) if len(numbers) > 1 else numbers[0]


def _indices(context, builder, kind, first, *shape):
    """Return the structure of an `IndicesType` from an address, a number or a pointer."""
    native = create_struct_proxy(kind)(context, builder)
    if first.type == NUMBER:
        first = builder.inttoptr(first, native.address.type)
    for name, value in zip(kind.names, (first, *shape), strict=True):
        setattr(native, name, value)
    return native._getvalue()


@infer_global(operator.getitem)  # pyright: ignore[reportOptionalCall]
class _GetItem(AbstractTemplate):
    def generic(self, args, kws):
        indices, place = args
        if not isinstance(indices, IndicesType):
            return None
        places = getattr(place, "types", (place,))
        if len(places) > indices.ndim or not all(isinstance(k, types.Integer) for k in places):
            return None
        rest = indices.ndim - len(places)
        kind = IndicesType(indices.integer, rest) if rest else types.intp
        place = types.UniTuple(types.intp, len(places)) if place is not places[0] else types.intp
        return signature(kind, indices, place)


@infer_global(len)  # pyright: ignore[reportOptionalCall]
class _Len(AbstractTemplate):
    def generic(self, args, kws):
        return signature(types.intp, *args) if isinstance(args[0], IndicesType) else None


@lower_builtin(operator.getitem, IndicesType, types.intp)
@lower_builtin(operator.getitem, IndicesType, types.UniTuple)
def _getitem(context, builder, sig, args):
    indices, place = args
    first, *shape = (builder.extract_value(indices, k) for k in range(1 + sig.args[0].ndim))
    places = [place] if isinstance(sig.args[1], types.Integer) else unpack_tuple(builder, place)
    offset = NUMBER(0)
    for k, size in zip_longest(places, shape):
        offset = builder.mul(offset, size)
        if k is not None:
            offset = builder.add(offset, k)
    first = builder.gep(first, [offset])
    if isinstance(sig.return_type, IndicesType):
        return _indices(context, builder, sig.return_type, first, *shape[len(places) :])
    return context.cast(builder, _load(builder, first), sig.args[0].integer, types.intp)


@lower_builtin(len, IndicesType)
def _len(context, builder, sig, args):
    return builder.extract_value(args[0], 1)
