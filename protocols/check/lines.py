"""Lines of the loop check for the bench at rest and for the drive."""

from collections.abc import Iterator, Sequence
from math import isinf

import numpy as np
from numpy.typing import NDArray

from bench.analysis.check_line import CheckLine, judged, passed, stated, untested
from bench.analysis.cycles import COMPLETE
from bench.analysis.gain import COVERAGE, SensorAccuracy
from bench.config.model import BenchConfiguration
from bench.engine.steps import RestSamples
from drivers.rig import Alignment, Channel, Counts
from drivers.timebase.marking import expected_uncertainty
from protocols.check.protocol import CheckParameters
from protocols.check.sines import Sines
from protocols.common.missing import cause
from sim.channel import STOREYS, TABLE_ACCELERATION, TABLE_DISPLACEMENT

_STUCK = 0.01
"""Standard deviation [counts] below which a channel is considered stuck; 0.01 results if one sample in ten thousand
differs by one count.
"""

_FINEST = 1e-5
"""Step of the search for the dead time [s]."""

_UNKNOWN = "the delay of this input module is unknown: compare the delay lines, or use a supported module"
_MISSING = "the program does not read this input: make sure that its contact opens the enable chain directly"
_ALONE = "nothing opens the enable relay if the program crashes: wire a heartbeat relay, or set a watchdog"


def resting_lines(samples: RestSamples, parameters: CheckParameters, accuracy: SensorAccuracy) -> Iterator[CheckLine]:
    """One or two lines for each channel: the fraction of valid samples and, if enough samples are valid, the noise. The
    noise of a laser may be as large as its resolution; larger noise originates in the target or the bench.
    """
    limits = {
        TABLE_DISPLACEMENT: parameters.displacement_noise,
        TABLE_ACCELERATION: parameters.acceleration_noise,
        **dict.fromkeys(STOREYS, accuracy.laser_resolution),
    }
    for column, channel in enumerate(samples.channels):
        counts = samples.counts[:, column]
        valid = (counts >= channel.valid[0]) & (counts <= channel.valid[1])
        share = float(valid.mean())
        what = "valid samples at rest"
        yield judged(channel.name, what, share, (COMPLETE, 1.0), "1", _reason(channel, counts[~valid]), expected=1.0)
        if share >= COMPLETE:
            yield _noise(channel, counts[valid], limits.get(channel.name))


def safety_lines(configuration: BenchConfiguration) -> Iterator[CheckLine]:
    """Lines that follow the acquisition at rest: one for each safety input, and one if there is neither a watchdog nor
    a heartbeat relay; none for a simulated bench.

    Inputs that are read have passed, since an open input would have prevented arming or ended the check; missing inputs
    are untested.
    """
    if configuration.backend != "hardware":
        return
    daq = configuration.hardware.daq
    for name, given in daq.safety_inputs.items():
        yield passed(name, f"{given.line} was {given.good}: good")
    for name in daq.missing_inputs:
        yield untested(name, "safety input", _MISSING)
    if daq.watchdog is None and daq.heartbeat is None:
        yield untested("enable line", "heartbeat or watchdog", _ALONE)


def input_lines(channels: Sequence[Channel]) -> Iterator[CheckLine]:
    """A line for each input whose delay is unknown or was removed from its samples."""
    for channel in channels:
        if isinf(channel.delay_uncertainty):
            yield untested(channel.name, "input delay", _UNKNOWN)
        elif channel.delay:
            what = "removed input delay"
            yield stated(channel.name, what, channel.delay, "s", uncertainty=COVERAGE * channel.delay_uncertainty)


def alignment_lines(alignments: Sequence[Alignment], configuration: BenchConfiguration) -> Iterator[CheckLine]:
    """Two lines for each sensor with its own clock: accuracy of the alignment of the clocks, and the delay added to the
    times of its values.
    """
    expected = expected_uncertainty(configuration.hardware.lasers.rate)
    for one in alignments:
        if isinf(one.mark_uncertainty):
            what = "alignment from arrival times, rms residual of the readings"
            yield stated(one.sensor, what, one.residual, "s")
        else:
            what = "alignment by pulses of the counter, standard uncertainty"
            yield stated(one.sensor, what, one.mark_uncertainty, "s", expected=expected)
        yield stated(one.sensor, "delay added to its times", one.delay, "s")


