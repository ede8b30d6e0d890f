"""Pulse that excites the frame: shape, level, and demands on the bench.

    w(t) = sin(phi) - sin(2 phi) / 2,    phi = 2 pi t / T,    0 <= t <= T

Its first two derivatives are zero at both ends, and its mean is zero. A table whose velocity follows the drive returns
to its initial position; one whose acceleration follows the drive ends at rest. T = 2 pi / sqrt(omega_1 omega_2) excites
both modes.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import log, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from bench.config.model import BenchConfiguration
from bench.preflight.demands import UNPROBED, SimulatedTable, response_of
from bench.preflight.margins import Demand, Forecast, bounds
from bench.preflight.motion import RESTING, resting_demands
from protocols.common.decays.parameters import DecayParameters
from sim.errors import InvalidInput
from sim.linear import frame_matrices
from sim.specimen import Specimen

Array = NDArray[np.float64]

SHARE = 0.75
"""Fraction of each limit that is used."""

QUIET = 2.0
"""Time at rest between the start of the recording and the pulse [s], used to determine the noise of the sensors."""

LEFT, LONGEST = 1.0 / 12.0, 60.0
"""Fraction of the first mode's amplitude that remains at the end of the window, and longest automatic window [s]."""

LEAST = 0.003
"""Minimum drift of a decay [m]; the resolution of the lasers dominates below it."""

_FEWEST = 20
"""Minimum number of samples of a pulse."""

_PADDING = 20.0
"""Duration of the zeros appended to a pulse for its Fourier transform [s]."""


@dataclass(frozen=True, eq=False)
class Pulse:
    """Pulse of `duration` [s], recorded for `window` [s] afterwards, at `sample_rate` [1/s]."""

    duration: float
    window: float
    sample_rate: float

    @property
    def shape(self) -> Array:
        """Pulse with a peak of 1, shape (n,)."""
        phi = 2.0 * pi * np.arange(round(self.duration * self.sample_rate)) / (self.duration * self.sample_rate)
        made = np.sin(phi) - 0.5 * np.sin(2.0 * phi)
        return made / np.abs(made).max()

    def record(self, volts: float, window: float | None = None) -> Array:
        """Drive [V], shape (n,), with a peak of `volts`: rest, pulse, and zeros for `window` [s], by default the
        pulse's window.
        """
        before, after = (round(time * self.sample_rate) for time in (QUIET, self.window if window is None else window))
        return np.concatenate((np.zeros(before), volts * self.shape, np.zeros(after)))

    @property
    def begin(self) -> float:
        """Start of the free motion, relative to the start of the recording [s]."""
        return QUIET + self.duration

    @property
    def length(self) -> float:
        """Duration of the recording [s]."""
        return self.begin + self.window


def frequencies(specimen: Specimen) -> Array:
    """Undamped circular frequencies of the frame [rad/s], shape (2,), ascending. The block's end of the coupling
    spring, if mounted, is assumed fixed.
    """
    mass, _, stiffness = frame_matrices(specimen.frame)
    stiffness[0, 0] += specimen.k_c
    root = np.sqrt(np.diag(mass))
    return np.sqrt(np.linalg.eigvalsh(stiffness / np.outer(root, root)))


def decay_pulse(parameters: DecayParameters, configuration: BenchConfiguration, specimen: Specimen) -> Pulse:
    """Pulse for the bare frame, or for a specimen with the block clamped."""
    omegas = frequencies(specimen)
    duration = parameters.pulse or 2.0 * pi / sqrt(float(omegas.prod()))
    return Pulse(duration, decay_window(parameters, specimen), configuration.sample_rate)


def decay_window(parameters: DecayParameters, specimen: Specimen) -> float:
    """Time recorded after the excitation [s]."""
    if parameters.window is not None:
        return parameters.window
    rate = specimen.frame.xi1 * float(frequencies(specimen).min())
    return min(-log(LEFT) / rate, LONGEST) if rate > 0.0 else LONGEST


