"""Corrections of the drive while a motion settles, on scripted cycles."""

from collections.abc import Callable, Generator
from math import cos, sin, tau

import pytest

from bench.analysis.cycles import Cycle
from bench.analysis.gain import SteadyPeak
from bench.analysis.signals import ACCELERATION
from bench.analysis.steady import WINDOW
from bench.config.model import BenchConfiguration
from bench.control.oscillator import DriveCalibration
from bench.control.sine import Sine
from bench.engine.steps import Done, Dwell, Measured, Outcome, SetHarmonics, Step
from protocols.common.sine.settling import AIM, MOST, Settled, Waiting, settle_and_measure
from protocols.harmonic.protocol import HarmonicParameters
from tests.made_cycles import pure_cycle
from tests.protocols.harmonic.scripted import AMPLITUDE, cycle

OMEGA, DRIFT = 16.0, 0.004
PERIOD = tau / OMEGA
DRIVE = 6
"""Column of the drive in a cycle."""

Motion = Callable[[int], tuple[float, float]]


def modulated(k: int) -> tuple[float, float]:
    """Peak drift of cycle `k`, and the disturbance of the table's fundamental relative to its amplitude."""
    return DRIFT * (1.0 + 0.3 * sin(2.4 * k)), 0.02 * cos(2.4 * k)


def settled(
    motion: Motion, limit: float, free_cycles: int, waiting: Waiting | None = None
) -> tuple[Settled, list[int]]:
    """Result of a dwell, and the numbers of cycles after which the drive was corrected."""

    def report(_: list[Cycle]) -> Generator[Step, Outcome, None]:
        yield from ()

    def moved(k: int, share: complex) -> Cycle:
        drift, disturbance = motion(k)
        amplitudes = cycle(k, drift).fundamental.copy()
        amplitudes[ACCELERATION], amplitudes[DRIVE] = AMPLITUDE * (share + disturbance), share
        return pure_cycle(k, amplitudes, samples=700)

    parameters = HarmonicParameters(settle_limit=limit)
    sine = Sine(OMEGA, AMPLITUDE, DriveCalibration.flat(AMPLITUDE))
    analysis = BenchConfiguration().analysis
    steps = settle_and_measure(sine, parameters, analysis, report, free_cycles=free_cycles, waiting=waiting)
    share, done, corrected = 1.0 + 0.0j, 0, list[int]()
    outcome: Outcome | None = None
    try:
        while True:
            match steps.send(outcome) if outcome is not None else next(steps):
                case SetHarmonics(shares=shares):
                    share = shares[0]
                    corrected.append(done)
                    outcome = Done()
                case Dwell(cycles=n):
                    outcome = Measured(tuple(moved(done + k, share) for k in range(n)))
                    done += n
                case other:
                    pytest.fail(f"unexpected step {other}")
    except StopIteration as end:
        result = end.value
    assert isinstance(result, Settled)
    return result, corrected


@pytest.mark.parametrize(("free_cycles", "last"), [(0, 60.0), (48, 60.0 - 48 * PERIOD), (1000, 30.0)])
def test_the_drive_of_a_motion_that_is_not_steady_is_constant_before_the_limit(free_cycles: int, last: float) -> None:
    """At most for half of the limit."""
    found, corrected = settled(modulated, 60.0, free_cycles)
    assert not found.steadiness.steady
    assert found.time >= 60.0
    assert last - 8 * PERIOD < corrected[-1] * PERIOD < last
    assert found.motion is not None
    # all cycles since the last correction, without its transient
    assert found.motion.peaks.mean.cycles == min(round(found.time / PERIOD) - corrected[-1] - 2, 96)


def test_a_motion_that_becomes_steady_late_is_corrected_with_full_steps() -> None:
    change = 155

    def late(k: int) -> tuple[float, float]:
        return modulated(k) if k < change else (DRIFT, 0.01)

    limit, free_cycles = 120.0, 180
    assert change * PERIOD > max(limit - free_cycles * PERIOD, 0.5 * limit)
    found, corrected = settled(late, limit, free_cycles)
    assert found.steadiness.steady
    assert found.time < limit
    assert len([k for k in corrected if k > change]) in {1, 2, 3, 4}
    assert abs(found.amplitude_error) <= AIM * HarmonicParameters().amplitude_tolerance


def slow(k: int) -> tuple[float, float]:
    """A motion that approaches its steady state by 2 % per cycle."""
    return DRIFT * (1.0 + 0.2 * 0.98**k), 0.0


def test_a_steady_motion_is_measured_again_while_its_transient_is_worth_the_wait() -> None:
    least = 2e-4 * DRIFT
    at_once, _ = settled(slow, 240.0, 0)
    assert at_once.peak.transient > least
    patient, _ = settled(slow, 240.0, 0, lambda peak: peak.transient > least)
    assert patient.steadiness.steady
    assert patient.peak.transient <= least
    assert patient.time > at_once.time
    assert abs(patient.peak.drift - DRIFT) < abs(at_once.peak.drift - DRIFT)


@pytest.mark.parametrize("spare", [None, 12.0])
def test_the_wait_ends_after_several_measurements_or_at_the_limit(spare: float | None) -> None:
    measured = max(HarmonicParameters().measured_cycles, 2 * WINDOW)
    asked = list[SteadyPeak]()

    def never_enough(peak: SteadyPeak) -> bool:
        asked.append(peak)
        return True

    at_once, _ = settled(slow, 240.0, 0)
    limit = 240.0 if spare is None else at_once.time + spare
    found, _ = settled(slow, limit, 0, never_enough)
    assert found.steadiness.steady
    if spare is None:
        assert len(asked) == MOST - 1
        assert found.time < limit
    else:
        assert 0 < len(asked) < MOST - 1
        # a measurement may begin just before the limit, and one follows it
        assert limit <= found.time <= limit + 2 * measured * PERIOD
