"""Eight numbers in one register: the few vector operations that the swarm's kernel needs, for use inside numba
functions.

numba vectorises loops on its own, but keeps neither the parameters nor the state of eight particles in registers over a
loop in time. A value of type `lanes` is LLVM's <8 x double>: one AVX-512 register, two AVX2 ones, four of NEON. Nothing
here can be called from Python.
"""

from collections.abc import Callable
from typing import Any

from llvmlite import ir  # type: ignore[import-untyped]
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic as _untyped_intrinsic
from numba.extending import models, register_model

WIDTH = 8
"""Doubles in a vector of 512 bits. Where a processor has shorter registers LLVM splits it."""
intrinsic: Any = _untyped_intrinsic
"""Its arguments are numba's at compile time, which Python's types cannot say."""
_VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)


class Lanes(types.Type):  # type: ignore[misc]
    """numba's type of a register of eight numbers."""

    def __init__(self) -> None:
        super().__init__(name="lanes")


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):  # type: ignore[misc]
    def __init__(self, manager: Any, frontend: Lanes) -> None:
        super().__init__(manager, frontend, _VECTOR)


lanes = Lanes()


def _operation(arguments: int, emit: Callable[[Any, Any], Any]) -> Any:
    """A numba intrinsic of so many registers that gives a register; `emit(builder, values)` writes its instruction."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        return emit(builder, values)

    def unary(typing: Any, a: Any) -> Any:
        return lanes(lanes), generate

    def binary(typing: Any, a: Any, b: Any) -> Any:
        return lanes(lanes, lanes), generate

    def ternary(typing: Any, a: Any, b: Any, c: Any) -> Any:
        return lanes(lanes, lanes, lanes), generate

    return intrinsic({1: unary, 2: binary, 3: ternary}[arguments])


def _call(name: str) -> Callable[[Any, Any], Any]:
    """The LLVM intrinsic `name` on registers."""

    def emit(builder: Any, values: Any) -> Any:
        kind = ir.FunctionType(_VECTOR, [_VECTOR] * len(values))
        function = cgutils.get_or_insert_function(builder.module, kind, f"llvm.{name}.v{WIDTH}f64")
        return builder.call(function, values)

    return emit


fused = _operation(3, _call("fma"))
"""a * b + c, rounded once."""
magnitude = _operation(1, _call("fabs"))
negative = _operation(1, lambda builder, values: builder.fneg(values[0]))
product = _operation(2, lambda builder, values: builder.fmul(*values))
difference = _operation(2, lambda builder, values: builder.fsub(*values))
larger = _operation(
    2, lambda builder, values: builder.select(builder.fcmp_ordered(">", values[0], values[1]), values[0], values[1])
)
"""The larger of each two; the second where the first is not a number."""


@intrinsic  # type: ignore[untyped-decorator]
def spread(typing: Any, number: Any) -> Any:
    """One number in every lane."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        index = ir.IntType(32)
        first = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), values[0], ir.Constant(index, 0))
        zeros = ir.Constant(ir.VectorType(index, WIDTH), [0] * WIDTH)
        return builder.shuffle_vector(first, ir.Constant(_VECTOR, ir.Undefined), zeros)

    return lanes(types.float64), generate


@intrinsic  # type: ignore[untyped-decorator]
def load(typing: Any, row: Any, index: Any) -> Any:
    """row[index : index + 8] of a contiguous array of one dimension."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        loaded = builder.load(_address(context, builder, signature.args[0], values))
        loaded.align = 8
        return loaded

    return lanes(row, types.intp), generate


@intrinsic  # type: ignore[untyped-decorator]
def store(typing: Any, row: Any, index: Any, value: Any) -> Any:
    """row[index : index + 8] = value, for a contiguous array of one dimension."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        stored = builder.store(values[2], _address(context, builder, signature.args[0], values))
        stored.align = 8
        return context.get_dummy_value()

    return types.void(row, types.intp, lanes), generate


@intrinsic  # type: ignore[untyped-decorator]
def any_below(typing: Any, value: Any, limit: Any) -> Any:
    """At least one lane is below `limit`; a lane that is not a number is not."""

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        mask = builder.bitcast(builder.fcmp_ordered("<", values[0], values[1]), ir.IntType(WIDTH))
        return builder.icmp_unsigned("!=", mask, ir.Constant(ir.IntType(WIDTH), 0))

    return types.boolean(lanes, lanes), generate


def _address(context: Any, builder: Any, kind: Any, values: Any) -> Any:
    data = context.make_array(kind)(context, builder, values[0]).data
    return builder.bitcast(builder.gep(data, [values[1]]), _VECTOR.as_pointer())
