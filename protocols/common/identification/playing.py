"""How one drive of an identification is played: from rest to rest, and what is done when the block falls."""

from collections.abc import Callable, Generator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from bench.engine.steps import Arm, Fallen, Outcome, Play, Played, RampOut, Step
from bench.events import Event, Progress
from bench.guard.limits import Limits
from protocols.common.calibrate import Unmeasurable

Array = NDArray[np.float64]

REST = 2.0
"""Time at rest before each drive, over which the zero of the signals is taken [s]."""

OVERHEAD = 12.0
"""Time of a drive besides itself: rest, until the storeys are still, ramp [s]."""


@dataclass
class Rules:
    """What all drives of one identification have in common; `knee` [Hz] is the upper end of the table's band.

    `expected` [s] is the length of all of it, of which `gone` [s] have been played.
    """

    limits: Limits
    sample_rate: float
    knee: float
    expected: float
    gone: float = 0.0

    def require_drive(self, volts: Array) -> None:
        """Raise Unmeasurable for a drive beyond its limits: the table answers less than expected."""
        peak, slew = float(np.abs(volts).max()), float(np.abs(np.diff(volts)).max()) * self.sample_rate
        limits = self.limits
        if peak > limits.drive_voltage or slew > limits.drive_slew:
            raise Unmeasurable(
                f"the motion would take {peak:.3g} V and {slew:.3g} V/s of drive, limits.drive_voltage ="
                f" {limits.drive_voltage:g} V, limits.drive_slew = {limits.drive_slew:g} V/s: ask for less --level or"
                " for a narrower band"
            )

    def progress(self, activity: str) -> Progress:
        """Where the identification stands."""
        return Progress(self.gone / self.expected, self.expected - self.gone, activity)

    def remains(self, seconds: float) -> None:
        """So long is expected to be left [s]: the probes may have been more or fewer than most tables take."""
        self.expected = self.gone + seconds

    def watch(self) -> Callable[[Array], Event]:
        """Tells how far it is, block by block."""
        since = 0

        def look(signals: Array) -> Event:
            nonlocal since
            since += len(signals)
            gone = min(self.gone + since / self.sample_rate, self.expected)
            return Progress(gone / self.expected, self.expected - gone, "the multisine is played")

        return look


def played(volts: Array, rules: Rules) -> Generator[Step, Outcome, Played | Fallen]:
    """Arm, play and ramp out; `Fallen` also when the block falls in the ramp."""
    yield Arm(REST)
    outcome = yield Play(volts, rules.watch())
    end = yield RampOut(fast=isinstance(outcome, Fallen))
    rules.gone += volts.size / rules.sample_rate + OVERHEAD
    if isinstance(outcome, Played) and not isinstance(end, Fallen):
        return outcome
    return Fallen()
