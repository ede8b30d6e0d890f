"""What a programme of sines asks of the table and its shaker, from the envelope: quasi-steady, x = a / Omega^2."""

import numpy as np
from numpy.typing import NDArray

from bench.guard.quantities import Mover
from bench.preflight.response import TableResponse
from sim.excitation import SineProgram

Array = NDArray[np.float64]

STEP = 0.05
"""Distance of the times at which the envelope is looked at [s]."""


def envelope(program: SineProgram, times: Array) -> tuple[Array, Array, Array]:
    """Amplitude [m/s2], circular frequency [rad/s] and phase [rad] of `program` at `times` [s], same shape."""
    amplitude, omega, phase = (np.empty_like(times) for _ in range(3))
    begin, turned = 0.0, program.phase
    for sweep in program.sweeps:
        here = times >= begin
        since = times[here] - begin
        amplitude[here], omega[here] = sweep.amplitude_at(since), sweep.omega_at(since)
        phase[here] = turned + sweep.phase_at(since)
        begin += sweep.duration
        turned += float(sweep.phase_at(np.array(sweep.duration)))
    return amplitude, omega, phase


def load(
    program: SineProgram,
    begin: float,
    held: float,
    *,
    payload: float,
    mover: Mover | None,
    response: TableResponse | None,
    heating_time: float,
) -> dict[str, float]:
    """The largest value of each quantity of table and shaker from `begin` [s] on; absent where it is not known.

    The heating is that at the end of the last sine held for `held` [s] if that is its largest, `heating_time` [s]
    being the time constant; it begins at zero, as the guard's does when it is armed.
    """
    times = np.arange(0.0, program.duration, STEP)
    amplitude, omega, _ = envelope(program, times)
    counted = times >= begin
    a, w = amplitude[counted], omega[counted]
    found = {
        "displacement": float(np.max(a / w**2)),
        "velocity": float(np.max(a / w)),
        "acceleration": float(np.max(a)),
    }
    if mover is not None:
        current = np.abs(mover.mass - mover.stiffness / omega**2) * amplitude / mover.force_constant
        found |= {"force": mover.mass * found["acceleration"], "current": float(np.max(current[counted]))}
        found["heating"] = _heating(current, held, heating_time)
    if response is not None:
        drive = a / response.gain(w, payload) + response.friction * (a > 0.0)
        found |= {"drive_voltage": float(np.max(drive)), "drive_slew": float(np.max(drive * w))}
    return found


def _heating(current: Array, held: float, time: float) -> float:
    """Largest root of the exponential mean of current^2 / 2, the last amplitude being held on."""
    from scipy import signal

    power, forget = 0.5 * current**2, np.exp(-STEP / time)
    mean = np.asarray(signal.lfilter([1.0 - forget], [1.0, -forget], power))
    end = power[-1] + (mean[-1] - power[-1]) * np.exp(-held / time)
    return float(np.sqrt(max(float(mean.max()), float(end))))
