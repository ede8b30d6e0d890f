"""Running gain of a test: published at every check of the motion, and used to decide whether a longer wait pays."""

from collections.abc import Generator
from math import hypot

from bench.analysis.cycles import Cycle
from bench.analysis.gain import TRANSIENT, SteadyPeak, steady_peak
from bench.analysis.running_gain import RunningGain
from bench.analysis.sensor_uncertainty import STEPS
from bench.engine.steps import Outcome, Publish, Step
from bench.live_values import Estimate
from protocols.common.sine.pace import Pace

SHARE = 0.5
"""Standard uncertainty due to the remaining transient, relative to that due to everything else, above which a longer
wait pays: below, the transient widens the interval by less than an eighth.
"""

NEGLIGIBLE = 0.001
"""Standard uncertainty due to the remaining transient, relative to the gain, for which no test is prolonged."""


class RunningPoint:
    """Running gain at one frequency, with the prediction; `gain` is None in the test of the bare frame."""

    def __init__(
        self, omega: float, beta: float | None, gain: RunningGain | None, predicted: float, pace: Pace
    ) -> None:
        self._omega, self._beta, self._gain, self._predicted, self._pace = omega, beta, gain, predicted, pace
        self._evaluated = 0

    def report(self, cycles: list[Cycle]) -> Generator[Step, Outcome, None]:
        """Publish the gain of the last cycles, and the progress."""
        self._evaluated += len(cycles)
        peak = steady_peak(cycles, self._omega)
        alpha_2 = uncertainty = float("nan")
        if self._gain is not None:
            found = self._gain.of(peak)
            alpha_2, uncertainty = found.alpha_2, found.uncertainty
        yield Publish(
            Estimate(self._omega, self._beta, self._evaluated, peak.drift, alpha_2, uncertainty, self._predicted)
        )
        yield Publish(self._pace.progress(f"settling at {self._omega:g} rad/s", self._omega, self._evaluated))

    def worth_waiting(self, peak: SteadyPeak) -> bool:
        """Whether the remaining transient contributes so much to the uncertainty of the gain that a longer wait pays.

        The resolution of the lasers is not counted among the other contributions, because the final evaluation reduces
        it.
        """
        transient = peak.transient / peak.drift
        if self._gain is None or transient <= NEGLIGIBLE:
            return False
        found = self._gain.of(peak)
        others = [part for name, part in found.budget.parts.items() if name not in (TRANSIENT, STEPS)]
        return transient > SHARE * hypot(*others) / found.alpha_2
