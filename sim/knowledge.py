"""Uncertainty of a specimen's properties, and random specimens drawn from it."""

from collections.abc import Mapping
from math import hypot, sqrt
from typing import Self

import numpy as np
from numpy.typing import NDArray

from sim.identified import Finding, Identified, spring_name
from sim.parameters import Parameters, quantity
from sim.specimen import Block, Frame, Specimen


class SpecimenUncertainty(Parameters):
    """Relative half widths of independent uniform distributions (GUM 4.3.7)."""

    stiffness: float = quantity(0.05, "1", "relative half width of the stiffness of each storey", ge=0, le=0.5)
    damping: float = quantity(0.30, "1", "relative half width of the damping ratio of each mode", ge=0, le=0.9)
    restitution: float = quantity(0.01, "1", "relative half width of the block's restitution", ge=0, le=0.2)
    spring: float = quantity(0.10, "1", "relative half width of the stiffness of the coupling spring", ge=0, le=0.5)


LARGEST_DAMPING = 0.999
"""Upper bound of drawn damping ratios, which must be below 1."""

ELASTIC = 1.0 - 1e-12
"""Upper bound of drawn restitutions, which must be below 1 even after rounding."""

LEAST = 1e-3
"""Lower bound of a drawn quantity, as a fraction of its best estimate, so that no quantity is negative."""

RECTANGULAR = 1.0 / sqrt(3.0)
"""Standard uncertainty of a uniform distribution with half width 1 (GUM 4.3.7)."""

Floats = NDArray[np.float64]

FRAME = ("m1", "m2", "k1", "k2", "xi1", "xi2")
RESTITUTION = "restitution_factor"
SPRING = "k_c"
"""Quantities that can be uncertain; SPRING is the stiffness of the mounted spring."""

_WIDTH = {
    "k1": "stiffness",
    "k2": "stiffness",
    "xi1": "damping",
    "xi2": "damping",
    RESTITUTION: "restitution",
    SPRING: "spring",
}
"""Half width (field of `SpecimenUncertainty`) of each quantity; none for masses, which are weighed or identified."""

_OF_MASSES = "stiffness"
"""Name of the half width with which the masses are grouped in lists of contributions: one fit identifies the frame's
stiffnesses and masses.
"""


