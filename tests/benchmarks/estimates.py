"""Estimates with a standard uncertainty beside the true value: coverage of their intervals, and bounds for a test."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.stats import beta, binom, chi2


class Estimate(NamedTuple):
    """Estimate, its standard uncertainty, and the true value, in one unit."""

    value: float
    u: float
    truth: float

    @property
    def e(self) -> float:
        """Error over the standard uncertainty."""
        return (self.value - self.truth) / self.u


class Omitted(NamedTuple):
    """A bench without an estimate, and the reason."""

    reason: str


COVERAGE = 2.0
"""Coverage factor of the expanded uncertainty: a normal error is within it with a probability of 0.9545."""

HONEST = 0.9545


@dataclass(frozen=True)
class Statistics:
    """Statistics of `n` estimates of one quantity.

    `expanded` is the rms of the expanded uncertainty (k = 2), and `relative` that over the true value. `covered` is the
    share of the intervals that contain the true value, and (`low`, `high`) its 95 % confidence interval after Clopper
    and Pearson. `rms` and `mean` are those of e, the error over the standard uncertainty.
    """

    n: int
    expanded: float
    relative: float
    covered: float
    low: float
    high: float
    rms: float
    mean: float

    @classmethod
    def of(cls, estimates: Sequence[Estimate]) -> "Statistics":
        n, u = len(estimates), np.array([each.u for each in estimates])
        truth, e = np.array([each.truth for each in estimates]), np.array([each.e for each in estimates])
        inside = int(np.count_nonzero(np.abs(e) <= COVERAGE))
        with np.errstate(divide="ignore"):
            relative = COVERAGE * float(np.sqrt(np.mean((u / truth) ** 2)))
        return cls(
            n=n,
            expanded=COVERAGE * float(np.sqrt(np.mean(u**2))),
            relative=relative,
            covered=inside / n,
            low=float(beta.ppf(0.025, inside, n - inside + 1)) if inside else 0.0,
            high=float(beta.ppf(0.975, inside + 1, n - inside)) if inside < n else 1.0,
            rms=float(np.sqrt(np.mean(e**2))),
            mean=float(e.mean()),
        )

    @property
    def conspicuous(self) -> bool:
        """Whether honest normal intervals give such a coverage, or such an rms of e, in 5 % of the cases or fewer."""
        low, high = (float(chi2.ppf(share, self.n)) for share in (0.025, 0.975))
        return not (self.low <= HONEST <= self.high and low <= self.n * self.rms**2 <= high)


def bounds(n: int, failing: float = 0.005) -> tuple[int, float]:
    """Least number of `n` intervals that contain the true value, and greatest rms of e, for a test.

    Honest estimates with normal errors pass with a probability of at least 1 - `failing`: half of it is for each bound.
    """
    return int(binom.ppf(0.5 * failing, n, HONEST)), float(np.sqrt(chi2.ppf(1.0 - 0.5 * failing, n) / n))
