"""LANES float64 numbers as one value in compiled code: explicit vector registers for numba.

Loops over the lanes of an ensemble must run in vector registers, and must do for each lane what they do
for every other, in the same order, to the last bit. Both are certain when the vectors are spelt out; a
vectorising compiler promises neither. LLVM turns the numbers into as many registers as they need:
two of 512 bits, or two of 256, or four of 128. Two at a time hide each other's latency.

Values of this type live in compiled code only. `a + b`, `a - b`, `a * b` and `-a` work lane by lane, and

    load(array, i), store(array, i, v)   row i of an array of shape (rows, LANES)
    load(array, i)                       array[i] in all lanes, for a flat array: what all lanes share
    splat(x)                             the number x in all lanes
    fma(a, b, c)                         a b + c with one rounding
    maximum(a, b), minimum(a, b)         the greater, the lesser one
    sqrt(a), floor(a)                    lane by lane
    where_ge(a, b, x, y)                 x where a >= b, else y
    any_positive(a)                      whether any lane is above zero
    gather(array, a)                     array[int(a)] of a flat array, with an index for each lane

Arrays are contiguous and hold float64. No index is checked against the array's length.
"""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

from llvmlite import ir
from llvmlite.binding import get_host_cpu_features
from numba.core import types
from numba.core.typing.templates import ConcreteTemplate, Signature, infer_global
from numba.extending import intrinsic as numba_intrinsic
from numba.extending import lower_builtin, models, register_model

# Two registers of 512 bits, or of 256 where there are none of 512.
LANES = 16 if get_host_cpu_features().get("avx512f", False) else 8
_DOUBLE = ir.DoubleType()
_VECTOR = ir.VectorType(_DOUBLE, LANES)
_INDEX = ir.IntType(64)
_INDICES = ir.VectorType(_INDEX, LANES)
_BITS = ir.VectorType(ir.IntType(1), LANES)
_BYTES_PER_NUMBER = 8  # numpy aligns arrays to single numbers only


class Lanes(types.Type):
    """Numba's type of LANES float64 numbers."""

    def __init__(self) -> None:
        super().__init__(name="float64_lanes")


lanes: Any = Lanes()


def intrinsic(definition: Any) -> Any:
    """Numba's `intrinsic`, whose calls in compiled code are beyond a type checker."""
    return numba_intrinsic(definition)


@register_model(Lanes)
class _LanesModel(models.PrimitiveModel):
    """Held as one LLVM vector."""

    def __init__(self, manager: Any, fe_type: Any) -> None:
        super().__init__(manager, fe_type, _VECTOR)  # type: ignore[no-untyped-call]


def _operation(function: Any, count: int, build: Callable[..., Any]) -> None:
    """Teach numba an operator between `lanes`."""
    arguments = [lanes] * count
    cases = [Signature(lanes, tuple(arguments), None)]  # type: ignore[no-untyped-call]
    template = type(f"Lanes_{function.__name__}", (ConcreteTemplate,), {"cases": cases})
    infer_global(function)(template)  # type: ignore[no-untyped-call]
    lower_builtin(function, *arguments)(build)  # type: ignore[no-untyped-call]


_operation(operator.add, 2, lambda _context, builder, _sig, args: builder.fadd(*args))
_operation(operator.sub, 2, lambda _context, builder, _sig, args: builder.fsub(*args))
_operation(operator.mul, 2, lambda _context, builder, _sig, args: builder.fmul(*args))
_operation(operator.neg, 1, lambda _context, builder, _sig, args: builder.fneg(*args))


def _is_numbers(array: Any, dimensions: int) -> bool:
    is_array = isinstance(array, types.Array) and array.dtype == types.float64 and array.layout == "C"
    return is_array and array.ndim == dimensions


def _place(context: Any, builder: Any, sig: Any, args: Any, stride: int) -> Any:
    """Address of args[0][stride args[1]]."""
    index = context.cast(builder, args[1], sig.args[1], types.intp)
    data = context.make_array(sig.args[0])(context, builder, args[0]).data
    return builder.gep(data, [builder.mul(index, _INDEX(stride))])


def _call(builder: Any, name: str, result: Any, arguments: Any) -> Any:
    """A call of an LLVM intrinsic."""
    kind = ir.FunctionType(result, [argument.type for argument in arguments])
    module = builder.module
    function = module.globals.get(name) or ir.Function(module, kind, name=name)
    return builder.call(function, arguments)


