"""The multisines of an identification: the motions that are wanted, and the volts that are played for them."""

from dataclasses import dataclass
from math import ceil, log

import numpy as np
from numpy.typing import NDArray

from bench.config.model import BenchConfiguration
from bench.control.identification import steady_periods
from bench.control.multisine import Lines, band_lines, drive_amplitudes, multisine, waveform
from bench.control.octaves import octave_mean
from bench.control.target import REACH
from protocols.common.identification.parameters import IdentifyParameters
from sim.errors import InvalidInput
from sim.specimen import Specimen
from sim.steady import resting_rates

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

FADE = 0.25
"""Time in which a multisine is faded in and out, in its periods."""

_LEFT = 0.02
"""What is left of the specimen's own motion when the first period is used."""


@dataclass(frozen=True, eq=False)
class Grid:
    """The lines of an identification and how often their period is played: `discarded` periods, then `periods`."""

    lines: Lines
    samples: int
    sample_rate: float
    discarded: int
    periods: int

    @property
    def frequency(self) -> Array:
        """Of the lines [Hz], shape (n_lines,)."""
        return self.lines.astype(np.float64) * (self.sample_rate / self.samples)

    @property
    def fade(self) -> int:
        """Samples in which a record is faded in, and out."""
        return round(FADE * self.samples)

    @property
    def duration(self) -> float:
        """Length of what is played for one realisation [s]."""
        return (2 * self.fade + (self.discarded + self.periods) * self.samples) / self.sample_rate

    def shortened(self) -> "Grid":
        """The same lines for a probe: two periods after one that is left out."""
        return Grid(self.lines, self.samples, self.sample_rate, 1, 2)

    def record(self, spectrum: Complex) -> Array:
        """What is played or moved for a spectrum at the lines, shape (n,): faded in and out, zero at both ends."""
        whole = np.tile(waveform(self.lines, spectrum, self.samples), self.discarded + self.periods)
        one, n = whole[: self.samples], self.fade
        rise = 0.5 * (1.0 - np.cos(np.pi * np.arange(n) / n))
        return np.concatenate((rise * one[self.samples - n :], whole, rise[::-1] * one[:n]))

    def used(self, record: Array) -> Array:
        """The periods in steady state of a signal taken while `record` was played, shape (periods, samples).

        Raises InvalidInput when a sample of them is missing.
        """
        return steady_periods(record[self.fade : record.size - self.fade], self.samples, self.discarded)


def grid(parameters: IdentifyParameters, configuration: BenchConfiguration, specimen: Specimen) -> Grid:
    """The lines that `parameters` ask for on this bench. Raises InvalidInput for a band that holds none."""
    rate = configuration.sample_rate
    samples = round(parameters.period * rate)
    low, high = band(parameters, configuration)
    spacing = rate / samples
    if low < spacing:
        raise InvalidInput(
            "period", parameters.period, f"a line at {low:g} Hz needs a period of {1.0 / low:g} s at least"
        )
    # a line at or beyond either end: nothing is extrapolated
    wide = (2 if parameters.odd_lines else 1) * spacing
    lines = band_lines(samples, rate, (max(low - wide, spacing), high + wide), odd=parameters.odd_lines)
    first = int(np.searchsorted(lines * spacing, low * (1.0 + 1e-9), side="right")) - 1
    last = int(np.searchsorted(lines * spacing, high * (1.0 - 1e-9)))
    lines = lines[max(first, 0) : last + 1]
    discarded = parameters.discarded or max(ceil(_settling(specimen) / parameters.period - FADE), 1)
    return Grid(lines, samples, rate, discarded, parameters.periods)


def band(parameters: IdentifyParameters, configuration: BenchConfiguration) -> tuple[float, float]:
    """The band that is identified [Hz]: as asked for, else all that a motion within the table's band takes."""
    low, high = configuration.table_band
    return parameters.band_low or low / REACH, parameters.band_high or high * REACH


def wanted_motions(parameters: IdentifyParameters, lines: Grid) -> list[Complex]:
    """Complex amplitudes of the table's acceleration at the lines for each realisation, with a peak of 1 m/s2."""
    frequency = lines.frequency
    amplitudes = drive_amplitudes(frequency, np.ones(frequency.size), "displacement", parameters.corner)
    random = np.random.default_rng(parameters.phase_seed)
    made = [
        multisine(lines.lines, amplitudes, lines.samples, lines.sample_rate, random)
        for _ in range(parameters.realisations)
    ]
    return [each.scaled_to(1.0, np.ones(frequency.size)).spectrum for each in made]


def drive_for(motion: Complex, response: Complex, grid: Grid, knee: float) -> Complex:
    """Complex amplitudes of the drive [V] for those of an acceleration, by the table's `response` as far as known.

    Above the `knee` [Hz], where filters take their part of what is measured, the drive is what it is in the octave
    below: asking for the whole motion there would make much more of it.
    """
    frequency = grid.frequency
    size = np.sqrt(octave_mean(np.abs(response) ** 2, frequency))
    below = (frequency > 0.5 * knee) & (frequency <= knee)
    if below.any():
        size = np.where(frequency > knee, np.sqrt(np.mean(size[below] ** 2)), size)
    drive = motion / (size * np.exp(1j * np.angle(response)))
    return drive * (seen_peak(motion, grid, knee) / seen_peak(drive * response, grid, knee))


def seen_peak(motion: Complex, grid: Grid, knee: float) -> float:
    """Peak [m/s2] of an acceleration by its lines up to half the `knee` [Hz], which no filter has touched."""
    seen = grid.frequency <= 0.5 * knee
    seen = seen if seen.any() else np.ones(seen.shape, np.bool_)
    return float(np.abs(waveform(grid.lines[seen], motion[seen], grid.samples)).max())


def _settling(specimen: Specimen) -> float:
    """Time until the share `_LEFT` is left of the specimen's slowest motion [s]; with a block, while it rests."""
    return log(_LEFT) / float(resting_rates(specimen).real.max())
