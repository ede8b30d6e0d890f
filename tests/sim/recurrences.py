"""The recurrences of `sim.kernel.taylor`, compiled for calls from Python; `py_func` is the interpreted function."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.kernel import taylor
from sim.kernel.compiled import inlined

Array = NDArray[np.float64]


def _forcing(row: Array, t: float, a: Array, n: int) -> None:
    taylor.forcing_coefficients(row, t, a, n)


def _resting(p: Array, a: Array, c: Array, n: int) -> None:
    taylor.resting_coefficients(p, a, c, n)


def _rocking(p: Array, sg: float, a: Array, c: Array, w: Array, n: int) -> None:
    taylor.rocking_coefficients(p, sg, a, c, w, n)


forcing: Any = inlined(_forcing)
resting: Any = inlined(_resting)
rocking: Any = inlined(_rocking)
