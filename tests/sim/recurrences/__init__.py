"""The recurrences of `sim.kernel.taylor` and the functions of `sim.kernel.roots`, compiled for calls from Python;
`py_func` is the interpreted function.

A package of its own: the compiled functions are kept until a file of their folder or of the kernel changes.
"""

from typing import Any

from sim.kernel import roots, taylor
from sim.kernel.compiled import compiled


@compiled("void(float64[::1], float64, float64[::1], int64)")
def forcing(row: Any, t: float, a: Any, n: int) -> None:
    taylor.forcing_coefficients(row, t, a, n)


@compiled("void(float64[::1], float64[::1], float64[:, ::1], int64)")
def resting(p: Any, a: Any, c: Any, n: int) -> None:
    taylor.resting_coefficients(p, a, c, n)


@compiled("void(float64[::1], float64, float64[::1], float64[:, ::1], float64[:, ::1], int64)")
def rocking(p: Any, sg: float, a: Any, c: Any, w: Any, n: int) -> None:
    taylor.rocking_coefficients(p, sg, a, c, w, n)


@compiled("Tuple((float64, float64, float64))(float64[::1], int64, float64)")
def evaluate(p: Any, n: int, t: float) -> tuple[float, float, float]:
    return roots.evaluate(p, n, t)


@compiled("float64(float64[::1], int64, float64)")
def first_root(p: Any, n: int, h: float) -> float:
    return roots.first_root(p, n, h)


@compiled("float64(float64[::1], int64, float64, float64)")
def greatest_magnitude(p: Any, n: int, start: float, h: float) -> float:
    begin, rise, _ = roots.evaluate(p, n, start)
    end, fall, _ = roots.evaluate(p, n, h)
    return roots.greatest_magnitude(p, n, start, h, begin, rise, end, fall, 0.0)
