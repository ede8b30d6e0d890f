"""Lines of the loop check that compare the sensors under a common motion."""

from collections.abc import Iterator
from dataclasses import dataclass
from math import inf, isinf

import numpy as np
from numpy.typing import NDArray

from bench.analysis.check_line import CheckLine, judged, stated
from bench.analysis.gain import COVERAGE
from bench.analysis.uncertainty import student_factor
from bench.config.model import BenchConfiguration
from protocols.check.protocol import CheckParameters
from protocols.check.sines import STOREY_SIGNALS, Amplitudes, LaserDelays, Sines, delay_between
from sim.channel import STOREYS, TABLE_ACCELERATION, TABLE_DISPLACEMENT
from sim.linear import steady_response
from sim.specimen import Specimen


@dataclass(frozen=True)
class Sensor:
    """A compared sensor: field of its amplitudes in `Sines`, and configuration keys of its polarity and scale."""

    signal: str
    polarity: str
    scale: str


TABLE = {
    name: Sensor(signal, f"hardware.{name}.sensitivity", f"hardware.{name}.sensitivity")
    for name, signal in ((TABLE_DISPLACEMENT, "displacement"), (TABLE_ACCELERATION, "accelerometer"))
}

LASERS = {
    name: Sensor(
        signal,
        f"hardware.{name}.polarity",
        f"hardware.{name}.measuring_range (on the analogue output also hardware.lasers.load)",
    )
    for name, signal in zip(STOREYS, STOREY_SIGNALS, strict=True)
}

SENSORS = TABLE | LASERS

_SIGN = "reverse the sign of {}, or the sensor: its signal is opposite to {}"

_SCALE = "check {} and the calibration: the scale differs from that of {}"

_OWN_LATENCY = "the laser's internal latency is too long: raise its measuring rate, and disable its averaging"

_AHEAD = (
    "the laser is ahead of the table's sensor, whose input is late: check the input delays, which the report lists "
    "with the bench"
)

_UNEQUAL = "the lasers differ in delay: set both to the same rate, averaging and output, then repeat the check"

_TABLE_FIRST = (
    "the table's sensors differ in delay, so that the laser's delay is unknown: correct the delay of "
    f"{TABLE_ACCELERATION} against {TABLE_DISPLACEMENT}, then repeat the check"
)

_SKEW = (
    "the two sensors show the same motion at different times: connect both to inputs of one module, or "
    "check the input delays, which the report lists with the bench"
)


def table_delay_lines(
    sines: Sines,
    parameters: CheckParameters,
    sample_rate: float,
    *,
    lasers: LaserDelays | None = None,
    most: float = inf,
) -> Iterator[CheckLine]:
    """Lines for the delay of the accelerometer against the table's displacement sensor and, for `lasers` on the ground,
    of each laser against the accelerometer, from `laser_delays`; the latter has limits if `most` [s], its largest
    magnitude, is finite. Together with `delay_lines`, every pair of these channels is compared.

    The limits include half a sample: the lag of an acceleration that follows each step of the zero-order-hold output.
    """
    if parameters.delay_tolerance is None:
        return
    pair = delay_between(sines.omega, sines.displacement, sines.accelerometer)
    against = {} if lasers is None else dict(zip(STOREYS, (lasers.first, lasers.second), strict=True))
    middle = float(np.mean([one.delay for one in against.values()])) if against else np.nan
    # the lasers lag behind the correct sensor only by their latency, so the sensor nearer to them is assumed correct
    alone = TABLE_ACCELERATION if abs(middle + pair.delay) < abs(middle) else TABLE_DISPLACEMENT
    odd = f"{alone} differs from the lasers: " if against else ""
    yield judged(
        TABLE_ACCELERATION,
        f"delay against {TABLE_DISPLACEMENT}",
        pair.delay,
        _allowed_of_table(parameters.delay_tolerance, sample_rate),
        "s",
        f"{odd}{_SKEW}",
        expected=0.0,
        uncertainty=COVERAGE * pair.uncertainty,
    )
    for name, one in against.items():
        what, expanded = f"delay against {TABLE_ACCELERATION}", COVERAGE * one.uncertainty
        if isinf(most):
            yield stated(name, what, one.delay, "s", uncertainty=expanded)
            continue
        allowed = -most - 0.5 / sample_rate, most
        remedy = "compare the other delay lines, which show whether the accelerometer or this laser differs"
        yield judged(name, what, one.delay, allowed, "s", remedy, expected=0.0, uncertainty=expanded)


def _allowed_of_table(tolerance: float, sample_rate: float) -> tuple[float, float]:
    """Limits [s] of the delay of the accelerometer against the table's displacement sensor."""
    return -tolerance, tolerance + 0.5 / sample_rate


def scale_lines(sines: Sines, parameters: CheckParameters, *, lasers: bool) -> Iterator[CheckLine]:
    """Lines for polarity and scale of each sensor against the reference and, with `lasers` on the ground, for the scale
    of one laser against the other.

    The reference is the table's displacement sensor, or the accelerometer if the two differ and the lasers agree with
    the accelerometer.
    """
    sensors = SENSORS if lasers else TABLE
    seen: dict[str, Amplitudes] = {name: getattr(sines, sensor.signal) for name, sensor in sensors.items()}
    tolerance = parameters.scale_tolerance
    allowed = 1.0 - tolerance, 1.0 + tolerance
    reference = _reference(sines.omega, seen, tolerance)
    for name in seen:
        if name == reference:
            continue
        scale, uncertainty = signed_scale(sines.omega, seen[name], seen[reference])
        sign = 1.0 if scale > 0.0 else -1.0
        remedy = _SIGN.format(SENSORS[name].polarity, reference)
        yield judged(name, f"polarity against {reference}", sign, (1.0, 1.0), "1", remedy, expected=1.0)
        remedy, expanded = _SCALE.format(SENSORS[name].scale, reference), COVERAGE * uncertainty
        what = f"scale against {reference}"
        yield judged(name, what, abs(scale), allowed, "1", remedy, expected=1.0, uncertainty=expanded)
    if lasers:
        scale, uncertainty = signed_scale(sines.omega, sines.storey_2, sines.storey_1)
        yield judged(
            "lasers",
            f"scale of {STOREYS[1]} against {STOREYS[0]}",
            abs(scale),
            allowed,
            "1",
            "the drift is the difference between the lasers: check the measuring range and, on the analogue "
            "output, the load resistor of the laser with the wrong scale",
            expected=1.0,
            uncertainty=COVERAGE * uncertainty,
        )


