"""Eight numbers in one register of the processor, as types of the compiler (extra `fast`).

`Lanes` are eight floats, `Mask` eight truths, `Rows` lanes in memory one after another. Arithmetic, comparisons,
`abs`, `max`, `min` and `sqrt` do in each lane what Python does with one number, to the last bit, so a function without
branches is compiled for lanes as it stands. Where lanes differ, `where` chooses; `bits` has a bit a lane. Processors
with narrower registers take two or four for one.
"""

# mypy: disable-error-code="no-untyped-call, untyped-decorator, misc"
# The compiler's own names have no types.

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.imputils import lower_builtin, lower_cast
from numba.core.typeconv.castgraph import Conversion
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import intrinsic, models, register_model

LANES = 8

_INDEX = ir.IntType(32)
_FLOATS = ir.VectorType(ir.DoubleType(), LANES)
_TRUTHS = ir.VectorType(ir.IntType(1), LANES)
_BYTES = 8 * LANES

Build = Callable[[Any, Any], Any]
"""Makes the code of an operation: of the builder and the values."""


class LanesType(types.Type):
    """Eight floats."""

    def can_convert_from(self, _context: Any, other: Any) -> Any:
        """A number is the same in each lane."""
        return Conversion.safe if isinstance(other, types.Float | types.Integer) else None


class MaskType(types.Type):
    """Eight truths."""


class RowsType(types.Type):
    """Lanes in memory, by their row."""


lanes, mask, rows = LanesType("Lanes"), MaskType("Mask"), RowsType("Rows")


def _keep(kind: type, stored: Any) -> None:
    """What values of a type are in registers and memory."""

    class Model(models.PrimitiveModel):
        def __init__(self, manager: Any, of_type: Any) -> None:
            super().__init__(manager, of_type, stored)

    register_model(kind)(Model)


_keep(LanesType, _FLOATS)
_keep(MaskType, _TRUTHS)
_keep(RowsType, _FLOATS.as_pointer())


def _is_number(kind: Any) -> bool:
    return kind == lanes or isinstance(kind, types.Float | types.Integer)


@lower_cast(types.Float, LanesType)
@lower_cast(types.Integer, LanesType)
def _to_lanes(context: Any, builder: Any, kind: Any, _lanes: Any, value: Any) -> Any:
    number = context.cast(builder, value, kind, types.float64)
    first = builder.insert_element(ir.Constant(_FLOATS, ir.Undefined), number, ir.Constant(_INDEX, 0))
    return builder.shuffle_vector(first, first, ir.Constant(ir.VectorType(_INDEX, LANES), [0] * LANES))


def _define(operation: Any, result: Any, build: Build, counts: range) -> None:
    """An operation on so many lanes, or lanes and numbers."""

    class Template(AbstractTemplate):
        def generic(self, arguments: Any, _named: Any) -> Any:
            fits = len(arguments) in counts and lanes in arguments and all(map(_is_number, arguments))
            return signature(result, *[lanes] * len(arguments)) if fits else None

    infer_global(operation)(Template)
    for count in counts:
        lower_builtin(operation, *[lanes] * count)(lambda _context, builder, _kinds, values: build(builder, values))


def _define_of_masks(operation: Any, count: int, name: str) -> None:
    """An operation on so many masks."""

    class Template(AbstractTemplate):
        def generic(self, arguments: Any, _named: Any) -> Any:
            return signature(mask, *arguments) if tuple(arguments) == (mask,) * count else None

    infer_global(operation)(Template)
    lower_builtin(operation, *[mask] * count)(lambda _context, builder, _kinds, values: _named(name)(builder, values))


def _named(name: str) -> Build:
    return lambda builder, values: getattr(builder, name)(*values)


def _compared(sign: str) -> Build:
    """False of what is not a number, which is unlike everything."""
    name = "fcmp_unordered" if sign == "!=" else "fcmp_ordered"
    return lambda builder, values: getattr(builder, name)(sign, *values)


def _most(sign: str) -> Build:
    """Python's `max` or `min`: the first one, until another is beyond it."""

    def build(builder: Any, values: Any) -> Any:
        best = values[0]
        for value in values[1:]:
            best = builder.select(builder.fcmp_ordered(sign, value, best), value, best)
        return best

    return build


