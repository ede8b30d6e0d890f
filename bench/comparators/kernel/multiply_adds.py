"""Independent fused multiply-adds: the largest rate of floating-point operations that a core reaches."""

import numpy as np
from numpy.typing import NDArray

from sim.kernel.compiled import compiled, generic
from sim.kernel.lanes import fma, get, put

CHAINS = 12
"""Number of independent recurrences, more than the multiply-adds that a typical core executes at once."""


@generic
def _multiply_adds(a: NDArray[np.float64], rounds: int) -> None:
    """CHAINS recurrences s = s x + y at once; `a` has x, y and the initial values, and receives the last ones."""
    x, y = get(a, 0), get(a, 1)
    s0, s1, s2, s3 = get(a, 2), get(a, 3), get(a, 4), get(a, 5)
    s4, s5, s6, s7 = get(a, 6), get(a, 7), get(a, 8), get(a, 9)
    s8, s9, s10, s11 = get(a, 10), get(a, 11), get(a, 12), get(a, 13)
    for _ in range(rounds):
        s0, s1, s2, s3 = fma(s0, x, y), fma(s1, x, y), fma(s2, x, y), fma(s3, x, y)
        s4, s5, s6, s7 = fma(s4, x, y), fma(s5, x, y), fma(s6, x, y), fma(s7, x, y)
        s8, s9, s10, s11 = fma(s8, x, y), fma(s9, x, y), fma(s10, x, y), fma(s11, x, y)
    put(a, 2, s0 + s1 + s2 + s3 + (s4 + s5 + s6 + s7) + (s8 + s9 + s10 + s11))


@compiled("void(float64[::1], int64)")
def multiply_adds(a: NDArray[np.float64], rounds: int) -> None:
    """`_multiply_adds` of single numbers, `a` of shape (2 + CHAINS,)."""
    _multiply_adds(a, rounds)


@compiled("void(float64[:,::1], int64)")
def multiply_adds_in_lanes(a: NDArray[np.float64], rounds: int) -> None:
    """`_multiply_adds` of vectors, `a` of shape (2 + CHAINS, LANES)."""
    _multiply_adds(a, rounds)
