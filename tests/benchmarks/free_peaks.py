"""Peaks of free motions of drawn benches, against the simulator's own samples.

    python -m tests.benchmarks.free_peaks [--seeds 100] [--points 15:0.97 12.5:0.64] [--scales] [--waves 0.5 2]

Each run is `rockbench run harmonic --no-hold` at one point on the simulated bench, with the specimen drawn as in
`tests.benchmarks.hold`, and with `--scales` the scales of the sensors as well; `--waves 3 6` draws the number of waves
of the lasers' linearity errors. The true gains are those of the largest true drift within a period that slides over the
cycles that the bench evaluated: least, mean and greatest, over the peak of the mean true cycle of the bare frame.
Printed for each run: error in per cent and in expanded uncertainties. In the end, for each quantity: rms of e, the
share of the intervals that contain the truth, and the share of the predicted ranges that contain it.
"""

import argparse
import contextlib
from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass, field
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from bench.analysis import free_motion
from bench.analysis.cycles import Cycle, CycleAnalyser
from bench.engine import drives
from drivers.simulated import SimulatedRig
from protocols.common.sine import settling
from tests.benchmarks.estimates import Estimate, Statistics
from tests.benchmarks.hold import measured

DELAY = 10
"""Delay of filter and lasers [samples], about."""

NAMES = "least", "mean", "greatest"


@dataclass
class Witness:
    """True drift since the last start of the rig, and the true peaks of the cycles that were evaluated."""

    parts: list[NDArray[np.float64]] = field(default_factory=list[NDArray[np.float64]])
    analyser: CycleAnalyser | None = None
    bare: float = 0.0
    peaks: NDArray[np.float64] = field(default_factory=lambda: np.zeros(0))

    def of(self, cycles: Sequence[Cycle]) -> NDArray[np.float64]:
        """True drift in consecutive cycles [m]."""
        assert self.analyser is not None
        whole = np.concatenate(self.parts)
        first, last = (self.analyser.start_of(index) for index in (cycles[0].index, cycles[-1].index + 1))
        return whole[first - DELAY : last - DELAY]

    def largest(self, cycles: Sequence[Cycle]) -> NDArray[np.float64]:
        """Largest true drift in each position of a period within consecutive cycles [m]."""
        drift = np.abs(self.of(cycles))
        return sliding_window_view(drift, round(drift.size / len(cycles))).max(axis=1)

    def peak(self, cycles: Sequence[Cycle]) -> float:
        """Peak of the mean true cycle after subtraction of its mean [m]."""
        drift = self.of(cycles)
        harmonics = np.fft.rfft(drift)[:: len(cycles)] / drift.size
        harmonics[0] = 0.0
        length = 2 * (harmonics.size - 1)
        return length * float(np.abs(np.fft.irfft(harmonics, length)).max())


@contextlib.contextmanager
def witnessed() -> Generator[Witness]:
    """Context in which the true motion of the simulated rig is kept."""
    witness = Witness()
    begin, respond = SimulatedRig.begin, SimulatedRig.respond

    def begun(rig: SimulatedRig) -> None:
        begin(rig)
        witness.parts.clear()

    def responded(rig: SimulatedRig, volts: NDArray[np.float64]) -> Any:
        counts = respond(rig, volts)
        truth = rig.bench.truth
        witness.parts.append(truth.u2 - truth.u1)
        return counts

    def made(*arguments: Any) -> CycleAnalyser:
        witness.analyser = CycleAnalyser(*arguments)
        return witness.analyser

    def before(function: Callable[..., Any], note: Callable[[Sequence[Cycle]], None]) -> Callable[..., Any]:
        def called(cycles: Sequence[Cycle], *arguments: Any, **named: Any) -> Any:
            note(cycles)
            return function(cycles, *arguments, **named)

        return called

    def note_bare(cycles: Sequence[Cycle]) -> None:
        witness.bare = witness.bare or witness.peak(cycles)

    def note_free(cycles: Sequence[Cycle]) -> None:
        witness.peaks = witness.largest(cycles[-free_motion.CYCLES :])

    with (
        patch.object(SimulatedRig, "begin", begun),
        patch.object(SimulatedRig, "respond", responded),
        patch.object(drives, "CycleAnalyser", made),
        patch.object(settling, "steady_peak", before(settling.steady_peak, note_bare)),
        patch.object(settling, "free_motion", before(settling.free_motion, note_free)),
    ):
        yield witness


def free_peaks(
    omega: float,
    beta: float,
    seed: int,
    share: float,
    options: list[str],
    *,
    scales: bool,
    waves: tuple[float, float] | None = None,
) -> tuple[dict[str, Any], Any]:
    """The point of one run, and the estimates by name; none if the motion became steady or the block fell."""
    with witnessed() as witness:
        point = measured(omega, beta, seed, share, ["--no-hold", *options], scales=scales, waves=waves)
    if point["status"] != "modulated":
        return point, {}
    true = witness.peaks / witness.bare
    truths = dict(zip(NAMES, (true.min(), true.mean(), true.max()), strict=True))
    return point, {
        name: Estimate(point[f"alpha_2_{name}"], 0.5 * point[f"alpha_2_{name}_uncertainty"], float(truths[name]))
        for name in NAMES
    }


def study() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=100)
    parser.add_argument("--first", type=int, default=1)
    parser.add_argument("--share", type=float, default=0.04)
    parser.add_argument("--points", nargs="+", default=["15:0.97", "12.5:0.64"])
    parser.add_argument("--scales", action="store_true", help="draw the scales of the sensors as well")
    parser.add_argument("--waves", type=float, nargs=2, help="fewest and most waves of the linearity errors")
    parser.add_argument("--options", nargs=argparse.REMAINDER, default=[])
    asked = parser.parse_args()
    for text in asked.points:
        omega, beta = map(float, text.split(":"))
        found: dict[str, list[Estimate]] = {name: [] for name in NAMES}
        inside: dict[str, list[bool]] = {name: [] for name in NAMES}
        for seed in range(asked.first, asked.first + asked.seeds):
            point, estimates = free_peaks(
                omega, beta, seed, asked.share, asked.options, scales=asked.scales, waves=asked.waves
            )
            row = f"{omega:g} {beta:g} seed {seed}: {point['status']}, {point.get('cycles_measured')} cycles"
            for name, each in estimates.items():
                found[name].append(each)
                low, high = (point[f"alpha_2_{name}_{end}"] for end in ("low", "high"))
                if low is not None:
                    inside[name].append(low <= each.truth <= high)
                error = 100.0 * (each.value / each.truth - 1.0)
                row += f", {name} {each.value:.4f} {error:+.2f} % {0.5 * each.e:+.2f} U"
            print(row, flush=True)
        for name, estimates in found.items():
            if estimates:
                stated, worst = Statistics.of(estimates), max(abs(each.value / each.truth - 1.0) for each in estimates)
                print(
                    f"{omega:g} {beta:g} {name}: {stated.n} of {asked.seeds}, worst error {100 * worst:.2f} %, "
                    f"U {100 * stated.relative:.2f} %, rms of e {stated.rms:.2f}, mean {stated.mean:+.2f}, covered "
                    f"{100 * stated.covered:.0f} % ({100 * stated.low:.0f} to {100 * stated.high:.0f}), "
                    f"in {sum(inside[name])} of {len(inside[name])} predicted ranges",
                    flush=True,
                )


if __name__ == "__main__":
    study()
