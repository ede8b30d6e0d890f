"""The response of the table to its drive, from realisations and periods of a multisine.

Within a realisation the periods differ by noise only. Between realisations, which have other phases, they differ by
noise and by stochastic nonlinear distortion: what the variance between realisations has in excess of the noise is
distortion (the robust method of Pintelon and Schoukens, System Identification, 2nd ed., ch. 4).
"""

from dataclasses import dataclass
from datetime import datetime

import numpy as np
from numpy.typing import NDArray

from bench.control.multisine import Lines
from bench.control.table_model import TableModel
from sim.errors import InvalidInput

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class LineResponse:
    """A response at the lines, everything of shape (n_lines,).

    `response` [unit/V] with its standard `uncertainty`, noise and distortion together; `noise` is the share of noise
    in that uncertainty, `distortion` the standard deviation of one realisation's response by distortion alone, NaN
    for a single realisation. `noise_density` [unit/Hz^0.5] is that of the output.
    """

    frequency: Array
    response: Complex
    uncertainty: Array
    noise: Array
    distortion: Array
    coherence: Array
    noise_density: Array


def steady_periods(record: Array, samples: int, discard: int) -> Array:
    """The periods of one realisation without its first `discard`, shape (periods, samples).

    `record`, shape (n,), begins with the first sample of the first period. Raises InvalidInput when fewer than two
    whole periods remain or a sample is missing.
    """
    count = record.size // samples
    kept = record[discard * samples : count * samples]
    if count - discard < 2:
        raise InvalidInput("periods", count, f"two must remain after the first {discard}: noise shows between them")
    if not np.isfinite(kept).all():
        raise InvalidInput("record", "samples without a value", "the identification needs every sample; repeat it")
    return kept.reshape(count - discard, samples)


def line_amplitudes(periods: Array, lines: Lines) -> Complex:
    """Complex amplitudes at `lines` of periods of shape (..., samples), shape (..., n_lines)."""
    return np.fft.rfft(periods, axis=-1)[..., lines] * (2.0 / periods.shape[-1])


def line_response(drive: Complex, output: Complex, frequency: Array, spacing: float) -> LineResponse:
    """The response from complex amplitudes of drive [V] and output [unit], shape (realisations, periods, n_lines).

    `spacing` [Hz] is one over the period. The drive is known without noise. Raises InvalidInput for fewer than two
    periods, or for arrays that do not belong together.
    """
    realisations, periods = drive.shape[0], drive.shape[1]
    if drive.shape != output.shape or drive.shape[2:] != frequency.shape:
        raise InvalidInput("output", output.shape, f"the drive has the shape {drive.shape}: both must agree")
    if periods < 2:
        raise InvalidInput("periods", periods, "noise shows between two at least")
    u, y = drive.mean(axis=1), output.mean(axis=1)
    each = y / u
    response = each.mean(axis=0)
    scatter = np.sum(np.abs(output - y[:, None]) ** 2, axis=1) / (periods - 1)
    # of the mean over all periods and realisations
    noise = np.sum(scatter / periods / np.abs(u) ** 2, axis=0) / realisations**2
    if realisations > 1:
        total = np.sum(np.abs(each - response) ** 2, axis=0) / (realisations * (realisations - 1))
        distortion = np.sqrt(realisations * np.maximum(total - noise, 0.0))
        # few realisations may agree by chance: the uncertainty is at least that by noise
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
    """The table from periods in steady state of drive [V] and table acceleration [m/s2].

    Arrays have the shape (realisations, periods, samples); two realisations and two periods at least. `date` and
    `specimen` say when it was and what stood on the table. Raises InvalidInput.
    """
    if drive.shape[0] < 2:
        raise InvalidInput("realisations", drive.shape[0], "distortion shows between two at least")
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
    """Gain [1] and lead [s] of the displacement sensor against the accelerometer, from the responses of both.

    Two sensors on one rigid table differ by their calibrations and by how late they are: 1 and 0 when they agree, a
    negative gain when one of them stands the wrong way round. Fitted over the lines by their uncertainties.
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
