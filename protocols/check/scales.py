"""Polarity and scale: four sensors see one motion, and one that says another thing is named."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from bench.analysis.check_line import CheckLine, judged
from protocols.check.protocol import CheckParameters
from protocols.check.sines import Sines

Amplitudes = NDArray[np.complex128]

COVERAGE = 2.0
"""Coverage factor k of the stated uncertainties."""

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


def scale_lines(sines: Sines, parameters: CheckParameters, *, lasers: bool) -> Iterator[CheckLine]:
    """Two lines for each sensor but the one that the others are compared with.

    That is the table's displacement, unless the accelerometer contradicts it and the lasers side with the
    accelerometer. `lasers` says whether they see the table's motion.
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


def signed_scale(omega: NDArray[np.float64], amplitudes: Amplitudes, reference: Amplitudes) -> tuple[float, float]:
    """Scale of a sensor over that of another, negative where it moves the other way, and its standard uncertainty.

    The magnitude is extrapolated to frequency zero with a term in omega^2: a clamp gives way a little, and what it
    carries then moves by (omega / omega_clamp)^2 more than the table.
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
