"""Numbers of several ensemble members in one SIMD register, for code shared by single members and vectors of members.

A function written with `get`, `put` and the arithmetic of this module is compiled twice: to scalar code for arrays of
one member, and to vector code for arrays with an additional last axis of LANES members. The results of every lane are
bit-identical to those of the scalar code, because operations follow IEEE 754 and are fused only where the source uses
`fma`.

numba does not vectorise loops over members that branch; therefore the vector is a type here.
"""
# pyright: reportMissingTypeStubs=false, reportUnknownMemberType=false, reportUnknownVariableType=false
# pyright: reportUnknownArgumentType=false, reportUnknownParameterType=false, reportMissingParameterType=false
# pyright: reportUnknownLambdaType=false
# numba and llvmlite have no type annotations.
# ruff: noqa: ARG001, ARG002, ARG005
# numba prescribes the arguments of its hooks.

import math
import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.imputils import lower_builtin
from numba.core.typing import templates
from numba.core.typing.templates import AbstractTemplate, signature
from numba.extending import models, register_model
from numpy.typing import NDArray

LANES = 4
"""Members in a vector: as many as an AVX2 register holds doubles. Other processors use two registers or half of one."""

# `Any`, because these are objects of numba and llvmlite
FLOAT: Any = types.float64
_DOUBLE: Any = ir.DoubleType()
_VECTOR: Any = ir.VectorType(_DOUBLE, LANES)


infer_global: Any = templates.infer_global


class _LanesType(types.Type):
    def __init__(self) -> None:
        super().__init__(name=f"Lanes{LANES}")


VALUES: Any = _LanesType()
"""Type of a vector of LANES numbers in compiled code."""


@register_model(_LanesType)
class _LanesModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, _VECTOR)


def get(a: NDArray[np.float64], i: int) -> float:
    """a[i] without bounds check: a float for shape (n,), a vector for shape (n, LANES)."""
    return float(a[i])


def put(a: NDArray[np.float64], i: int, value: float) -> None:
    """Set a[i] = value without bounds check."""
    a[i] = value


def get2(a: NDArray[np.float64], row: int, i: int) -> float:
    """a[row, i] without bounds check: a float for shape (m, n), a vector for shape (m, n, LANES)."""
    return float(a[row, i])


def put2(a: NDArray[np.float64], row: int, i: int, value: float) -> None:
    """Set a[row, i] = value without bounds check."""
    a[row, i] = value


def zero(like: NDArray[np.float64]) -> float:
    """Zero of the type returned by `get`: a float for shape (n,), a vector for shape (n, LANES)."""
    return 0.0 * float(like[0])


def fma(x: float, y: float, z: float) -> float:
    """Return x * y + z with one rounding."""
    return x * y + z


def root(x: float) -> float:
    """Square root."""
    return math.sqrt(x)


def sine(x: float) -> float:
    """Sine of an angle [rad]."""
    return math.sin(x)


def cosine(x: float) -> float:
    """Cosine of an angle [rad]."""
    return math.cos(x)


def magnitude(x: float) -> float:
    """|x|."""
    return abs(x)


def greater(x: float, y: float) -> float:
    """The greater of two numbers; the other one if one is not a number."""
    return y if not x > y else x


def some(x: float) -> bool:
    """Whether x, or any lane of it, differs from 0."""
    return x != 0.0


def _number(kind: Any) -> bool:
    return isinstance(kind, types.Float | types.Integer)


def _widened(context: Any, builder: Any, kind: Any, value: Any) -> Any:
    """Vector with a float in every lane."""
    if kind == VALUES:
        return value
    first = builder.insert_element(ir.Constant(_VECTOR, ir.Undefined), value, ir.Constant(ir.IntType(32), 0))
    everywhere = ir.Constant(ir.VectorType(ir.IntType(32), LANES), [0] * LANES)
    return builder.shuffle_vector(first, ir.Constant(_VECTOR, ir.Undefined), everywhere)


