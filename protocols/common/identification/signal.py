"""Multisines of an identification: motions of the table, their level within the limits of the bench and of the resting
block, and their drive.
"""

from dataclasses import dataclass
from functools import lru_cache
from math import ceil, log

import numpy as np
from numpy.typing import NDArray

from bench.config.model import BenchConfiguration
from bench.control.identification import Lines, band_lines, drive_amplitudes, multisine, steady_periods, waveform
from bench.control.table_model import octave_mean
from bench.control.target import REACH
from bench.preflight.demands import response_of
from bench.preflight.margins import bounds
from bench.preflight.motion import RESTING, resting_demands
from protocols.common.identification.parameters import IdentifyParameters
from sim.errors import InvalidInput
from sim.specimen import Specimen
from sim.steady import resting_rates

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

FADE = 0.25
"""Duration of the fade-in and of the fade-out of a multisine, in periods."""

_LEFT = 0.02
"""Fraction of the specimen's transient that remains at the start of the first used period."""

_UNDAMPED = 1e-9
"""Largest decay rate of a mode, relative to its frequency, that is due to rounding."""


@dataclass(frozen=True, eq=False)
class Grid:
    """Frequency lines of an identification, number of `samples` per period, and numbers of `discarded` and used
    `periods`.
    """

    lines: Lines
    samples: int
    sample_rate: float
    discarded: int
    periods: int

    @property
    def frequency(self) -> Array:
        """Frequencies of the lines [Hz], shape (n_lines,)."""
        return self.lines.astype(np.float64) * (self.sample_rate / self.samples)

    @property
    def fade(self) -> int:
        """Number of samples of the fade-in, equal to that of the fade-out."""
        return round(FADE * self.samples)

    @property
    def duration(self) -> float:
        """Duration of the drive in one realisation [s]."""
        return (2 * self.fade + (self.discarded + self.periods) * self.samples) / self.sample_rate

    def shortened(self) -> "Grid":
        """Grid of a probe: the same lines with one discarded and two used periods."""
        return Grid(self.lines, self.samples, self.sample_rate, 1, 2)

    def record(self, spectrum: Complex) -> Array:
        """Signal with the given spectrum at the lines, shape (n,), faded in from zero and out to zero."""
        whole = np.tile(waveform(self.lines, spectrum, self.samples), self.discarded + self.periods)
        one, n = whole[: self.samples], self.fade
        rise = 0.5 * (1.0 - np.cos(np.pi * np.arange(n) / n))
        return np.concatenate((rise * one[self.samples - n :], whole, rise[::-1] * one[:n]))

    def used_rows(self, values: Array) -> Array:
        """The rows of `values`, shape (n, ...), measured while the drive was played, from the first used period on and
        without the fade-out.
        """
        return values[self.fade + self.discarded * self.samples : len(values) - self.fade]

    def used(self, record: Array) -> Array:
        """Steady-state periods of `record`, a signal measured while the drive was played, shape (periods, samples).

        Raises InvalidInput for missing samples.
        """
        return steady_periods(record[self.fade : record.size - self.fade], self.samples, self.discarded)


def grid(parameters: IdentifyParameters, configuration: BenchConfiguration, specimen: Specimen) -> Grid:
    """Frequency lines for `parameters` on this bench. Raises InvalidInput if the period is too short for the band."""
    rate = configuration.sample_rate
    samples = round(parameters.period * rate)
    low, high = band(parameters, configuration)
    spacing = rate / samples
    if low < spacing:
        raise InvalidInput(
            "period", parameters.period, f"a line at {low:g} Hz needs a period of at least {1.0 / low:g} s"
        )
    # the lines enclose the band, so that no value within it is extrapolated
    wide = (2 if parameters.odd_lines else 1) * spacing
    lines = band_lines(samples, rate, (max(low - wide, spacing), high + wide), odd=parameters.odd_lines)
    first = int(np.searchsorted(lines * spacing, low * (1.0 + 1e-9), side="right")) - 1
    last = int(np.searchsorted(lines * spacing, high * (1.0 - 1e-9)))
    lines = lines[max(first, 0) : last + 1]
    discarded = parameters.discarded or max(ceil(settling(specimen) / parameters.period - FADE), 1)
    return Grid(lines, samples, rate, discarded, parameters.periods)


def band(parameters: IdentifyParameters, configuration: BenchConfiguration) -> tuple[float, float]:
    """Identified band [Hz]: as specified in the parameters, otherwise as required for replication."""
    low, high = configuration.table_band
    return parameters.band_low or low / REACH, parameters.band_high or high * REACH


def required_motions(parameters: IdentifyParameters, lines: Grid) -> list[Complex]:
    """Complex amplitudes of the table's acceleration at the lines, shape (n_lines,), for each realisation; every motion
    has a peak of 1 m/s2.
    """
    asked = parameters.corner, parameters.phase_seed, parameters.realisations
    return [*_unit_motions(lines.lines.tobytes(), lines.samples, lines.sample_rate, *asked)]


@lru_cache(maxsize=8)
def _unit_motions(
    lines: bytes, samples: int, sample_rate: float, corner: float, seed: int, realisations: int
) -> tuple[Complex, ...]:
    """`required_motions` at the `lines` of a period of `samples` samples. They do not depend on the limits of the
    bench, and a plan is often repeated with others.
    """
    orders = np.frombuffer(lines, dtype=np.int64)
    frequency: Array = orders.astype(np.float64) * (sample_rate / samples)
    amplitudes = drive_amplitudes(frequency, np.ones(frequency.size), "displacement", corner)
    random = np.random.default_rng(seed)
    made = [multisine(orders, amplitudes, samples, sample_rate, random) for _ in range(realisations)]
    return tuple(each.scaled_to(1.0, np.ones(frequency.size)).spectrum for each in made)


