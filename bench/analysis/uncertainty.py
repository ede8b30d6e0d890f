"""Evaluation of uncertainties: mean of a few repeats, budgets, and rounding of values.

The Birge ratio, the square root of chi2 / (R - 1), shows whether R repeats scatter more than their uncertainties state
(Birge, Physical Review 40 (1932) 207). Where it exceeds 1, the same term is added to each variance to reduce the ratio
to 1 (Mandel and Paule, Analytical Chemistry 42 (1970) 1194), so that a dominant scatter makes the weights equal. A few
repeats determine the scatter only roughly, so its contribution follows Student's t with R - 1 degrees of freedom: it is
enlarged until +-1.96 times the combined uncertainty covers 95 %, as for other uncertainties (GUM:2008, G.4). Five and
more repeats whose scatter has a probability above 20 % under the stated uncertainties are consistent with them (test of
Cox, Metrologia 39 (2002) 589), and nothing is added, as this would make most intervals of consistent repeats too wide.
If the scatter is one to four times as large as stated, repeats may agree by chance: the interval then covers 87 % for
two repeats, 91 % for three, and 92 % for five or more.
"""

import json
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from math import floor, hypot, inf, isfinite, log10

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]

NOISE = "noise of the peaks"
"""Name of the contribution of noise to the budget of a peak that is taken from samples."""

_LEVEL = 0.975
_TESTED, _CONSISTENT = 5, 0.2
"""Fewest repeats that are tested for consistency, and the probability above which they are consistent."""
_STEPS, _CLOSE = 200, 1e-10


@dataclass(frozen=True, eq=False)
class Repeats:
    """Mean of R repeats of n quantities: `values`, shape (n,), are the means; `weights`, shape (R, n), are the weights
    of the repeats, which sum to 1; `scatter`, shape (n,), is the contribution of the scatter to the standard
    uncertainties, with Student's t; `birge`, shape (n,), are the Birge ratios, NaN for a single repeat.
    """

    values: Array
    weights: Array
    scatter: Array
    birge: Array


def mean_of_repeats(values: ArrayLike, variances: ArrayLike) -> Repeats:
    """Mean of R repeats of n independent quantities, from `values` and their `variances`, both of shape (R, n)."""
    found, own = np.asarray(values, dtype=np.float64), np.asarray(variances, dtype=np.float64)
    number = len(found)
    added, birge = np.zeros(found.shape[1]), np.full(found.shape[1], np.nan)
    if number > 1:
        squares = np.sum(_squares(found, own), axis=0)
        birge = np.sqrt(squares / (number - 1))
        added = np.where(_consistent(squares, number), 0.0, _addition(found, own))
    weights = _weights(own + added)
    spread = np.sqrt(added * np.sum(weights**2, axis=0))
    return Repeats(np.sum(weights * found, axis=0), weights, student_factor(number) * spread, birge)


def enlarged(covariance: Array, scatter: Array) -> Array:
    """`covariance` of a mean, shape (n, n), enlarged by the `scatter`, shape (n,); the correlations are kept."""
    own = np.diag(covariance)
    larger = np.sqrt(1.0 + scatter**2 / np.where(own > 0.0, own, np.inf))
    return np.outer(larger, larger) * covariance


def student_factor(number: int) -> float:
    """Factor applied to the scatter of `number` repeats: the 95 % interval of Student's t divided by that of the normal
    distribution; 0 for one repeat.
    """
    from scipy.special import ndtri, stdtrit

    return float(stdtrit(number - 1, _LEVEL) / ndtri(_LEVEL)) if number > 1 else 0.0


def _weights(variances: Array) -> Array:
    return (1.0 / variances) / np.sum(1.0 / variances, axis=0)


def _squares(values: Array, variances: Array) -> Array:
    return (values - np.sum(_weights(variances) * values, axis=0)) ** 2 / variances


def _consistent(squares: Array, number: int) -> NDArray[np.bool_]:
    """Whether chi2, shape (n,), of `number` repeats shows no scatter beyond the stated uncertainties."""
    from scipy.special import chdtrc

    return (number >= _TESTED) & (chdtrc(number - 1, squares) > _CONSISTENT)