def _arithmetic(
    function: Callable[..., Any], count: int, build: Callable[[Any, bool, list[Any]], Any], own: bool
) -> None:
    """Define type and code of `function` of `count` numbers. The result is a vector if any of them is one; otherwise it
    is a float, which is defined here only if `own` is True, because numba provides the other functions of floats.
    """

    class Template(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            if len(args) != count or not all(kind == VALUES or _number(kind) for kind in args):
                return None
            if VALUES in args:
                return signature(VALUES, *(kind if kind == VALUES else FLOAT for kind in args))
            return signature(FLOAT, *(FLOAT for _ in args)) if own else None

    def lower(context: Any, builder: Any, kinds: Any, values: Any) -> Any:
        wide = VALUES in kinds.args
        if wide:
            values = [_widened(context, builder, kind, value) for kind, value in zip(kinds.args, values, strict=True)]
        return build(builder, wide, list(values))

    infer_global(function)(Template)
    choices = [[]]
    for _ in range(count):
        choices = [[*before, kind] for before in choices for kind in (VALUES, FLOAT)]
    for kinds in choices:
        if own or VALUES in kinds:
            lower_builtin(function, *kinds)(lower)


def _instruction(name: str) -> Callable[[Any, bool, list[Any]], Any]:
    return lambda builder, wide, values: getattr(builder, name)(*values)


def _intrinsic(name: str) -> Callable[[Any, bool, list[Any]], Any]:
    def build(builder: Any, wide: bool, values: list[Any]) -> Any:
        kind = _VECTOR if wide else _DOUBLE
        full = f"llvm.{name}.v{LANES}f64" if wide else f"llvm.{name}.f64"
        called = cgutils.get_or_insert_function(builder.module, ir.FunctionType(kind, [kind] * len(values)), full)
        return builder.call(called, values)

    return build


for _operators, _name in (
    ((operator.add, operator.iadd), "fadd"),
    ((operator.sub, operator.isub), "fsub"),
    ((operator.mul, operator.imul), "fmul"),
    ((operator.truediv, operator.itruediv), "fdiv"),
):
    for _operator in _operators:
        _arithmetic(_operator, 2, _instruction(_name), own=False)
_arithmetic(operator.neg, 1, _instruction("fneg"), own=False)
for _function, _name in ((root, "sqrt"), (sine, "sin"), (cosine, "cos"), (magnitude, "fabs")):
    _arithmetic(_function, 1, _intrinsic(_name), own=True)
_arithmetic(greater, 2, _intrinsic("maxnum"), own=True)
_arithmetic(fma, 3, _intrinsic("fma"), own=True)


def _array(function: Callable[..., Any], axes: int, build: Callable[..., Any], result: Callable[[Any], Any]) -> None:
    """Define type and code of the access to an array with `axes` axes, or with an additional axis of vectors."""

    class Template(AbstractTemplate):
        def generic(self, args: Any, kws: Any) -> Any:
            if not (isinstance(args[0], types.Array) and args[0].ndim in (axes, axes + 1) and args[0].layout == "C"):
                return None
            kind = VALUES if args[0].ndim > axes else FLOAT
            rest = [types.intp if isinstance(other, types.Integer) else kind for other in args[1:]]
            return signature(result(kind), args[0], *rest)

    infer_global(function)(Template)
    for extra in range(4):
        lower_builtin(function, types.Array, *([types.Any] * extra))(build)


def _place(context: Any, builder: Any, kind: Any, value: Any, indices: Any, axes: int) -> Any:
    array = context.make_array(kind)(context, builder, value)
    flat = indices[0]
    if axes == 2:
        columns = builder.extract_value(array.shape, 1)
        flat = builder.add(builder.mul(flat, columns), indices[1])
    if kind.ndim > axes:
        flat = builder.mul(flat, ir.Constant(flat.type, LANES))
    place = builder.gep(array.data, [flat])
    return builder.bitcast(place, _VECTOR.as_pointer()) if kind.ndim > axes else place


def _loading(axes: int) -> Callable[..., Any]:
    def build(context: Any, builder: Any, kinds: Any, values: Any) -> Any:
        return builder.load(_place(context, builder, kinds.args[0], values[0], values[1:], axes), align=8)

    return build


def _storing(axes: int) -> Callable[..., Any]:
    def build(context: Any, builder: Any, kinds: Any, values: Any) -> Any:
        place = _place(context, builder, kinds.args[0], values[0], values[1:-1], axes)
        builder.store(values[-1], place, align=8)
        return context.get_dummy_value()

    return build


def _zero(context: Any, builder: Any, kinds: Any, values: Any) -> Any:
    return ir.Constant(_DOUBLE, 0.0) if kinds.return_type == FLOAT else ir.Constant(_VECTOR, [0.0] * LANES)


_array(get, 1, _loading(1), lambda kind: kind)
_array(get2, 2, _loading(2), lambda kind: kind)
_array(put, 1, _storing(1), lambda kind: types.none)
_array(put2, 2, _storing(2), lambda kind: types.none)
_array(zero, 1, _zero, lambda kind: kind)


class _Some(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        return signature(types.boolean, VALUES if args[0] == VALUES else FLOAT)


infer_global(some)(_Some)


@lower_builtin(some, FLOAT)
def _some_number(context: Any, builder: Any, kinds: Any, values: Any) -> Any:
    return builder.fcmp_unordered("!=", values[0], ir.Constant(_DOUBLE, 0.0))


@lower_builtin(some, VALUES)
def _some_lane(context: Any, builder: Any, kinds: Any, values: Any) -> Any:
    differ = builder.fcmp_unordered("!=", values[0], ir.Constant(_VECTOR, [0.0] * LANES))
    bits = builder.bitcast(differ, ir.IntType(LANES))
    return builder.icmp_unsigned("!=", bits, ir.Constant(ir.IntType(LANES), 0))
