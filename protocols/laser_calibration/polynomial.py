"""Cross-validated fit of a polynomial to passes of a calibration.

The order is the one whose fits to all passes but one predict the omitted pass best. Higher orders add little noise, so
that the lowest order within one standard error of the best, a usual choice, would have larger errors. The uncertainty
combines the scatter of the fits that omit each pass in turn (jackknife) and the contribution of higher orders, or of
the highest one if this is chosen.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import sqrt

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

Array = NDArray[np.float64]

READINGS = 201
"""Number of readings at which polynomials are compared."""

PLACES: Array = np.linspace(-1.0, 1.0, READINGS)


@dataclass(frozen=True, eq=False)
class PolynomialFit:
    """Coefficients of the Chebyshev polynomials 0 to `order`, followed by those of two further terms: `whole`, shape
    (order + 3,), fitted to all passes, and `without`, shape (passes, order + 3), fitted without each pass in turn.

    `scores`, shape (orders,), are the rms prediction errors of the orders from 1 on; `beyond` is the rms contribution
    of higher orders, or of the highest one if this is chosen, and `scatter` that of it which the jackknife explains.
    `finest`, shape (passes, highest + 3), is `without` for the highest order; `solved` fits some of the passes with the
    chosen one.
    """

    order: int
    whole: Array
    without: Array
    scores: Array
    beyond: float
    scatter: float
    finest: Array
    solved: Callable[[Sequence[int]], Array]

    @property
    def residual(self) -> float:
        """Rms contribution of higher orders that is not their scatter."""
        return sqrt(max(self.beyond**2 - self.scatter**2, 0.0))


def fit_polynomial(rows: Sequence[Array]) -> PolynomialFit:
    """Least-squares fit to the equations `rows` of each pass, shape (k, highest + 4): polynomials from order 0 to the
    highest one, two further terms, and the right-hand side.
    """
    highest, every = rows[0].shape[1] - 4, range(len(rows))
    # the triangular factor of each pass has the same solutions as its rows, which are ten times as many
    factors = [np.linalg.qr(each, mode="r") for each in rows]

    def columns(order: int) -> list[int]:
        return [*range(order + 1), -3, -2]

    def solved(order: int, kept: Sequence[int]) -> Array:
        reduced = np.concatenate([factors[k] for k in kept])
        found, *_ = np.linalg.lstsq(reduced[:, columns(order)], reduced[:, -1], rcond=None)
        return found.astype(np.float64)

    def others(out: int) -> list[int]:
        return [k for k in every if k != out]

    def missed(order: int, out: int) -> float:
        wrong = rows[out][:, -1] - rows[out][:, columns(order)] @ solved(order, others(out))
        # the variance excludes the mean, since quantisation shifts the zero differently in each pass
        return float(np.var(wrong))

    squares: Array = np.array([[missed(order, out) for out in every] for order in range(1, highest + 1)])
    means = squares.mean(axis=1)
    order = int(means.argmin()) + 1

    def beyond(kept: Sequence[int]) -> Array:
        # beyond the highest order nothing is known: its own contribution stands for what may be missing
        coarser = solved(order if order < highest else max(highest - 1, 1), kept)[:-2]
        return values(solved(highest, kept)[:-2]) - values(coarser)

    return PolynomialFit(
        order=order,
        whole=solved(order, every),
        without=np.array([solved(order, others(out)) for out in every]),
        scores=np.sqrt(means),
        beyond=float(np.std(beyond(every))),
        scatter=scatter(np.array([beyond(others(out)) for out in every])),
        finest=np.array([solved(highest, others(out)) for out in every]),
        solved=lambda kept: solved(order, kept),
    )


def values(coefficients: Array, places: Array = PLACES) -> Array:
    """Values at `places` of a sum of Chebyshev polynomials, same shape."""
    return chebyshev.chebval(places, coefficients).astype(np.float64)


def jackknife(found: Array) -> float:
    """Jackknife standard uncertainty of a value, from its estimates with one of the n passes omitted, shape (n,); of
    several values, shape (n, m), the root mean square.
    """
    without: Array = found - np.mean(found, axis=0)
    return sqrt((len(found) - 1) * float(np.mean(without**2)))


def scatter(curves: Array) -> float:
    """Jackknife standard uncertainty of a curve at one place, excluding its mean, from the curves fitted without each
    pass in turn, shape (passes, places).
    """
    return jackknife(np.array([each - each.mean() for each in curves], dtype=np.float64))
