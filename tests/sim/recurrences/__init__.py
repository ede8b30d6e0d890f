"""The recurrences of `sim.kernel.taylor`, compiled for calls from Python; `py_func` is the interpreted function.

A package of its own: the compiled functions are kept until a file of their folder or of the kernel changes.
"""

from typing import Any

from sim.kernel import taylor
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
