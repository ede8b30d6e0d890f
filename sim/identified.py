"""Identified properties of a specimen: values, standard uncertainties and correlations."""

from collections.abc import Iterable, Sequence
from difflib import get_close_matches
from itertools import pairwise
from math import isclose

import numpy as np
from numpy.typing import NDArray
from pydantic import AwareDatetime, ValidationError, field_validator, model_validator

from sim.errors import InvalidInput
from sim.parameters import Parameters, quantity, unit_of
from sim.specimen import Block, Frame, Specimen, Spring

SPRING = "k_c:"
"""Prefix of the name of a spring's stiffness; the spring's label beta follows."""

UNITS = {name: unit_of(Frame.model_fields[name]) for name in ("m1", "m2", "k1", "k2", "xi1", "xi2")} | {
    name: unit_of(Block.model_fields[name]) for name in ("restitution_factor",)
}
"""Identifiable quantities of frame and block, with their SI units."""

_HIGHEST = {"xi1": 1.0, "xi2": 1.0, "restitution_factor": 2.0}
_MAY_VANISH = ("xi1", "xi2")
_ROUNDING = 1e-9
"""Magnitude of the most negative eigenvalue accepted for a correlation matrix, because its coefficients are rounded."""


def spring_name(label: float) -> str:
    """Name of the stiffness of the spring labelled beta = `label`."""
    return f"{SPRING}{label:.12g}"


def spring_label(name: str) -> float | None:
    """Label of the spring whose stiffness is called `name`; None if `name` is another quantity."""
    if not name.startswith(SPRING):
        return None
    try:
        label = float(name.removeprefix(SPRING))
    except ValueError:
        label = 0.0
    if not 0.0 < label < np.inf:
        raise InvalidInput("name", name, f'the label of a spring is a number above 0, as in "{SPRING}0.25"')
    return label


def unit(name: str) -> str:
    """SI unit of the quantity called `name`. Raises InvalidInput if it is not a quantity that can be identified."""
    if spring_label(name) is not None:
        return "N/m"
    if name not in UNITS:
        close = get_close_matches(name, UNITS, n=1)
        known = f"the nearest is {close[0]}" if close else f'give {", ".join(UNITS)}, or "{SPRING}" and a label'
        raise InvalidInput("name", name, f"no such quantity can be identified; {known}")
    return UNITS[name]


def possible(name: str, value: float) -> bool:
    """Whether this value of the quantity is physically possible; a fitted value may not be."""
    above = value >= 0.0 if name in _MAY_VANISH else value > 0.0
    return above and value < _HIGHEST.get(name, np.inf)


def _canonical(name: str) -> str:
    label = spring_label(name)
    return name if label is None else spring_name(label)


class Finding(Parameters):
    """One measured quantity of the specimen."""

    name: str = quantity(
        ..., "", "name of the quantity: m1, m2, k1, k2, xi1, xi2, restitution_factor, or k_c:LABEL (spring)"
    )
    value: float = quantity(..., "", "best estimate, in the quantity's SI unit", ge=0)
    standard_uncertainty: float = quantity(..., "", "standard uncertainty (k = 1), in the quantity's SI unit", ge=0)
    source: str = quantity(..., "", "source of the value")
    date: AwareDatetime = quantity(..., "", "date of the measurement")

    @property
    def unit(self) -> str:
        """SI unit of value and uncertainty."""
        return unit(self.name)

    @field_validator("name")
    @classmethod
    def _known(cls, name: str) -> str:
        try:
            unit(name)
        except InvalidInput as refusal:
            raise ValueError(refusal.allowed) from None
        return _canonical(name)

    @model_validator(mode="after")
    def _check_value(self) -> "Finding":
        if self.value == 0.0 and self.name not in _MAY_VANISH:
            raise InvalidInput("value", self.value, f"{self.name} must be above 0")
        highest = _HIGHEST.get(self.name, np.inf)
        if self.value >= highest:
            raise InvalidInput("value", self.value, f"{self.name} must be below {highest:g}")
        return self


class Correlation(Parameters):
    """Correlation of the errors of two findings."""

    first: str = quantity(..., "", "name of a finding")
    second: str = quantity(..., "", "name of another finding")
    coefficient: float = quantity(..., "1", "correlation coefficient of their errors", ge=-1, le=1)

    @field_validator("first", "second")
    @classmethod
    def _canonical_name(cls, name: str) -> str:
        return _canonical(name)

    @property
    def pair(self) -> frozenset[str]:
        """The two names, regardless of their order."""
        return frozenset((self.first, self.second))


