"""Sensors compared under one common motion: polarity, scale and delay, and which of them is at fault."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from bench.analysis.check_line import CheckLine, judged, stated
from bench.analysis.gain import COVERAGE
from bench.config.model import BenchConfiguration
from drivers.timebase.common_motion import common_motion
from protocols.check.protocol import CheckParameters
from protocols.check.sines import Sines
from sim.linear import steady_response
from sim.specimen import Specimen

Amplitudes = NDArray[np.complex128]

_SIGN = "reverse the sign of {}, or the sensor: it moves against {}"
_SCALE = "see to {} and to what was calibrated: it differs from {}"
_SETTING = {
    "table_displacement": "hardware.table_displacement.sensitivity",
    "table_acceleration": "hardware.table_acceleration.sensitivity",
    "laser_1": "hardware.laser_1.polarity",
    "laser_2": "hardware.laser_2.polarity",
}
_CALIBRATION = {
    "table_displacement": "hardware.table_displacement.sensitivity",
    "table_acceleration": "hardware.table_acceleration.sensitivity",
    "laser_1": "hardware.laser_1.measuring_range and hardware.lasers.load",
    "laser_2": "hardware.laser_2.measuring_range and hardware.lasers.load",
}
_OWN_LATENCY = "it is the laser's own latency: raise its measuring rate, and take averaging out of it"


def scale_lines(sines: Sines, parameters: CheckParameters, *, lasers: bool) -> Iterator[CheckLine]:
    """Two lines for each sensor but the one that the others are compared with.

    That is the table's displacement, unless the accelerometer contradicts it and the lasers side with the
    accelerometer. With `lasers` they are compared too: they stand on the ground.
    """
    seen = {"table_displacement": sines.displacement, "table_acceleration": sines.accelerometer}
    if lasers:
        seen |= {"laser_1": sines.laser_1, "laser_2": sines.laser_2}
    reference = _reference(sines.omega, seen, parameters.scale_tolerance)
    for name, amplitudes in seen.items():
        if name != reference:
            yield from _compared(name, reference, sines.omega, amplitudes, seen[reference], parameters.scale_tolerance)
    if lasers:
        yield _differential(sines, parameters.scale_tolerance)


def delay_lines(sines: Sines, parameters: CheckParameters, configuration: BenchConfiguration) -> Iterator[CheckLine]:
    """One line for each laser, one for their difference, and the setting that takes the common delay away.

    A delay is positive where the laser lags behind the table's displacement.
    """
    most = allowed_delay(configuration.known_specimen, parameters.highest_omega, parameters.u1_error)
    setting = _setting(configuration)
    found: list[tuple[float, float]] = []
    for name, amplitudes in (("laser_1", sines.laser_1), ("laser_2", sines.laser_2)):
        # the cycles' amplitudes turn with exp(-i omega t)
        motion = common_motion(sines.omega, sines.displacement.conj(), amplitudes.conj())
        found.append((motion.delay, motion.uncertainty))
        remedy = _OWN_LATENCY if setting is None else "set hardware.lasers.delay as the last line says"
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
    (first, u_1), (second, u_2) = found
    between = COVERAGE * configuration.analysis.laser_timing
    yield judged(
        "lasers",
        "delay of laser_2 against laser_1",
        second - first,
        (-between, between),
        "s",
        "set both lasers to the same rate, averaging and output; see that neither loses values",
        expected=0.0,
        uncertainty=COVERAGE * float(np.hypot(u_1, u_2)),
    )
    if setting is not None:
        value, doubt = setting - 0.5 * (first + second), 0.5 * COVERAGE * float(np.hypot(u_1, u_2))
        yield stated("lasers", "right value of hardware.lasers.delay", value, "s", uncertainty=doubt)


def signed_scale(omega: NDArray[np.float64], amplitudes: Amplitudes, reference: Amplitudes) -> tuple[float, float]:
    """Scale of a sensor over that of another, negative where it moves the other way, and its standard uncertainty.

    The magnitude is extrapolated to frequency zero with a term in omega^2: a clamp yields, and its load then moves
    by (omega / omega_clamp)^2 more than the table.
    """
    ratio = amplitudes / reference
    basis = np.column_stack((np.ones(omega.size), omega**2))
    magnitude = np.abs(ratio)
    covariance = np.linalg.inv(basis.T @ basis)
    solution = covariance @ (basis.T @ magnitude)
    residual = magnitude - basis @ solution
    spread = float(residual @ residual) / (omega.size - 2)
    # a delay turns the ratio by less than a right angle at the lowest frequency
    sign = 1.0 if ratio[np.argmin(omega)].real >= 0.0 else -1.0
    return sign * float(solution[0]), float(np.sqrt(spread * covariance[0, 0]))


def allowed_delay(specimen: Specimen, omega: float, error: float) -> float:
    """The delay [s] of a laser on the ground that moves u1 = laser - x by the share `error` of it, bare frame.

    A small delay d turns the phasor of the laser by omega d, so u1 is off by omega d |u1 + x|. The drift is the
    difference of two lasers: a delay that both have does not change its size.
    """
    u1, _ = steady_response(specimen.bare(), omega, 1.0)
    return error * abs(u1) / (omega * abs(u1 - 1.0 / omega**2))


def _reference(omega: NDArray[np.float64], seen: dict[str, Amplitudes], tolerance: float) -> str:
    table, other = "table_displacement", "table_acceleration"
    scale, _ = signed_scale(omega, seen[other], seen[table])
    lasers = [signed_scale(omega, seen[name], seen[table])[0] for name in ("laser_1", "laser_2") if name in seen]
    if abs(scale - 1.0) <= tolerance or not lasers:
        return table
    middle = float(np.mean(lasers))
    return other if abs(middle - scale) < abs(middle - 1.0) else table


def _compared(
    name: str, reference: str, omega: NDArray[np.float64], amplitudes: Amplitudes, first: Amplitudes, tolerance: float
) -> Iterator[CheckLine]:
    scale, uncertainty = signed_scale(omega, amplitudes, first)
    sign = 1.0 if scale > 0.0 else -1.0
    remedy = _SIGN.format(_SETTING[name], reference)
    yield judged(name, f"polarity against {reference}", sign, (1.0, 1.0), "1", remedy, expected=1.0)
    yield judged(
        name,
        f"scale against {reference}",
        abs(scale),
        (1.0 - tolerance, 1.0 + tolerance),
        "1",
        _SCALE.format(_CALIBRATION[name], reference),
        expected=1.0,
        uncertainty=COVERAGE * uncertainty,
    )


def _differential(sines: Sines, tolerance: float) -> CheckLine:
    scale, uncertainty = signed_scale(sines.omega, sines.laser_2, sines.laser_1)
    return judged(
        "lasers",
        "scale of laser_2 against laser_1",
        abs(scale),
        (1.0 - tolerance, 1.0 + tolerance),
        "1",
        "the drift is their difference: see to the measuring range and the load of the one whose own scale is off",
        expected=1.0,
        uncertainty=COVERAGE * uncertainty,
    )


def _setting(configuration: BenchConfiguration) -> float | None:
    """The delay that is configured [s]; None where there is no such setting."""
    lasers = configuration.hardware.lasers
    return lasers.delay if configuration.backend == "hardware" and lasers.connection == "serial" else None