def drive_lines(sines: Sines, parameters: CheckParameters, configuration: BenchConfiguration) -> Iterator[CheckLine]:
    """Lines for the dead time and for the drive at each frequency, which has limits if the shaker is simulated."""
    yield judged(
        "drive",
        "dead time to table_acceleration",
        dead_time(sines.omega, sines.drive, sines.acceleration, parameters.latency),
        (0.0, parameters.latency),
        "s",
        "inputs and output do not share clock and trigger, or the input delay is unknown: see hardware.daq "
        "and the input delays, which the report lists with the bench",
    )
    expected = expected_drive(sines.omega, configuration)
    for index, omega in enumerate(sines.omega):
        what = f"volts per m/s2 at {omega:g} rad/s"
        measured = float(abs(sines.drive[index] / sines.acceleration[index]))
        if expected is None:
            yield stated("drive", what, measured, "V s2/m")
            continue
        usual, spread = float(expected[index]), parameters.drive_tolerance
        remedy = "check the amplifier's gain, the moving mass, and the accelerometer's calibration"
        allowed = usual * (1.0 - spread), usual * (1.0 + spread)
        yield judged("drive", what, measured, allowed, "V s2/m", remedy, expected=usual)


def expected_drive(omega: NDArray[np.float64], configuration: BenchConfiguration) -> NDArray[np.float64] | None:
    """Drive per acceleration [V s2/m] of the simulated shaker, shape (n,); None for a real shaker."""
    if configuration.backend != "simulated":
        return None
    specimen = configuration.simulation.specimen or configuration.specimen
    response = configuration.simulation.bench.shaker.frequency_response(omega, specimen.bare().mass)
    return 1.0 / np.abs(response)


def dead_time(
    omega: NDArray[np.float64], drive: NDArray[np.complex128], acceleration: NDArray[np.complex128], longest: float
) -> float:
    """Signed delay [s] between drive and motion not explained by mass, dashpot and spring, of at most twice `longest`
    [s].

    drive / acceleration = exp(s T) (m + c / s + k / s^2) / G with s = i omega. For each T, the quotients m / G, c / G
    and k / G are fitted by linear least squares; the result is the T with the smallest residual. It includes the delays
    of the inputs' filters and of the amplifier, and half a sample.
    """
    # the amplitudes of the cycles are for exp(-i omega t)
    wanted = np.conj(drive / acceleration)
    s = 1j * omega
    magnitude = np.abs(wanted)
    basis = np.column_stack((s**0, 1.0 / s, 1.0 / s**2)) / magnitude[:, None]
    tried = np.arange(-2.0 * longest, 2.0 * longest, _FINEST)
    # exp(s T) only rotates each row: the right-hand side is rotated back, so that one matrix serves all T
    turned = (wanted / magnitude)[:, None] * np.exp(-s[:, None] * tried)
    rows, aims = np.concatenate((basis.real, basis.imag)), np.concatenate((turned.real, turned.imag))
    solutions, *_ = np.linalg.lstsq(rows, aims, rcond=None)
    residuals = np.sum((aims - rows @ solutions) ** 2, axis=0)
    return float(tried[int(np.argmin(residuals))])


def _noise(channel: Channel, counts: Counts, limit: float | None) -> CheckLine:
    noise, least = float(np.std(channel.to_unit(counts))), _STUCK * abs(channel.scale)
    if limit is None and noise >= least:
        return stated(channel.name, "noise at rest", noise, channel.unit)
    if noise < least:
        remedy = "the reading is constant: check connection and power of the sensor, and its terminal or port"
    else:
        remedy = "let the bench come to rest, then check cable, shield and ground, and the sensor's target"
    allowed = least, np.inf if limit is None else limit
    return judged(channel.name, "noise at rest", noise, allowed, channel.unit, remedy)


def _reason(channel: Channel, invalid: Counts) -> str:
    """Cause of invalid samples, from the most frequent invalid count, with a remedy; empty if all are valid."""
    if invalid.size == 0:
        return ""
    values, numbers = np.unique(invalid, return_counts=True)
    return cause(channel, int(values[numbers.argmax()]), at_rest=True)