def drive_for(motion: Complex, response: Complex, grid: Grid, knee: float) -> Complex:
    """Complex amplitudes of the drive [V] for the acceleration `motion`, using the table's `response` where known.

    Above the `knee` [Hz], where filters attenuate the measured response, the gain of the octave below is used; with the
    attenuated response the motion would be much too large.
    """
    frequency = grid.frequency
    size = np.sqrt(octave_mean(np.abs(response) ** 2, frequency))
    below = (frequency > 0.5 * knee) & (frequency <= knee)
    if below.any():
        size = np.where(frequency > knee, np.sqrt(np.mean(size[below] ** 2)), size)
    drive = motion / (size * np.exp(1j * np.angle(response)))
    return drive * (measured_peak(motion, grid, knee) / measured_peak(drive * response, grid, knee))


def measured_peak(motion: Complex, grid: Grid, knee: float) -> float:
    """Peak [m/s2] of an acceleration, from its lines up to half the `knee` [Hz], which filters hardly attenuate, or
    from all lines if none is below.
    """
    seen = grid.frequency <= 0.5 * knee
    seen = seen if seen.any() else np.ones(seen.shape, np.bool_)
    return float(np.abs(waveform(grid.lines[seen], motion[seen], grid.samples)).max())


def settling(specimen: Specimen) -> float:
    """Time [s] in which the slowest motion of the specimen, with a resting block, decays to the fraction `_LEFT`.
    Raises InvalidInput if it does not decay.
    """
    rates = resting_rates(specimen)
    slowest = -float(rates.real.max())
    if slowest < _UNDAMPED * float(np.abs(rates).max()):
        needs = "a mode of the specimen is not damped, so its motion never settles: specify the number of periods"
        raise InvalidInput("discarded", None, needs)
    return -log(_LEFT) / slowest


SHARE = 0.75
"""Fraction of each limit that is used."""

BLOCK_SHARE = 0.6
"""Fraction of the uplift moment that is used; the rest is a margin for the uncertainty of spring, frame and base."""


@dataclass(frozen=True, eq=False)
class Planned:
    """Planned multisines: acceleration spectra `motions` at the lines of `grid`, each with a peak of `level` [m/s2].

    `demands` holds the largest demands of the motions. `binds` names the limit that determines the level, or is "level"
    if the level is the requested one.
    """

    grid: Grid
    motions: tuple[Complex, ...]
    level: float
    demands: dict[str, float]
    binds: str


def specimen_of(parameters: IdentifyParameters, configuration: BenchConfiguration) -> Specimen:
    """Specimen on the table during the identification."""
    specimen = configuration.known_specimen
    return specimen.bare() if parameters.beta is None else specimen.coupled(parameters.beta)


def mounted_name(specimen: Specimen) -> str:
    """Name of the mounted specimen in a table model."""
    return "bare frame" if specimen.beta is None else f"block with the spring of beta = {specimen.label:g}"


def planned(parameters: IdentifyParameters, configuration: BenchConfiguration) -> Planned:
    """Plan the motions at the requested level, or at the highest level that the bench allows.

    The drive limits the level only if the table is known, because it is simulated or was identified before. Raises
    InvalidInput for a band that the bench cannot produce.
    """
    specimen = specimen_of(parameters, configuration)
    lines = grid(parameters, configuration, specimen)
    unit = required_motions(parameters, lines)
    each = [_motion_demands(lines, motion, specimen, configuration) for motion in unit]
    asked = {name: max(one[name] for one in each) for name in each[0]}
    limits = {name: SHARE * bound.limit for name, bound in bounds(configuration).items()} | {RESTING: BLOCK_SHARE}
    allowed = {name: limits[name] / value for name, value in asked.items() if value > 0.0}
    binds = min(allowed, key=lambda name: allowed[name])
    if parameters.level <= allowed[binds]:
        binds = "level"
    level = min(parameters.level, *allowed.values())
    scaled = {name: level * value for name, value in asked.items()}
    return Planned(lines, tuple(level * motion for motion in unit), level, scaled, binds)


def _motion_demands(
    lines: Grid, motion: Complex, specimen: Specimen, configuration: BenchConfiguration
) -> dict[str, float]:
    found = resting_demands(lines.record(motion), lines.sample_rate, specimen, configuration)
    return found | _drive(lines, motion, specimen, configuration)


def _drive(lines: Grid, motion: Complex, specimen: Specimen, configuration: BenchConfiguration) -> dict[str, float]:
    """Peaks of the drive [V] and of its slew rate [V/s]; empty if the response of the table is unknown."""
    response = response_of(configuration)
    if response is None:
        return {}
    omega: Array = 2.0 * np.pi * lines.frequency
    gain = response.gain(omega, specimen.mass).astype(np.complex128)
    volts = lines.record(drive_for(motion, gain, lines, configuration.table_band[1]))
    slew = np.diff(volts) * lines.sample_rate
    return {"drive_voltage": float(np.abs(volts).max()), "drive_slew": float(np.abs(slew).max())}
