"""Which tests are prolonged because of the remaining transient of their motion."""

from dataclasses import replace

from bench.analysis.gain import SteadyPeak, steady_peak
from bench.analysis.running_gain import RunningGain, shared_draws
from bench.analysis.sensor_accuracy import SensorAccuracy
from bench.analysis.sensor_uncertainty import SensorUncertainty
from protocols.common.sine.pace import Pace
from protocols.harmonic.running import NEGLIGIBLE, SHARE, RunningPoint
from tests.bench.calibrated import calibration
from tests.protocols.harmonic.scripted import cycle

OMEGA = 16.0
CALIBRATED = SensorUncertainty(SensorAccuracy(), (0.2, 0.2), calibration(-0.05, 0.05))
FROM_THE_DATA_SHEET = SensorUncertainty(SensorAccuracy(), (0.2, 0.2))


def peak(drift: float, transient: float) -> SteadyPeak:
    """Peak drift [m], with the standard uncertainty relative to it due to a transient."""
    found = steady_peak([cycle(k, drift) for k in range(24)], OMEGA)
    return replace(found, transient=transient * drift)


def running(sensors: SensorUncertainty) -> tuple[RunningPoint, RunningGain]:
    gain = RunningGain(peak(0.01, 0.0), sensors, shared_draws())
    return RunningPoint(OMEGA, 0.4, gain, 0.5, Pace((OMEGA,), 2)), gain


def test_a_test_is_prolonged_if_the_transient_widens_the_interval_of_a_calibrated_bench() -> None:
    point, gain = running(CALIBRATED)
    without = gain.of(peak(0.005, 0.0))
    others = {name: part for name, part in without.budget.parts.items() if name != "steps of the lasers"}
    relative = SHARE * sum(part**2 for part in others.values()) ** 0.5 / without.alpha_2
    assert relative > NEGLIGIBLE
    assert point.worth_waiting(peak(0.005, 1.05 * relative))
    assert not point.worth_waiting(peak(0.005, 0.95 * relative))


def test_a_transient_below_the_uncertainties_of_the_data_sheet_prolongs_no_test() -> None:
    transient = 0.003
    assert running(CALIBRATED)[0].worth_waiting(peak(0.005, transient))
    assert not running(FROM_THE_DATA_SHEET)[0].worth_waiting(peak(0.005, transient))


def test_neither_a_negligible_transient_nor_the_bare_frame_prolongs_a_test() -> None:
    assert not running(CALIBRATED)[0].worth_waiting(peak(0.005, 0.9 * NEGLIGIBLE))
    bare = RunningPoint(OMEGA, None, None, float("nan"), Pace((OMEGA,), 2))
    assert not bare.worth_waiting(peak(0.01, 0.1))