class SpecimenKnowledge(SpecimenUncertainty):
    """Uncertainty of a specimen: covariance of measured quantities (jointly normal), half widths of the others.

    The methods expect specimens that have the measured values (see `Identified.applied`). `give` is an additional
    relative half width of the restitution.
    """

    identified: Identified = Identified()
    give: float = quantity(
        0.0,
        "1",
        "additional relative half width of the block's restitution, to allow for motion of the table at impacts",
        ge=0,
        lt=1,
    )

    def draws(self, specimen: Specimen, n: int, random: np.random.Generator) -> list[Specimen]:
        """Draw `n` random specimens from the distribution around `specimen`.

        A restitution that would reach 1 is set just below 1.
        """
        widths = np.array([getattr(self, width) for width in _WIDTH.values()])
        columns = dict(zip(_WIDTH, (1.0 + widths * random.uniform(-1.0, 1.0, (n, widths.size))).T, strict=True))
        if measured := self._measured(specimen):
            matrix, sizes = self._spread(measured)
            root = np.array(sizes)[:, None] * root_of(matrix)
            normal = 1.0 + random.standard_normal((n, len(measured))) @ root.T
            columns |= dict(zip(measured, normal.T, strict=True))
        if self.give > 0.0:
            columns[RESTITUTION] = columns[RESTITUTION] * (1.0 + self.give * random.uniform(-1.0, 1.0, n))
        rows = np.column_stack(list(columns.values())).tolist()
        return [scaled(specimen, dict(zip(columns, row, strict=True))) for row in rows]

    def relative(self, specimen: Specimen) -> dict[str, float]:
        """Relative standard uncertainty of every uncertain quantity of `specimen`, by name."""
        sizes = {name: RECTANGULAR * float(getattr(self, width)) for name, width in _WIDTH.items()}
        measured = self._measured(specimen)
        sizes |= dict(zip(measured, self._spread(measured)[1], strict=True))
        sizes[RESTITUTION] = hypot(sizes[RESTITUTION], RECTANGULAR * self.give)
        return {name: size for name, size in sizes.items() if size > 0.0}

    def correlations(self, specimen: Specimen) -> dict[tuple[str, str], float]:
        """Correlation coefficients of pairs of uncertain quantities; pairs that are absent are uncorrelated."""
        measured, sizes = self._measured(specimen), self.relative(specimen)
        names, (matrix, own) = list(measured), self._spread(measured)
        # the other sources of uncertainty are independent and thus reduce the correlations
        shares = [size / sizes[name] if name in sizes else 0.0 for name, size in zip(names, own, strict=True)]
        weakened = matrix * np.outer(shares, shares)
        return {
            (names[i], names[j]): float(weakened[i, j])
            for i in range(len(names))
            for j in range(i)
            if weakened[i, j] != 0.0
        }

    def deviations(self, specimen: Specimen, share: float = 1.0) -> list[tuple[Specimen, Specimen]]:
        """Pairs of specimens, `share` standard uncertainties to either side of `specimen` along independent directions.

        For a result y, the sum over the pairs of ((y_1 - y_2) / (2 share))^2 is the variance to first order (GUM 5.1.4,
        note 2, along the principal axes of the correlation matrix).
        """
        sizes = self.relative(specimen)
        names = list(sizes)
        steps = share * np.array(list(sizes.values()))[:, None] * root_of(self._matrix(specimen, names))

        def moved(step: Floats) -> Specimen:
            return scaled(specimen, dict(zip(names, (1.0 + step).tolist(), strict=True)))

        return [(moved(step), moved(-step)) for step in steps.T if step.any()]

    def propagated(self, specimen: Specimen, slopes: Mapping[str, float]) -> tuple[float, dict[str, float]]:
        """Standard uncertainty of a result to first order (GUM Eq. 13), and the contribution of each uncertain
        quantity, largest first. `slopes` are the derivatives of the result with respect to their logarithms.
        """
        sizes = self.relative(specimen)
        parts = np.array([slopes[name] * size for name, size in sizes.items()])
        combined = sqrt(max(float(parts @ self._matrix(specimen, list(sizes)) @ parts), 0.0))
        each = dict(zip(sizes, np.abs(parts).tolist(), strict=True))
        return combined, dict(sorted(each.items(), key=lambda part: -part[1]))

    def _matrix(self, specimen: Specimen, names: list[str]) -> Floats:
        """Correlation matrix of the uncertain quantities `names`, shape (n, n)."""
        matrix = np.eye(len(names))
        for (one, other), coefficient in self.correlations(specimen).items():
            i, j = names.index(one), names.index(other)
            matrix[i, j] = matrix[j, i] = coefficient
        return matrix

    def only(self, *widths: str) -> Self:
        """Return a copy in which all quantities are exact except those whose half width is named in `widths`."""
        findings = [
            finding if _governor(finding.name) in widths else finding.model_copy(update={"standard_uncertainty": 0.0})
            for finding in self.identified.findings
        ]
        identified = Identified(findings=tuple(findings), correlations=self.identified.correlations)
        give = self.give if "restitution" in widths else 0.0
        zero = dict.fromkeys(set(SpecimenUncertainty.model_fields) - set(widths), 0.0)
        return self.model_copy(update={**zero, "identified": identified, "give": give})

    def _measured(self, specimen: Specimen) -> dict[str, Finding]:
        """Findings that apply to `specimen`, by quantity."""
        names = {name: name for name in (*FRAME, RESTITUTION)}
        if specimen.label:
            names[SPRING] = spring_name(specimen.label)
        found = {name: self.identified.finding(finding) for name, finding in names.items()}
        return {name: finding for name, finding in found.items() if finding is not None}

    def _spread(self, measured: Mapping[str, Finding]) -> tuple[Floats, list[float]]:
        """Correlation matrix, shape (n, n), and relative standard uncertainties of the findings."""
        findings = list(measured.values())
        matrix = self.identified.correlation([finding.name for finding in findings])
        # a factor has no effect on a quantity that is zero
        relative = [each.standard_uncertainty / each.value if each.value else 0.0 for each in findings]
        return matrix, relative


def root_of(matrix: Floats) -> Floats:
    """Matrix R, shape (n, n), with R R' = `matrix`, which is symmetric and, up to rounding, positive semidefinite."""
    values, vectors = np.linalg.eigh(matrix)
    root: Floats = vectors * np.sqrt(np.maximum(values, 0.0))
    return root


def _governor(finding: str) -> str:
    """Name of the half width that a finding replaces, or with which it is grouped."""
    return _WIDTH.get(finding, _OF_MASSES if finding in FRAME else _WIDTH[SPRING])


def scaled(specimen: Specimen, factors: Mapping[str, float]) -> Specimen:
    """Return `specimen` with its values multiplied by the factors, within the physical range.

    The factor of the spring applies to k_C, and is independent of k1.
    """
    frame, block, beta = specimen.frame, specimen.block, specimen.beta
    f = dict.fromkeys((*FRAME, RESTITUTION, SPRING), 1.0) | {k: max(v, LEAST) for k, v in factors.items()}
    # construct a new frame, because a copy would keep the cached natural frequencies
    values = frame.model_dump() | {name: getattr(frame, name) * f[name] for name in FRAME}
    values |= {name: min(values[name], LARGEST_DAMPING) for name in ("xi1", "xi2")}
    elastic = ELASTIC / block.restitution if block.restitution > 0.0 else 1.0
    bounce = {RESTITUTION: block.restitution_factor * min(f[RESTITUTION], elastic)}
    return specimen.model_copy(
        update={
            "frame": Frame(**values),
            "block": Block(**(block.model_dump() | bounce)),
            "beta": None if beta is None else beta * f[SPRING] / f["k1"],
        }
    )