def _addition(values: Array, variances: Array) -> Array:
    """Common addition to the variances that makes the Birge ratios 1, shape (n,); zero where the ratios are below 1.

    Newton's method from zero converges from below (DerSimonian and Kacker, Contemporary Clinical Trials 28 (2007) 105),
    and doubles the addition per step while far from the solution.
    """
    wanted = len(values) - 1
    added = np.zeros(values.shape[1])
    for _ in range(_STEPS):
        whole = variances + added
        squares = _squares(values, whole)
        excess = np.sum(squares, axis=0) - wanted
        if not np.any(excess > _CLOSE):
            break
        added += np.maximum(excess, 0.0) / np.maximum(np.sum(squares / whole, axis=0), np.finfo(np.float64).tiny)
    return added


COVERAGE = 2.0
"""Coverage factor k of every expanded uncertainty."""

NORMAL = 1000.0
"""Effective degrees of freedom at and above which they are not stated: Student's t is then practically normal."""


@dataclass(frozen=True)
class Budget:
    """Independent contributions to the uncertainty of one result: standard uncertainties in the unit of the result, by
    name.

    `freedom` holds the degrees of freedom of the contributions for which they are finite. `correlations` are those
    between the errors of two quantities whose ratio is the result: errors of correlation 1 and equal relative size
    cancel.
    """

    parts: Mapping[str, float]
    freedom: Mapping[str, float] = field(default_factory=dict[str, float])
    correlations: Mapping[str, float] = field(default_factory=dict[str, float])

    @property
    def largest_first(self) -> dict[str, float]:
        """The contributions in descending order."""
        return dict(sorted(self.parts.items(), key=lambda part: -part[1]))

    @property
    def expanded(self) -> float:
        """Expanded uncertainty (k = 2)."""
        return COVERAGE * hypot(*self.parts.values())

    @property
    def effective_freedom(self) -> float:
        """Effective degrees of freedom of the combined uncertainty (Welch and Satterthwaite, GUM G.4.1)."""
        return combined_freedom([(part, self.freedom.get(name, inf)) for name, part in self.parts.items()])

    @property
    def dominating(self) -> str:
        """Name of the largest contribution; empty if none is above zero."""
        name, value = next(iter(self.largest_first.items()), ("", 0.0))
        return name if value > 0.0 else ""

    @property
    def as_json(self) -> str:
        """All contributions as JSON, largest first, with three significant digits."""
        return json.dumps({name: float(f"{value:.3g}") for name, value in self.largest_first.items()})

    @property
    def fields(self) -> dict[str, str | float | None]:
        """Columns of a result that describe its budget."""
        freedom = self.effective_freedom
        return {
            "dominating": self.dominating,
            "uncertainty_parts": self.as_json,
            "uncertainty_correlations": json.dumps({name: round(r, 4) for name, r in self.correlations.items()}),
            "degrees_of_freedom": freedom if freedom < NORMAL else None,
        }


def combined_freedom(parts: Iterable[tuple[float, float]]) -> float:
    """Effective degrees of freedom of the root sum of squares of standard uncertainties, each with its own degrees of
    freedom (Welch and Satterthwaite, GUM G.4.1).
    """
    known = [(part, freedom) for part, freedom in parts if part > 0.0]
    total = hypot(*(part for part, _ in known))
    weight = sum((part / total) ** 4 / freedom for part, freedom in known)
    return 1.0 / weight if weight > 0.0 else inf


def decimals(uncertainty: float) -> int | None:
    """Number of decimal places with which an uncertainty has two significant digits; None unless the uncertainty is
    finite and positive.
    """
    if not (isfinite(uncertainty) and uncertainty > 0.0):
        return None
    return max(1 - floor(log10(uncertainty)), 0)


def plus_minus(value: float, uncertainty: float, sign: str = "+-") -> str:
    """A value with its uncertainty, as in 213.44 +- 0.32; the value alone if there is no usable uncertainty."""
    places = decimals(uncertainty)
    return f"{value:.6g}" if places is None else f"{value:.{places}f} {sign} {uncertainty:.{places}f}"


def in_brackets(value: float, uncertainty: float) -> str:
    """A value with its uncertainty in units of the last digit, as in 213.44(16); the value alone if it has none."""
    places = decimals(uncertainty)
    return f"{value:.6g}" if places is None else f"{value:.{places}f}({round(uncertainty * 10.0**places):d})"
