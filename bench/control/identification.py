"""Identification of the shake table from its response to a periodic multisine drive with random phases.

The lines of the multisine lie on the grid of its period, so a whole number of periods in steady state has no leakage.
Within a realisation, the periods differ only by noise. Between realisations, which have different phases, they differ
by noise and by stochastic nonlinear distortion: the variance between realisations in excess of the noise is due to
distortion (the robust method of Pintelon and Schoukens, System Identification, 2nd ed., ch. 4). The crest factor is
reduced by repeatedly clipping the waveform and combining its phases with the required amplitudes (Van der Ouderaa,
Schoukens and Renneboog, IEEE Trans. Instrum. Meas. 37, 1988).
"""

from dataclasses import dataclass, replace
from datetime import datetime
from typing import Literal

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from bench.control.table_model import TableModel
from sim.errors import InvalidInput

Array = NDArray[np.float64]
Lines = NDArray[np.int64]
Complex = NDArray[np.complex128]

Quantity = Literal["displacement", "velocity", "acceleration"]

_CLIPPINGS = 200
"""Number of clipping rounds. They typically reduce the crest factor from about 3.5 to 1.5."""
_FIRST_CLIP, _LAST_CLIP = 0.75, 0.95
"""Clipping levels of the first and the last round, relative to the peak."""


@dataclass(frozen=True)
class Multisine:
    """One period of drive, made of `lines` (multiples of the period's frequency) with complex `spectrum` [V].

    The amplitude of the k-th line is |spectrum[k]|; both have shape (n_lines,). `samples` is the number of samples per
    period, `sample_rate` is in 1/s.
    """

    lines: Lines
    spectrum: Complex
    samples: int
    sample_rate: float

    @property
    def frequency(self) -> Array:
        """Frequencies of the lines [Hz], shape (n_lines,)."""
        return self.lines.astype(np.float64) * (self.sample_rate / self.samples)

    @property
    def volts(self) -> Array:
        """One period of the drive [V], shape (samples,)."""
        return waveform(self.lines, self.spectrum, self.samples)

    def scaled_to(self, peak: float, response: Complex | Array) -> "Multisine":
        """The multisine scaled so that the output of a linear system with the `response` [unit/V] at its lines has a
        peak of `peak` units.
        """
        made = float(np.abs(waveform(self.lines, self.spectrum * response, self.samples)).max())
        return replace(self, spectrum=self.spectrum * (peak / made))

    def drive(self, periods: int) -> Array:
        """The drive [V] for `periods` consecutive periods."""
        return np.tile(self.volts, periods)


def band_lines(samples: int, sample_rate: float, band: tuple[float, float], *, odd: bool = False) -> Lines:
    """The lines of a period of `samples` samples within `band` [Hz], ends included; only the odd ones if `odd`.

    If only odd lines are driven, even-order distortion does not fall on them. Raises InvalidInput for a band without
    lines or beyond half the sample rate.
    """
    low, high = band
    if not 0.0 < low < high < 0.5 * sample_rate:
        allowed = f"its ends must be positive, ascending and below half the sample rate, {0.5 * sample_rate:g} Hz"
        raise InvalidInput("band of the multisine", band, allowed)
    spacing = sample_rate / samples
    lines = np.arange(int(np.ceil(low / spacing - 1e-9)), int(np.floor(high / spacing + 1e-9)) + 1)
    if odd:
        lines = lines[lines % 2 == 1]
    if lines.size == 0:
        apart = f"{spacing * (2 if odd else 1):g} Hz apart"
        raise InvalidInput("band of the multisine", band, f"it contains no line: the lines are {apart}")
    return lines.astype(np.int64)


def drive_amplitudes(frequency: Array, gain: Array, flat: Quantity, corner: float) -> Array:
    """Relative amplitudes of the drive at `frequency` [Hz], shape (n,), for a motion with a flat spectrum of the
    quantity `flat` up to `corner` [Hz], and of acceleration above.

    `gain` is the approximate table acceleration per volt, shape (n,); a preliminary `DriveCalibration` suffices.
    """
    power = {"acceleration": 0, "velocity": 1, "displacement": 2}[flat]
    return np.minimum(frequency / corner, 1.0) ** power / gain


