"""Whether a bench can do what a campaign asks, as far as closed forms and steady states tell.

These refusals come at once and name the parameter; `protocols.harmonic.forecast` has the whole run, starts included.
"""

from math import tau

import numpy as np

from bench.analysis.steady import WINDOW
from bench.config.model import BenchConfiguration
from bench.control.candidates import OVERSHOOTS
from bench.preflight.motion import Travel
from protocols.harmonic.protocol import HarmonicParameters
from sim.errors import InvalidInput
from sim.linear import steady_response
from sim.steady import NoOrbit, rocking_orbit


class Reach:
    """The steady motions of a campaign, each computed once, against limits and ranges of the bench."""

    def __init__(self, parameters: HarmonicParameters, configuration: BenchConfiguration) -> None:
        self._parameters, self._configuration = parameters, configuration
        self._specimen = configuration.known_specimen
        self._amplitude = parameters.amplitude_factor * self._specimen.uplift_acceleration
        self._found: dict[tuple[float | None, float], Travel | None] = {}

    def check(self) -> None:
        """Raise InvalidInput for what table, lasers or limits do not allow."""
        self._check_table()
        self._check_storeys()

    def steady(self, beta: float | None, omega: float) -> Travel | None:
        """What the lasers see in the steady state at `omega` [rad/s], and the drift: of the bare frame where `beta` is
        None, else of the rocking motion; None where that does not exist or was not found.
        """
        if (beta, omega) not in self._found:
            self._found[beta, omega] = self._bare(omega) if beta is None else self._rocking(beta, omega)
        return self._found[beta, omega]

    def _check_table(self) -> None:
        """Refuse table motions beyond limits or stroke, a start's overshoot included: x = a / Omega^2 and so on."""
        parameters, configuration = self._parameters, self._configuration
        limits, stroke = configuration.limits, configuration.half_stroke
        peak = max(OVERSHOOTS) * self._amplitude
        if peak > limits.acceleration:
            allowed = f"a start needs {peak:.3g} m/s2, limits.acceleration = {limits.acceleration:g} m/s2"
            raise InvalidInput("amplitude_factor", parameters.amplitude_factor, allowed)
        start = f"a start of {peak:.3g} m/s2"
        reach, owner = min((stroke, "the shaker's stroke"), (limits.displacement, "limits.displacement"))
        for omega in parameters.omega:
            travel, speed = peak / omega**2, peak / omega
            at = f"{start} at {omega / tau:.2f} Hz"
            if travel > reach:
                needs = f"{at} needs {1e3 * travel:.1f} mm, {owner} allows {1e3 * reach:.1f} mm"
                raise InvalidInput("omega", omega, needs)
            if speed > limits.velocity:
                needs = f"{at} needs {speed:.3g} m/s, limits.velocity = {limits.velocity:g} m/s"
                raise InvalidInput("omega", omega, needs)
            if parameters.settle_limit < 2 * WINDOW * tau / omega:
                needs = f"judging a steady state at {omega:g} rad/s takes {2 * WINDOW * tau / omega:.1f} s at least"
                raise InvalidInput("settle_limit", parameters.settle_limit, needs)

    def _check_storeys(self) -> None:
        """Refuse frequencies at which a storey would leave its laser's range, bare or on the steady rocking motion."""
        halves = tuple(0.5 * whole for whole in self._configuration.laser_ranges)
        for omega in self._parameters.omega:
            for beta in (None, *self._parameters.beta):
                seen = self.steady(beta, omega)
                if seen is None:
                    continue
                for number, (motion, half) in enumerate(zip((seen.storey_1, seen.storey_2), halves, strict=True), 1):
                    if motion > half:
                        what = "the bare frame" if beta is None else f"beta = {beta:g}"
                        moves = f"storey {number} of {what} moves {1e3 * motion:.0f} mm there"
                        needs = f"{moves}, its laser sees {1e3 * half:.0f} mm"
                        raise InvalidInput("omega", omega, needs)

    def _bare(self, omega: float) -> Travel:
        u1, u2 = steady_response(self._specimen, omega, self._amplitude)
        table = -self._amplitude / omega**2 if self._configuration.laser_reference == "ground" else 0.0
        return Travel(abs(u1 + table), abs(u2 + table), abs(u2 - u1))

    def _rocking(self, beta: float, omega: float) -> Travel | None:
        specimen, amplitude = self._specimen.coupled(beta), self._amplitude
        try:
            phase, u1, u2, _ = rocking_orbit(specimen, omega, amplitude).samples(64).T
        except NoOrbit:
            return None
        on_ground = self._configuration.laser_reference == "ground"
        table = -amplitude / omega**2 * np.sin(phase) if on_ground else np.zeros_like(phase)
        return Travel(*(float(np.abs(each).max()) for each in (u1 + table, u2 + table, u2 - u1)))
