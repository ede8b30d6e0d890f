"""The whole drive of a harmonic campaign before it runs: every stage that the lab sheet may drive, in order."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import tau

import numpy as np

from bench.config.model import BenchConfiguration
from bench.control.legs import Leg
from bench.control.starts import Start
from bench.preflight.forecast import Stage
from bench.preflight.response import TableResponse
from protocols.common.calibrate import CHANGE_TIME, MEASURED, PROBE, SETTLING, harmonic_frequencies
from protocols.harmonic.protocol import HarmonicParameters
from sim.specimen import Specimen
from sim.steady import resting_level

BARE_CHANGE = 4.0
"""Time in which the bare frame goes from one frequency to the next [s], as the lab sheet has it."""

HOLD, BARE_HOLD = 20.0, 40.0
"""Time for which the sine that ends a stage is simulated [s]: the transients of a rocking block are shorter."""

PROBES = (PROBE, 10.0 * PROBE)
"""Drive amplitudes [V] before anything is known of the table."""


@dataclass(frozen=True)
class Trial:
    """A stage as it is simulated: `before` it the legs that lead up to it and do not count, after it its last sine.

    That one is simulated for `hold` [s] and may last `longest` [s]. `beta` is the stiffness ratio with which the block
    is to rock, None where it is not to. `steady` is the sine [rad/s] whose steady state counts as well.
    """

    stage: Stage
    specimen: Specimen
    before: tuple[Leg, ...] = ()
    hold: float = 0.0
    longest: float = 0.0
    beta: float | None = None
    steady: float | None = None

    @property
    def legs(self) -> tuple[Leg, ...]:
        """All of what is simulated."""
        legs = (*self.before, *self.stage.legs)
        return (*legs, _held(legs[-1], self.hold)) if self.hold > 0.0 else legs

    @property
    def begin(self) -> float:
        """When it begins to count [s]."""
        return sum(leg.duration for leg in self.before)


def trials(
    parameters: HarmonicParameters,
    configuration: BenchConfiguration,
    response: TableResponse | None,
    starts: Mapping[tuple[float, float], Sequence[Start]],
) -> Iterator[Trial]:
    """Every stage that the lab sheet may come to, each of the planned `starts` (by stiffness and frequency) among them.

    Without a `response` of the table the calibration of the bare frame is taken to move it as asked.
    """
    specimen = configuration.known_specimen
    yield _bare_calibration(parameters, specimen, response)
    yield from _bare_tests(parameters, specimen)
    longest = _longest_dwell(parameters)
    for beta in parameters.beta:
        coupled = specimen.coupled(beta)
        plans = {omega: starts[beta, omega] for omega in parameters.omega}
        wanted, level = spring_calibration(parameters, coupled, [start for each in plans.values() for start in each])
        legs = _calibration_legs([(omega, level) for omega in wanted])
        yield Trial(Stage(f"calibration of the drive with beta = {beta:g}", legs), coupled)
        for omega, planned in plans.items():
            for number, start in enumerate(planned, 1):
                name = f"start {number} of beta = {beta:g} at omega = {omega:g} rad/s"
                stage = Stage(name, start.legs, start.chance)
                yield Trial(stage, coupled, hold=HOLD, longest=longest, beta=beta, steady=omega)


def spring_calibration(
    parameters: HarmonicParameters, specimen: Specimen, starts: Sequence[Start]
) -> tuple[list[float], float]:
    """Frequencies [rad/s] and level [m/s2] at which the drive is calibrated with a spring: the block provably rests."""
    amplitude = parameters.amplitude_factor * specimen.uplift_acceleration
    omegas = sorted({leg.omega for start in starts for leg in start.legs})
    grid = np.linspace(omegas[0], omegas[-1], max(round((omegas[-1] - omegas[0]) / 1.5) + 1, 2))
    wanted = sorted({*(round(float(omega), 2) for omega in grid), *parameters.omega})
    allowed = 0.6 * min(resting_level(specimen, omega) for omega in wanted)
    return wanted, min(parameters.calibration_level * amplitude, allowed)


def _bare_calibration(parameters: HarmonicParameters, specimen: Specimen, response: TableResponse | None) -> Trial:
    """The bare frame's calibration divides by the response at the frequency before, at first by the one probed.

    The probe is so small that friction takes a good part of it: what is made of its response moves the table more.
    """
    level = parameters.calibration_level * parameters.amplitude_factor * specimen.uplift_acceleration
    first = parameters.omega[0]
    wanted = sorted({*parameters.omega, *harmonic_frequencies(max(parameters.omega), parameters.harmonics)})
    legs: list[Leg] = []
    if response is None:
        levels = [(omega, level) for omega in wanted]
    else:
        gains = response.gain(np.array([first, *wanted]), payload_of(specimen.bare()))
        for volts in PROBES:
            legs += [*_measured(first, volts * float(gains[0])), Leg(CHANGE_TIME, 0.0, first)]
        probed = gains[0] * (1.0 - response.friction / PROBES[-1])
        before = [probed, *gains[1:-1]]
        levels = [(w, level * float(gain / by)) for w, gain, by in zip(wanted, gains[1:], before, strict=True)]
    for omega, moved in levels:
        legs += [*_measured(omega, moved), Leg(CHANGE_TIME, 0.0, omega)]
    legs.append(Leg(CHANGE_TIME, 0.0, wanted[-1]))
    return Trial(Stage("calibration of the drive with the bare frame", tuple(legs)), specimen.bare())


def _bare_tests(parameters: HarmonicParameters, specimen: Specimen) -> Iterator[Trial]:
    amplitude = parameters.amplitude_factor * specimen.uplift_acceleration
    before: tuple[Leg, ...] = ()
    for omega in parameters.omega:
        leg = Leg(BARE_CHANGE if before else parameters.ramp_time, amplitude, omega)
        stage = Stage(f"the bare frame at omega = {omega:g} rad/s", (leg,))
        longest = _longest_dwell(parameters)
        yield Trial(stage, specimen.bare(), before, hold=BARE_HOLD, longest=longest, steady=omega)
        # what the next one starts from, as steady as a frame of this damping is after so long
        before = (Leg(parameters.ramp_time, amplitude, omega), _held(leg, BARE_HOLD))


def _calibration_legs(levels: Sequence[tuple[float, float]]) -> tuple[Leg, ...]:
    """Up and down over (frequency [rad/s], level [m/s2])."""
    legs = [leg for omega, level in levels for leg in _measured(omega, level)]
    return (*legs, Leg(CHANGE_TIME, 0.0, levels[-1][0]))


def _measured(omega: float, level: float) -> tuple[Leg, Leg]:
    return Leg(CHANGE_TIME, level, omega), Leg((SETTLING + MEASURED) * tau / omega, level, omega)


def _held(leg: Leg, duration: float) -> Leg:
    return Leg(duration, leg.amplitude, leg.omega)


def _longest_dwell(parameters: HarmonicParameters) -> float:
    return parameters.settle_limit + parameters.measured_cycles * tau / min(parameters.omega)


def payload_of(specimen: Specimen) -> float:
    """Mass on the table [kg]."""
    block = specimen.block.mass if specimen.beta is not None else 0.0
    return specimen.frame.m1 + specimen.frame.m2 + block