def delay_lines(
    sines: Sines, lasers: LaserDelays, parameters: CheckParameters, configuration: BenchConfiguration
) -> Iterator[CheckLine]:
    """Lines for the delay of each laser against the table's displacement sensor, from `laser_delays`, and for the
    difference of the delays; for serial lasers of a real bench, also
    the value of the setting that compensates the mean delay, unless the table's sensors contradict each other.

    A delay is positive if the laser lags behind the table's displacement.
    """
    most = allowed_delay(configuration.known_specimen, parameters.highest_omega, parameters.u1_error)
    hardware = configuration.hardware.lasers
    settable = configuration.backend == "hardware" and hardware.connection == "serial"
    between = COVERAGE * configuration.analysis.laser_timing
    differs = _table_differs(sines, parameters, configuration.sample_rate)
    for name, motion in zip(STOREYS, (lasers.first, lasers.second), strict=True):
        if differs:
            remedy = _TABLE_FIRST
        elif settable:
            unequal = abs(lasers.difference) > between
            remedy = _UNEQUAL if unequal else "set hardware.lasers.delay to the value in the last line"
        else:
            remedy = _OWN_LATENCY if motion.delay > 0.0 else _AHEAD
        yield judged(
            name,
            "delay against table_displacement",
            motion.delay,
            (-most, most),
            "s",
            remedy,
            expected=0.0,
            uncertainty=COVERAGE * motion.uncertainty,
        )
    yield judged(
        "lasers",
        f"delay of {STOREYS[1]} against {STOREYS[0]}",
        lasers.difference,
        (-between, between),
        "s",
        "set both lasers to the same rate, averaging and output; check that neither of them loses values",
        expected=0.0,
        uncertainty=COVERAGE * lasers.uncertainty,
    )
    if settable and not differs:
        value = hardware.delay - 0.5 * (lasers.first.delay + lasers.second.delay)
        # the noise of the table's sensor is in both: they may be wholly correlated
        expanded = 0.5 * COVERAGE * (lasers.first.uncertainty + lasers.second.uncertainty)
        yield stated("lasers", "correct value of hardware.lasers.delay", value, "s", uncertainty=expanded)


def _table_differs(sines: Sines, parameters: CheckParameters, sample_rate: float) -> bool:
    """Whether the table's sensors differ in delay; False if their delays are not compared."""
    if parameters.delay_tolerance is None:
        return False
    lowest, highest = _allowed_of_table(parameters.delay_tolerance, sample_rate)
    return not lowest <= delay_between(sines.omega, sines.displacement, sines.accelerometer).delay <= highest


def signed_scale(omega: NDArray[np.float64], amplitudes: Amplitudes, reference: Amplitudes) -> tuple[float, float]:
    """Scale of one sensor relative to another, negative for opposite polarity, and its standard uncertainty, with
    Student's t.

    The magnitude is extrapolated to zero frequency with a term in omega^2: a mass on a compliant clamp moves more than
    the table, by the fraction (omega / omega_clamp)^2.
    """
    ratio = amplitudes / reference
    basis = np.column_stack((np.ones(omega.size), omega**2))
    magnitude = np.abs(ratio)
    covariance = np.linalg.inv(basis.T @ basis)
    solution = covariance @ (basis.T @ magnitude)
    residual = magnitude - basis @ solution
    spread = float(residual @ residual) / (omega.size - 2)
    # at the lowest frequency, delays rotate the ratio by less than a right angle
    sign = 1.0 if ratio[np.argmin(omega)].real >= 0.0 else -1.0
    # two parameters are fitted
    return sign * float(solution[0]), student_factor(omega.size - 1) * float(np.sqrt(spread * covariance[0, 0]))


def allowed_delay(specimen: Specimen, omega: float, error: float) -> float:
    """Delay [s] of a laser on the ground that changes u1 = laser - x of the bare frame by the relative `error`.

    A small delay d rotates the phasor of the laser by omega d, so the error of u1 is omega d |u1 + x|. The drift is the
    difference between two lasers, so a common delay does not change its amplitude.
    """
    u1, _ = steady_response(specimen.bare(), omega, 1.0)
    return error * abs(u1) / (omega * abs(u1 - 1.0 / omega**2))


def _reference(omega: NDArray[np.float64], seen: dict[str, Amplitudes], tolerance: float) -> str:
    table, other = TABLE_DISPLACEMENT, TABLE_ACCELERATION
    scale, _ = signed_scale(omega, seen[other], seen[table])
    lasers = [signed_scale(omega, seen[name], seen[table])[0] for name in STOREYS if name in seen]
    if abs(scale - 1.0) <= tolerance or not lasers:
        return table
    middle = float(np.mean(lasers))
    return other if abs(middle - scale) < abs(middle - 1.0) else table