class Identified(Parameters):
    """All measured properties of a specimen. Findings without a stated correlation are uncorrelated."""

    findings: tuple[Finding, ...] = quantity((), "", "identified properties, each quantity once")
    correlations: tuple[Correlation, ...] = quantity((), "", "correlations between findings")

    @model_validator(mode="after")
    def _check_findings(self) -> "Identified":
        names = self.names
        for index, name in enumerate(names):
            if name in names[:index]:
                raise InvalidInput("findings", name, "each quantity may occur only once")
        labels = sorted((label, name) for name in names if (label := spring_label(name)) is not None)
        for (label, _), (next_label, name) in pairwise(labels):
            if isclose(label, next_label):
                raise InvalidInput(
                    "findings", name, f"its label cannot be distinguished from that of {spring_name(label)}"
                )
        pairs: set[frozenset[str]] = set()
        for one in self.correlations:
            for name in (one.first, one.second):
                if name not in names:
                    raise InvalidInput("correlations", name, f"no such finding; the findings are {', '.join(names)}")
            if one.first == one.second or one.pair in pairs:
                pair = f"{one.first}, {one.second}"
                raise InvalidInput(
                    "correlations",
                    pair,
                    "a correlation must name two different findings, and each pair may occur only once",
                )
            pairs.add(one.pair)
        if self.correlations and float(np.linalg.eigvalsh(self.correlation(names)).min()) < -_ROUNDING:
            refused = [one.coefficient for one in self.correlations]
            allowed = "these correlations contradict each other: the correlation matrix has a negative eigenvalue"
            raise InvalidInput("correlations", refused, allowed)
        return self

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the findings, in order."""
        return tuple(finding.name for finding in self.findings)

    def finding(self, name: str) -> Finding | None:
        """Finding for a quantity; None if it has not been measured."""
        return next((finding for finding in self.findings if finding.name == name), None)

    def covariance(self, names: Sequence[str]) -> NDArray[np.float64]:
        """Covariance matrix of the findings `names`, shape (n, n), SI. Raises InvalidInput for an unknown name."""
        found = [self.finding(name) for name in names]
        if None in found:
            missing = names[found.index(None)]
            known = ", ".join(self.names) or "nothing"
            raise InvalidInput("name", missing, f"it has not been identified; identified quantities: {known}")
        sizes = np.array([finding.standard_uncertainty for finding in found if finding is not None])
        return self.correlation(names) * np.outer(sizes, sizes)

    def applied(self, specimen: Specimen) -> Specimen:
        """Best estimate of `specimen`, in which identified values replace the declared ones.

        The labels of the springs still refer to the declared k1. Raises InvalidInput for inconsistent values.
        """
        values = {finding.name: finding.value for finding in self.findings}
        measured = tuple(
            Spring(label=label, k_c=value) for name, value in values.items() if (label := spring_label(name))
        )
        labels = [spring.label for spring in measured]
        others = tuple(spring for spring in specimen.springs if spring.label not in labels)
        frame = {name: values[name] for name in Frame.model_fields if name in values}
        block = {name: values[name] for name in Block.model_fields if name in values}
        try:
            best = specimen.model_copy(
                update={
                    # construct a new frame, because a copy would keep the cached natural frequencies
                    "frame": Frame(**(specimen.frame.model_dump() | frame)),
                    "block": Block(**(specimen.block.model_dump() | block)),
                    "springs": others + measured,
                    "spring_k1": specimen.spring_k1 or (specimen.frame.k1 if "k1" in values else None),
                }
            )
        except ValidationError as error:
            cause = error.errors()[0].get("ctx", {}).get("error", error)
            raise InvalidInput(
                "findings", ", ".join(values), f"these values do not form a valid specimen: {cause}"
            ) from None
        if specimen.label is None:
            return best
        # the declared stiffness of a spring with another label is kept, unless it has been measured
        declared = specimen.spring_label is not None
        return (best.with_spring(specimen.k_c, specimen.label) if declared else best).coupled(specimen.label)

    def correlation(self, names: Sequence[str]) -> NDArray[np.float64]:
        """Correlation matrix of the findings `names`, shape (n, n)."""
        matrix = np.eye(len(names))
        for one in self.correlations:
            if one.first in names and one.second in names:
                i, j = names.index(one.first), names.index(one.second)
                matrix[i, j] = matrix[j, i] = one.coefficient
        return matrix

    def extended(self, findings: Iterable[Finding], correlations: Iterable[Correlation] = ()) -> "Identified":
        """Merge with newer findings, which replace those of the same names and their correlations."""
        findings, correlations = tuple(findings), tuple(correlations)
        kept, pairs = self.without(*(finding.name for finding in findings)), {one.pair for one in correlations}
        still = tuple(one for one in kept.correlations if one.pair not in pairs)
        return Identified(findings=kept.findings + findings, correlations=still + correlations)

    def without(self, *names: str) -> "Identified":
        """A copy without the findings `names` and their correlations."""
        return Identified(
            findings=tuple(finding for finding in self.findings if finding.name not in names),
            correlations=tuple(one for one in self.correlations if not one.pair & set(names)),
        )
