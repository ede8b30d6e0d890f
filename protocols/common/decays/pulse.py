"""The pulse: its shape, and how strong it may be.

    w(t) = sin(phi) - sin(2 phi) / 2,    phi = 2 pi t / T,    0 <= t <= T

It begins and ends with two derivatives at zero and has no mean. A table that follows its drive with its velocity goes
there and back; one that follows with its acceleration comes to rest where it is. With T = 2 pi / sqrt(omega_1 omega_2)
both modes ring.
"""

from dataclasses import dataclass
from math import log, pi, sqrt

import numpy as np
from numpy.typing import NDArray

from bench.config.model import BenchConfiguration
from bench.preflight.bounds import bounds
from bench.preflight.response import SimulatedTable, response_of
from protocols.common.decays.parameters import DecayParameters
from protocols.common.identification.motion import RESTING, largest
from sim.linear import frame_matrices
from sim.specimen import Specimen

Array = NDArray[np.float64]

SHARE = 0.75
"""Share of each limit that is used."""

QUIET = 2.0
"""Rest in the recording before the pulse [s]: the noise of the table's sensor is taken there."""

LEFT, LONGEST = 1.0 / 12.0, 60.0
"""What is left of the first mode at the end of the window, and the longest window that is chosen by itself [s]."""

_PADDING = 20.0
"""Rest after a pulse in a Fourier transform [s]."""


@dataclass(frozen=True, eq=False)
class Pulse:
    """A pulse of `duration` [s], watched for `window` [s] afterwards, at `sample_rate` [1/s]."""

    duration: float
    window: float
    sample_rate: float

    @property
    def shape(self) -> Array:
        """The pulse itself with a peak of 1, shape (n,)."""
        phi = 2.0 * pi * np.arange(round(self.duration * self.sample_rate)) / (self.duration * self.sample_rate)
        made = np.sin(phi) - 0.5 * np.sin(2.0 * phi)
        return made / np.abs(made).max()

    def record(self, volts: float, window: float | None = None) -> Array:
        """What is played for a peak of `volts`: rest, pulse, and zeros for the window, or for another one [s]."""
        before, after = (round(time * self.sample_rate) for time in (QUIET, self.window if window is None else window))
        return np.concatenate((np.zeros(before), volts * self.shape, np.zeros(after)))

    @property
    def begin(self) -> float:
        """When the free motion begins, from the start of the recording [s]."""
        return QUIET + self.duration

    @property
    def length(self) -> float:
        """Length of the recording [s]."""
        return self.begin + self.window


def frequencies(specimen: Specimen) -> Array:
    """Undamped circular frequencies of the frame [rad/s], shape (2,), ascending; a spring is grounded on its block."""
    mass, _, stiffness = frame_matrices(specimen.frame)
    stiffness[0, 0] += specimen.k_c
    root = np.sqrt(np.diag(mass))
    return np.sqrt(np.linalg.eigvalsh(stiffness / np.outer(root, root)))


def pulse_of(parameters: DecayParameters, configuration: BenchConfiguration, specimen: Specimen) -> Pulse:
    """The pulse for a specimen, bare or with its block held."""
    omegas = frequencies(specimen)
    duration = parameters.pulse or 2.0 * pi / sqrt(float(omegas.prod()))
    return Pulse(duration, window_of(parameters, specimen), configuration.sample_rate)


def window_of(parameters: DecayParameters, specimen: Specimen) -> float:
    """How long a decay is watched [s]."""
    if parameters.window is not None:
        return parameters.window
    rate = specimen.frame.xi1 * float(frequencies(specimen).min())
    return min(-log(LEFT) / rate, LONGEST) if rate > 0.0 else LONGEST


@dataclass(frozen=True, eq=False)
class Planned:
    """What a pulse is expected to ask for, by the keys of `bench.preflight.bounds`, when the drift reaches `drift` [m];
    `binds` names what sets that. What is not known is not there.
    """

    pulse: Pulse
    drift: float
    asked: dict[str, float]
    binds: str


def planned(parameters: DecayParameters, configuration: BenchConfiguration, specimen: Specimen) -> Planned:
    """The pulse at the level that the bench allows.

    A simulated bench's table is that of its shaker; any other is taken as one whose velocity follows the drive.
    """
    pulse = pulse_of(parameters, configuration, specimen)
    unit = _asked(pulse, configuration, specimen)
    limits = {name: SHARE * bound.limit for name, bound in bounds(configuration).items()}
    allowed = {name: limits[name] / value for name, value in unit.items() if value > 0.0}
    binds = min(allowed, key=lambda name: allowed[name])
    wanted = parameters.drift / unit["drift"]
    scale = min(wanted, allowed[binds])
    return Planned(
        pulse,
        scale * unit["drift"],
        {name: scale * value for name, value in unit.items()},
        "drift asked for" if wanted <= allowed[binds] else binds,
    )


def _asked(pulse: Pulse, configuration: BenchConfiguration, specimen: Specimen) -> dict[str, float]:
    """The largest magnitudes under a drive of 1 V, or, where the table is not known, a velocity of 1 m/s."""
    drive = pulse.record(1.0, 5.0)
    response = response_of(configuration)
    if not isinstance(response, SimulatedTable):
        moved = np.gradient(drive, 1.0 / pulse.sample_rate)
        return _motion(moved, pulse, specimen, configuration)
    frame, block = specimen.frame, specimen.block
    payload = frame.m1 + frame.m2 + (block.mass if specimen.beta is not None else 0.0)
    size = drive.size + round(_PADDING * pulse.sample_rate)
    omega = 2.0 * pi * np.fft.rfftfreq(size, 1.0 / pulse.sample_rate)
    transfer = response.transfer(np.maximum(omega, 1e-9), payload)
    moved = np.fft.irfft(np.fft.rfft(drive, size) * transfer, size)[: drive.size]
    slew = float(np.abs(np.diff(drive)).max()) * pulse.sample_rate
    return _motion(moved, pulse, specimen, configuration) | {"drive_voltage": 1.0, "drive_slew": slew}


def _motion(moved: Array, pulse: Pulse, specimen: Specimen, configuration: BenchConfiguration) -> dict[str, float]:
    found = largest(moved, pulse.sample_rate, specimen, configuration)
    # a block that is held does not lift
    return {name: value for name, value in found.items() if name != RESTING}