@dataclass(frozen=True, eq=False)
class PlannedPulse:
    """A pulse, its expected peak `drift` [m], and its demands, keyed by the limited quantity.

    Unknown demands are absent. `binds` names the limit that determines the drift, or is "requested drift".
    """

    pulse: Pulse
    drift: float
    demands: dict[str, float]
    binds: str


def plan_pulse(parameters: DecayParameters, configuration: BenchConfiguration, specimen: Specimen) -> PlannedPulse:
    """Plan the pulse for the requested drift, or for the largest drift that the bench allows.

    The table of a simulated bench is modelled by its shaker. Any other table is assumed to follow the drive in
    velocity. Raises InvalidInput for a pulse that is too short, or too weak within the limits.
    """
    pulse = decay_pulse(parameters, configuration, specimen)
    if pulse.shape.size < _FEWEST:
        least = _FEWEST / configuration.sample_rate
        raise InvalidInput("pulse", pulse.duration, f"at this sample rate the pulse must last at least {least:g} s")
    if parameters.drift < LEAST:
        raise InvalidInput(
            "drift",
            parameters.drift,
            f"it must be at least {LEAST:g} m: the lasers do not resolve the decay of a smaller drift",
        )
    unit = _unit_demands(pulse, configuration, specimen)
    limits = {name: SHARE * bound.limit for name, bound in bounds(configuration).items()}
    allowed = {name: limits[name] / value for name, value in unit.items() if value > 0.0}
    binds = min(allowed, key=lambda name: allowed[name])
    wanted = parameters.drift / unit["drift"]
    scale = min(wanted, allowed[binds])
    binding = "requested drift" if wanted <= allowed[binds] else binds
    drift = scale * unit["drift"]
    if drift < LEAST:
        needs = f"the limit on {binding} allows a drift of only {drift:.2g} m, but a decay needs {LEAST:g} m"
        raise InvalidInput("pulse", pulse.duration, f"{needs}: raise this limit, or choose another pulse duration")
    return PlannedPulse(pulse, drift, {name: scale * value for name, value in unit.items()}, binding)


def pulse_forecast(configuration: BenchConfiguration, pulses: Mapping[str, PlannedPulse], duration: float) -> Forecast:
    """Largest demands of all `pulses`, which are keyed by the name of the specimen."""
    demands: list[Demand] = []
    for quantity in bounds(configuration):
        known = {name: pulse.demands[quantity] for name, pulse in pulses.items() if quantity in pulse.demands}
        if not known:
            demands.append(Demand(quantity, None, None, UNPROBED[quantity]))
            continue
        name = max(known, key=lambda each: known[each])
        where = f"the pulse of {pulses[name].pulse.duration:.2g} s, {name}"
        demands.append(Demand(quantity, known[name], None, where))
    return Forecast(demands=tuple(demands), duration=duration)


def _unit_demands(pulse: Pulse, configuration: BenchConfiguration, specimen: Specimen) -> dict[str, float]:
    """Demands of a pulse with a peak of 1 V in the drive or, for an unknown table, of 1 m/s in the table's velocity."""
    drive = pulse.record(1.0, 5.0)
    response = response_of(configuration)
    if not isinstance(response, SimulatedTable):
        moved = np.gradient(drive, 1.0 / pulse.sample_rate)
        return _motion(moved, pulse, specimen, configuration)
    size = drive.size + round(_PADDING * pulse.sample_rate)
    omega = 2.0 * pi * np.fft.rfftfreq(size, 1.0 / pulse.sample_rate)
    transfer = response.transfer(np.maximum(omega, 1e-9), specimen.mass)
    moved = np.fft.irfft(np.fft.rfft(drive, size) * transfer, size)[: drive.size]
    slew = float(np.abs(np.diff(drive)).max()) * pulse.sample_rate
    return _motion(moved, pulse, specimen, configuration) | {"drive_voltage": 1.0, "drive_slew": slew}


def _motion(moved: Array, pulse: Pulse, specimen: Specimen, configuration: BenchConfiguration) -> dict[str, float]:
    found = resting_demands(moved, pulse.sample_rate, specimen, configuration)
    # a clamped block cannot lift
    return {name: value for name, value in found.items() if name != RESTING}