@intrinsic
def load(_typing: Any, array: Any, index: Any) -> Any:
    """Row `index` of an array (rows, LANES), or the number array[index] of a flat one in all lanes."""
    if not (isinstance(index, types.Integer) and (_is_numbers(array, 1) or _is_numbers(array, 2))):
        return None

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        if sig.args[0].ndim == 1:
            return _in_all_lanes(builder, builder.load(_place(context, builder, sig, args, 1)))
        pointer = builder.bitcast(_place(context, builder, sig, args, LANES), _VECTOR.as_pointer())
        return builder.load(pointer, align=_BYTES_PER_NUMBER)

    return lanes(array, index), generate


@intrinsic
def store(_typing: Any, array: Any, index: Any, value: Any) -> Any:
    """Write row `index` of an array (rows, LANES)."""
    if not (_is_numbers(array, 2) and isinstance(index, types.Integer) and value == lanes):
        return None

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        pointer = builder.bitcast(_place(context, builder, sig, args, LANES), _VECTOR.as_pointer())
        builder.store(args[2], pointer, align=_BYTES_PER_NUMBER)
        return context.get_dummy_value()

    return types.void(array, index, value), generate


def _in_all_lanes(builder: Any, value: Any) -> Any:
    nothing = ir.Constant(_VECTOR, ir.Undefined)
    first = builder.insert_element(nothing, value, _INDEX(0))
    return builder.shuffle_vector(
        first, nothing, ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    )


@intrinsic
def splat(_typing: Any, number: Any) -> Any:
    """The same number in all lanes."""

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return _in_all_lanes(builder, context.cast(builder, args[0], sig.args[0], types.float64))

    return lanes(number), generate


def _lanewise(name: str, count: int, doc: str) -> Any:
    """An LLVM intrinsic that works lane by lane on `count` vectors."""

    def generate(_context: Any, builder: Any, _sig: Any, args: Any) -> Any:
        return _call(builder, f"llvm.{name}.v{LANES}f64", _VECTOR, args)

    # numba reads the number of arguments from the signature.
    definitions = {
        1: lambda _typing, a: (lanes(a), generate),
        3: lambda _typing, a, b, c: (lanes(a, b, c), generate),
    }
    function = definitions[count]
    function.__name__ = name
    function.__doc__ = doc
    return intrinsic(function)


fma = _lanewise("fma", 3, "a b + c with one rounding.")
sqrt = _lanewise("sqrt", 1, "Square roots.")
floor = _lanewise("floor", 1, "Greatest whole numbers that are not above.")


def _choice(name: str, sign: str) -> Any:
    """The greater or lesser of two, lane by lane; the second one if they cannot be compared."""

    def definition(_typing: Any, a: Any, b: Any) -> Any:
        def generate(_context: Any, builder: Any, _sig: Any, args: Any) -> Any:
            return builder.select(builder.fcmp_ordered(sign, *args), *args)

        return lanes(a, b), generate

    definition.__name__ = name
    return intrinsic(definition)


maximum = _choice("maximum", ">")
minimum = _choice("minimum", "<")


@intrinsic
def where_ge(_typing: Any, a: Any, b: Any, x: Any, y: Any) -> Any:
    """The lanes of x where a >= b, else those of y."""

    def generate(_context: Any, builder: Any, _sig: Any, args: Any) -> Any:
        return builder.select(builder.fcmp_ordered(">=", args[0], args[1]), args[2], args[3])

    return lanes(a, b, x, y), generate


@intrinsic
def any_positive(_typing: Any, a: Any) -> Any:
    """Whether any lane is above zero."""

    def generate(_context: Any, builder: Any, _sig: Any, args: Any) -> Any:
        bits = builder.fcmp_ordered(">", args[0], ir.Constant(_VECTOR, [0.0] * LANES))
        return _call(builder, f"llvm.vector.reduce.or.v{LANES}i1", ir.IntType(1), [bits])

    return types.boolean(a), generate


@intrinsic
def gather(_typing: Any, array: Any, index: Any) -> Any:
    """The numbers array[int(index)], an index for each lane."""
    if not (_is_numbers(array, 1) and index == lanes):
        return None

    def generate(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        whole = builder.fptosi(args[1], _INDICES)
        data = context.make_array(sig.args[0])(context, builder, args[0]).data
        result = ir.Constant(_VECTOR, ir.Undefined)
        for lane in range(LANES):
            place = builder.gep(data, [builder.extract_element(whole, _INDEX(lane))])
            result = builder.insert_element(result, builder.load(place), _INDEX(lane))
        return result

    return lanes(array, index), generate