def multisine(
    lines: Lines,
    amplitudes: Array,
    samples: int,
    sample_rate: float,
    seed: int | Generator,
    response: Complex | Array | None = None,
) -> Multisine:
    """A multisine with `amplitudes` [V] at `lines`, random phases from `seed`, and a low crest factor.

    The crest factor is that of the drive or, with a `response` at the lines, of the acceleration, which must not uplift
    a standing block. Every realisation of an identification needs a different seed, or the same generator.
    """
    random = np.random.default_rng(seed)
    spectrum = _with_phases(amplitudes, random.uniform(0.0, 2.0 * np.pi, lines.size))
    made = np.ones(lines.size) if response is None else response
    best, lowest = spectrum, np.inf
    for level in np.linspace(_FIRST_CLIP, _LAST_CLIP, _CLIPPINGS):
        output = waveform(lines, spectrum * made, samples)
        if (crest := _crest(output)) < lowest:
            best, lowest = spectrum, crest
        clipped = np.fft.rfft(np.clip(output, *(level * float(np.abs(output).max()) * np.array([-1.0, 1.0]))))[lines]
        spectrum = _with_phases(amplitudes, np.angle(clipped * np.conj(made)))
    return Multisine(lines, best, samples, sample_rate)


def waveform(lines: Lines, spectrum: Complex | Array, samples: int) -> Array:
    """One period of the sum of cosines with complex amplitudes `spectrum` at `lines`, shape (samples,)."""
    bins = np.zeros(samples // 2 + 1, dtype=np.complex128)
    bins[lines] = 0.5 * samples * spectrum
    return np.fft.irfft(bins, samples)


def _with_phases(amplitudes: Array, phases: Array) -> Complex:
    return np.asarray(amplitudes * np.exp(1j * phases), np.complex128)


def _crest(volts: Array) -> float:
    return float(np.abs(volts).max() / np.sqrt(np.mean(volts**2)))


@dataclass(frozen=True)
class LineResponse:
    """Measured frequency response at the lines of a multisine; all arrays have shape (n_lines,).

    `response` [unit/V] has the standard `uncertainty` due to noise and distortion together; `noise` is the contribution
    of noise to it, `distortion` the standard deviation of one realisation's response due to distortion alone, NaN for a
    single realisation. `noise_density` [unit/Hz^0.5] is the amplitude spectral density of the noise in the output.
    `coherence` is the magnitude-squared coherence between drive and output.
    """

    frequency: Array
    response: Complex
    uncertainty: Array
    noise: Array
    distortion: Array
    coherence: Array
    noise_density: Array


def steady_periods(record: Array, samples: int, discard: int) -> Array:
    """Periods of one realisation after the first `discard`, shape (periods, samples).

    `record`, shape (n,), begins with the first sample of the first period. Raises InvalidInput if fewer than two
    complete periods remain or a sample is missing.
    """
    count = record.size // samples
    kept = record[discard * samples : count * samples]
    if count - discard < 2:
        allowed = f"at least two must remain after the first {discard}, to estimate the noise"
        raise InvalidInput("periods", count, allowed)
    if not np.isfinite(kept).all():
        raise InvalidInput("record", "samples without a value", "every sample is required; repeat the measurement")
    return kept.reshape(count - discard, samples)


def line_amplitudes(periods: Array, lines: Lines) -> Complex:
    """Complex amplitudes at `lines`, shape (..., n_lines), of the samples of whole periods, shape (..., samples)."""
    return np.fft.rfft(periods, axis=-1)[..., lines] * (2.0 / periods.shape[-1])


def line_response(drive: Complex, output: Complex, frequency: Array, spacing: float) -> LineResponse:
    """The response from complex amplitudes of drive [V] and output [unit], shape (realisations, periods, n_lines).

    `spacing` [Hz] is the reciprocal of the period. The drive is assumed to be free of noise. Raises InvalidInput for
    fewer than two periods, or for inconsistent arrays.
    """
    realisations, periods = drive.shape[0], drive.shape[1]
    if drive.shape != output.shape or drive.shape[2:] != frequency.shape:
        allowed = f"it must agree with the shapes of drive, {drive.shape}, and frequency, {frequency.shape}"
        raise InvalidInput("output", output.shape, allowed)
    if periods < 2:
        raise InvalidInput("periods", periods, "at least two are required, to estimate the noise")
    u, y = drive.mean(axis=1), output.mean(axis=1)
    each = y / u
    response = each.mean(axis=0)
    scatter = np.sum(np.abs(output - y[:, None]) ** 2, axis=1) / (periods - 1)
    # variance of the mean over all periods and realisations
    noise = np.sum(scatter / periods / np.abs(u) ** 2, axis=0) / realisations**2
    if realisations > 1:
        total = np.sum(np.abs(each - response) ** 2, axis=0) / (realisations * (realisations - 1))
        distortion = np.sqrt(realisations * np.maximum(total - noise, 0.0))
        # a few realisations may agree by chance; the uncertainty due to noise is therefore the lower bound
        uncertainty = np.sqrt(np.maximum(total, noise))
    else:
        distortion, uncertainty = np.full(frequency.shape, np.nan), np.sqrt(noise)
    cross = np.abs(np.sum(np.conj(drive) * output, axis=(0, 1))) ** 2
    power = np.sum(np.abs(drive) ** 2, axis=(0, 1)) * np.sum(np.abs(output) ** 2, axis=(0, 1))
    return LineResponse(
        frequency=frequency,
        response=response,
        uncertainty=uncertainty,
        noise=np.sqrt(noise),
        distortion=distortion,
        coherence=cross / power,
        noise_density=np.sqrt(scatter.mean(axis=0) / (2.0 * spacing)),
    )


def identify_table(
    drive: Array,
    acceleration: Array,
    lines: Lines,
    sample_rate: float,
    *,
    date: datetime,
    specimen: str,
) -> TableModel:
    """Identify the table from periods of drive [V] and table acceleration [m/s2] in steady state.

    Arrays have the shape (realisations, periods, samples); at least two realisations and two periods are required.
    `date` and `specimen` record the time and the specimen on the table. Raises InvalidInput otherwise.
    """
    if drive.shape[0] < 2:
        raise InvalidInput("realisations", drive.shape[0], "at least two are required, to estimate the distortion")
    spacing = sample_rate / drive.shape[-1]
    a = line_amplitudes(acceleration, lines)
    found = line_response(line_amplitudes(drive, lines), a, lines * spacing, spacing)
    power = 0.5 * np.sum(np.abs(a.mean(axis=1)) ** 2, axis=-1)
    return TableModel(
        date=date,
        specimen=specimen,
        sample_rate=sample_rate,
        level=float(np.sqrt(power.mean())),
        frequency=tuple(found.frequency.tolist()),
        real=tuple(found.response.real.tolist()),
        imaginary=tuple(found.response.imag.tolist()),
        uncertainty=tuple(found.uncertainty.tolist()),
        distortion=tuple(found.distortion.tolist()),
        coherence=tuple(found.coherence.tolist()),
        noise=tuple(found.noise_density.tolist()),
    )


def sensor_agreement(acceleration: LineResponse, displacement: LineResponse) -> tuple[float, float]:
    """Gain [1] and lead [s] of the displacement sensor relative to the accelerometer, from the responses of both
    sensors.

    Two sensors on one rigid table differ in calibration and delay only. The values are 1 and 0 if they agree; the gain
    is negative if one sensor is reversed. The fit over the lines is weighted by their uncertainties.
    """
    omega = 2.0 * np.pi * acceleration.frequency
    ratio = -(omega**2) * displacement.response / acceleration.response
    variance = (displacement.uncertainty / np.abs(displacement.response)) ** 2
    variance += (acceleration.uncertainty / np.abs(acceleration.response)) ** 2
    weight = 1.0 / np.maximum(variance, 1e-12)
    sign = 1.0 if np.sum(weight * ratio.real) >= 0.0 else -1.0
    gain = sign * float(np.sum(weight * np.abs(ratio)) / np.sum(weight))
    lead = float(np.sum(weight * omega * np.angle(sign * ratio)) / np.sum(weight * omega**2))
    return gain, lead
