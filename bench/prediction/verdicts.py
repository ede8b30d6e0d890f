"""A statement about the coupled frame, and whether it holds."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum


class Verdict(StrEnum):
    """What became of a claim. EXPECTED: it is known, and documented, that the model does not do what the paper says."""

    HOLDS = "holds"
    FAILS = "does not hold"
    EXPECTED = "does not hold, as expected"


@dataclass(frozen=True)
class Check:
    """One claim: what is asked for, what was found, and the numbers `values` (SI, by name) behind it."""

    claim: str
    found: str
    holds: bool
    values: Mapping[str, float]
    expected: bool = True

    @property
    def verdict(self) -> Verdict:
        """The verdict on this claim."""
        if self.holds:
            return Verdict.HOLDS
        return Verdict.FAILS if self.expected else Verdict.EXPECTED


@dataclass(frozen=True)
class Statement:
    """A numbered statement of the paper and the checks that it consists of."""

    number: int
    title: str
    checks: Sequence[Check]

    @property
    def verdict(self) -> Verdict:
        """It holds when every check does; one that fails unexpectedly outweighs those whose failure is known."""
        verdicts = [check.verdict for check in self.checks]
        return next((each for each in (Verdict.FAILS, Verdict.EXPECTED) if each in verdicts), Verdict.HOLDS)
