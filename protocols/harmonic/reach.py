"""Whether a bench can do what a campaign asks: refused before anything starts, with the value that binds."""

from math import tau

import numpy as np

from bench.analysis.steady import WINDOW
from bench.config.model import BenchConfiguration
from bench.control.candidates import OVERSHOOTS
from protocols.harmonic.parameters import HarmonicParameters
from sim.errors import InvalidInput
from sim.specimen import Specimen


def check_table(parameters: HarmonicParameters, configuration: BenchConfiguration) -> None:
    """Refuse table motions beyond limits or stroke, overshoot of a start included: x = a / Omega^2, v = a / Omega."""
    limits, stroke = configuration.limits, configuration.half_stroke
    peak = max(OVERSHOOTS) * parameters.amplitude_factor * configuration.specimen.uplift_acceleration
    if peak > limits.acceleration:
        allowed = f"a start needs {peak:.3g} m/s2, limits.acceleration = {limits.acceleration:g} m/s2"
        raise InvalidInput("amplitude_factor", parameters.amplitude_factor, allowed)
    reach, owner = min((stroke, "the shaker's stroke"), (limits.displacement, "limits.displacement"))
    for omega in parameters.omega:
        travel, speed = peak / omega**2, peak / omega
        if travel > reach:
            needs = f"a start of {peak:.3g} m/s2 needs {1e3 * travel:.1f} mm there, {owner} allows {1e3 * reach:.1f} mm"
            raise InvalidInput("omega", omega, needs)
        if speed > limits.velocity:
            needs = f"a start of {peak:.3g} m/s2 needs {speed:.3g} m/s there, limits.velocity = {limits.velocity:g} m/s"
            raise InvalidInput("omega", omega, needs)
        if parameters.settle_limit < 2 * WINDOW * tau / omega:
            needs = f"judging a steady state at {omega:g} rad/s takes {2 * WINDOW * tau / omega:.1f} s at least"
            raise InvalidInput("settle_limit", parameters.settle_limit, needs)


def check_storeys(parameters: HarmonicParameters, configuration: BenchConfiguration) -> None:
    """Refuse frequencies at which a storey would leave its laser's range, bare or on the steady rocking motion."""
    specimen = configuration.specimen
    amplitude = parameters.amplitude_factor * specimen.uplift_acceleration
    share = 1.0 if configuration.laser_reference == "ground" else 0.0
    ranges = tuple(0.5 * whole for whole in configuration.laser_ranges)
    for omega in parameters.omega:
        for beta in (None, *parameters.beta):
            if beta is None:
                seen = _bare(specimen, omega, amplitude, share)
            else:
                seen = _rocking(specimen.coupled(beta), omega, amplitude, share)
            if seen is None:
                continue
            for number, (motion, half) in enumerate(zip(seen, ranges, strict=True), 1):
                if motion > half:
                    what = "the bare frame" if beta is None else f"beta = {beta:g}"
                    moves = f"storey {number} of {what} moves {1e3 * motion:.0f} mm there"
                    needs = f"{moves}, its laser sees {1e3 * half:.0f} mm"
                    raise InvalidInput("omega", omega, needs)


def _bare(specimen: Specimen, omega: float, amplitude: float, share: float) -> tuple[float, float]:
    from sim.linear import steady_response

    u1, u2 = steady_response(specimen, omega, amplitude)
    table = -share * amplitude / omega**2
    return abs(u1 + table), abs(u2 + table)


def _rocking(specimen: Specimen, omega: float, amplitude: float, share: float) -> tuple[float, float] | None:
    from sim.steady import NoOrbit, rocking_orbit

    try:
        phase, u1, u2, _ = rocking_orbit(specimen, omega, amplitude).samples(64).T
    except NoOrbit:
        return None
    table = -share * amplitude / omega**2 * np.sin(phase)
    return float(np.abs(u1 + table).max()), float(np.abs(u2 + table).max())
