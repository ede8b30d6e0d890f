"""What is left of each laser's delay against the table's channels, and which setting takes it away."""

from collections.abc import Iterator

import numpy as np

from bench.analysis.check_line import CheckLine, judged, stated
from bench.analysis.gain import COVERAGE
from bench.config.model import BenchConfiguration
from drivers.timebase.common_motion import common_motion
from protocols.check.protocol import CheckParameters
from protocols.check.sines import Sines
from sim.linear import steady_response
from sim.specimen import Specimen

_OWN_LATENCY = "it is the laser's own latency: raise its measuring rate, and take averaging out of it"


def delay_lines(sines: Sines, parameters: CheckParameters, configuration: BenchConfiguration) -> Iterator[CheckLine]:
    """One line for each laser, one for their difference, and the setting that takes the common delay away.

    A delay is positive where the laser says later than the table's displacement what both have seen.
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


def allowed_delay(specimen: Specimen, omega: float, error: float) -> float:
    """The delay [s] of a laser on the ground that moves u1 = laser - x by the share `error` of it, bare frame.

    A small delay d turns the phasor of the laser by omega d, so u1 is off by omega d |u1 + x|. The drift is the
    difference of two lasers: a delay that both have does not change its size.
    """
    u1, _ = steady_response(specimen.bare(), omega, 1.0)
    return error * abs(u1) / (omega * abs(u1 - 1.0 / omega**2))


def _setting(configuration: BenchConfiguration) -> float | None:
    """The delay that is configured [s]; None where there is no such setting."""
    lasers = configuration.hardware.lasers
    return lasers.delay if configuration.backend == "hardware" and lasers.connection == "serial" else None
