"""The shortest vector that satisfies linear equations and inequalities."""

import numpy as np

from bench.analysis.table_motion import Array

INFEASIBLE = 1e-10
"""Least squares' residual below which no vector satisfies the inequalities."""


class Infeasible(Exception):
    """No vector satisfies them all."""


def shortest(equations: tuple[Array, Array], inequalities: tuple[Array, Array]) -> Array:
    """The y, shape (n,), of least |y| with A y = b and G y >= h.

    The equations' shortest solution is split off; what is left is least-distance programming, whose dual is a
    non-negative least squares problem. `equations` is (A, b), of full row rank, `inequalities` (G, h). Raises
    Infeasible. Source: Lawson and Hanson, Solving Least Squares Problems, 1974, chapter 23.
    """
    from scipy.optimize import nnls

    (a, b), (g, h) = equations, inequalities
    inverse = np.linalg.pinv(a)
    particular = inverse @ b
    free, needed = g - (g @ inverse) @ a, h - g @ particular
    if not (needed > 0.0).any():
        return particular
    # in lengths of the distance that the farthest inequality asks for at least
    scale = float((needed / np.linalg.norm(free, axis=1)).max())
    dual = np.vstack((scale * free.T, needed))
    target = np.zeros(dual.shape[0])
    target[-1] = 1.0
    multipliers = np.asarray(nnls(dual, target, maxiter=50 * h.size)[0], dtype=np.float64)
    residual = dual @ multipliers - target
    if -residual[-1] < INFEASIBLE:
        raise Infeasible
    # the multipliers say which inequalities are equations; the vector from these is good to rounding
    active = multipliers > 0.0
    return particular + np.linalg.lstsq(free[active], needed[active], rcond=1e-12)[0]
