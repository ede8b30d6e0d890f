"""Whether a bench can do what a campaign asks, as far as closed forms and steady states tell.

These refusals come at once and name the parameter; `protocols.harmonic.preflight` has the whole run, starts included.
"""

from functools import lru_cache
from math import tau
from typing import Literal

import numpy as np

from bench.analysis.steady import WINDOW
from bench.config.model import BenchConfiguration
from bench.control.candidates import OVERSHOOTS
from bench.preflight.motion import Travel
from protocols.harmonic.parameters import HarmonicParameters
from sim.errors import InvalidInput
from sim.specimen import Specimen

Reference = Literal["ground", "table"]
"""Where the lasers stand."""


def check_table(parameters: HarmonicParameters, configuration: BenchConfiguration) -> None:
    """Refuse table motions beyond limits or stroke, overshoot of a start included: x = a / Omega^2, v = a / Omega."""
    limits, stroke = configuration.limits, configuration.half_stroke
    peak = max(OVERSHOOTS) * parameters.amplitude_factor * configuration.known_specimen.uplift_acceleration
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
    specimen = configuration.known_specimen
    amplitude = parameters.amplitude_factor * specimen.uplift_acceleration
    reference = configuration.laser_reference
    ranges = tuple(0.5 * whole for whole in configuration.laser_ranges)
    for omega in parameters.omega:
        for beta in (None, *parameters.beta):
            if beta is None:
                seen = bare_travel(specimen, omega, amplitude, reference)
            else:
                seen = rocking_travel(specimen.coupled(beta), omega, amplitude, reference)
            if seen is None:
                continue
            for number, (motion, half) in enumerate(zip((seen.storey_1, seen.storey_2), ranges, strict=True), 1):
                if motion > half:
                    what = "the bare frame" if beta is None else f"beta = {beta:g}"
                    moves = f"storey {number} of {what} moves {1e3 * motion:.0f} mm there"
                    needs = f"{moves}, its laser sees {1e3 * half:.0f} mm"
                    raise InvalidInput("omega", omega, needs)


def bare_travel(specimen: Specimen, omega: float, amplitude: float, reference: Reference) -> Travel:
    """What the lasers see of the bare frame, and its drift, in the steady state under `amplitude` [m/s2]."""
    from sim.linear import steady_response

    u1, u2 = steady_response(specimen, omega, amplitude)
    table = -amplitude / omega**2 if reference == "ground" else 0.0
    return Travel(abs(u1 + table), abs(u2 + table), abs(u2 - u1))


def rocking_travel(specimen: Specimen, omega: float, amplitude: float, reference: Reference) -> Travel | None:
    """The same of the steady rocking motion; None where it does not exist or was not found."""
    # frozen parameters are hashable, though pydantic does not declare it
    return _rocking_travel(specimen, omega, amplitude, reference)  # pyright: ignore[reportArgumentType]


@lru_cache(maxsize=1024)
def _rocking_travel(specimen: Specimen, omega: float, amplitude: float, reference: Reference) -> Travel | None:
    from sim.steady import NoOrbit, rocking_orbit

    try:
        phase, u1, u2, _ = rocking_orbit(specimen, omega, amplitude).samples(64).T
    except NoOrbit:
        return None
    table = -amplitude / omega**2 * np.sin(phase) if reference == "ground" else np.zeros_like(phase)
    return Travel(*(float(np.abs(each).max()) for each in (u1 + table, u2 + table, u2 - u1)))