def _of_processor(name: str) -> Build:
    kind = ir.FunctionType(_FLOATS, [_FLOATS])
    full_name = f"{name}.v{LANES}f64"
    return lambda builder, values: builder.call(cgutils.get_or_insert_function(builder.module, kind, full_name), values)


for _operation, _name in (
    (operator.add, "fadd"),
    (operator.iadd, "fadd"),
    (operator.sub, "fsub"),
    (operator.isub, "fsub"),
    (operator.mul, "fmul"),
    (operator.imul, "fmul"),
    (operator.truediv, "fdiv"),
):
    _define(_operation, lanes, _named(_name), range(2, 3))
for _operation, _sign in (
    (operator.lt, "<"),
    (operator.le, "<="),
    (operator.gt, ">"),
    (operator.ge, ">="),
    (operator.eq, "=="),
    (operator.ne, "!="),
):
    _define(_operation, mask, _compared(_sign), range(2, 3))
_define(operator.neg, lanes, _named("fneg"), range(1, 2))
_define(abs, lanes, _of_processor("llvm.fabs"), range(1, 2))
_define(math.sqrt, lanes, _of_processor("llvm.sqrt"), range(1, 2))
_define(max, lanes, _most(">"), range(2, 26))
_define(min, lanes, _most("<"), range(2, 26))
_define_of_masks(operator.and_, 2, "and_")
_define_of_masks(operator.or_, 2, "or_")
_define_of_masks(operator.xor, 2, "xor")
_define_of_masks(operator.invert, 1, "not_")


@infer_global(operator.getitem)
class _Read(AbstractTemplate):
    def generic(self, arguments: Any, _named: Any) -> Any:
        return signature(lanes, rows, types.intp) if arguments[0] == rows else None


@infer_global(operator.setitem)
class _Write(AbstractTemplate):
    def generic(self, arguments: Any, _named: Any) -> Any:
        return signature(types.none, rows, types.intp, lanes) if arguments[0] == rows else None


@lower_builtin(operator.getitem, rows, types.intp)
def _read(_context: Any, builder: Any, _kinds: Any, values: Any) -> Any:
    start, row = values
    return builder.load(builder.gep(start, [row]), align=_BYTES)


@lower_builtin(operator.setitem, rows, types.intp, lanes)
def _write(context: Any, builder: Any, _kinds: Any, values: Any) -> Any:
    start, row, value = values
    builder.store(value, builder.gep(start, [row]), align=_BYTES)
    return context.get_dummy_value()


def _rows_in(_typing: Any, array: Any) -> Any:
    def build(context: Any, builder: Any, kinds: Any, values: Any) -> Any:
        found = context.make_array(kinds.args[0])(context, builder, values[0])
        return builder.bitcast(found.data, _FLOATS.as_pointer())

    return rows(array), build


def _alike(_typing: Any, number: Any) -> Any:
    return lanes(number), lambda context, builder, kinds, values: context.cast(builder, *values, kinds.args[0], lanes)


def _where(_typing: Any, chosen: Any, one: Any, other: Any) -> Any:
    def build(context: Any, builder: Any, kinds: Any, values: Any) -> Any:
        both = [context.cast(builder, values[n], kinds.args[n], lanes) for n in (1, 2)]
        return builder.select(values[0], *both)

    fits = chosen == mask and _is_number(one) and _is_number(other)
    return (lanes(chosen, one, other), build) if fits else None


def _bits(_typing: Any, _chosen: Any) -> Any:
    def build(_context: Any, builder: Any, _kinds: Any, values: Any) -> Any:
        return builder.zext(builder.bitcast(values[0], ir.IntType(LANES)), ir.IntType(64))

    return types.int64(mask), build


rows_in: Any = intrinsic(_rows_in)
"""The rows of an array (n, LANES) of floats, whose first number is at a whole multiple of a register's bytes."""
alike: Any = intrinsic(_alike)
"""A number in each lane."""
where: Any = intrinsic(_where)
"""Of (mask, one, other): `one` in the lanes that are chosen, else `other`."""
bits: Any = intrinsic(_bits)
"""Of a mask: a whole number whose bit n is set if lane n is chosen."""
