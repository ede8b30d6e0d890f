"""What the figures of a campaign draw: histories at a rate that is enough for the eye."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from bench.analysis.signals import ACCELERATION, DRIFT
from protocols.earthquake.live import STEP
from protocols.earthquake.records import Shaking

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class DriftHistory:
    """Measured and predicted drift [m], every `STEP` seconds; the predicted one ends where the model topples."""

    measured: Array
    predicted: Array


@dataclass(eq=False)
class Histories:
    """Gathered while the campaign runs: accelerations of the table [m/s2], and drifts by record and stiffness.

    The stiffness is None for the bare frame.
    """

    asked: dict[str, Array] = field(default_factory=dict[str, Array])
    achieved: dict[str, Array] = field(default_factory=dict[str, Array])
    drifts: dict[tuple[str, float | None], DriftHistory] = field(
        default_factory=dict[tuple[str, float | None], DriftHistory]
    )

    def bare(self, shaking: Shaking, signals: Array, predicted: Array) -> None:
        """Keep the bare frame's test."""
        every = _every(shaking)
        self.asked[shaking.name] = shaking.target.acceleration[::every]
        self.achieved[shaking.name] = signals[: shaking.target.acceleration.size : every, ACCELERATION]
        self.drifts[shaking.name, None] = DriftHistory(signals[::every, DRIFT], predicted)

    def coupled(self, shaking: Shaking, beta: float, signals: Array, predicted: Array) -> None:
        """Keep a test with a spring."""
        self.drifts[shaking.name, beta] = DriftHistory(signals[:: _every(shaking), DRIFT], predicted)


def _every(shaking: Shaking) -> int:
    return max(round(STEP * shaking.target.sample_rate), 1)
