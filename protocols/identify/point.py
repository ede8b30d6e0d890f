"""What was identified, summed up in thirds of an octave: for people; every line is in the model."""

from collections.abc import Iterator
from math import ceil, floor, log2

import numpy as np

from bench.analysis.gain import COVERAGE
from bench.control.table_model import TableModel
from sim.parameters import Parameters, quantity


class IdentifiedBand(Parameters):
    """The table's response over a third of an octave; shares are of the response there."""

    frequency_hz: float = quantity(..., "Hz", "middle of the third of an octave")
    gain_m_s2_v: float = quantity(..., "m/s2/V", "table acceleration per drive: root mean square over its lines")
    phase_rad: float = quantity(..., "rad", "phase of the acceleration before the drive at the line next to the middle")
    uncertainty: float = quantity(..., "1", "expanded relative uncertainty of a line (k = 2), noise and distortion")
    distortion: float = quantity(..., "1", "standard deviation of one realisation by nonlinear distortion, relative")
    noise_m_s2_hz: float = quantity(..., "m/s2/Hz^0.5", "spectral density of the noise in the acceleration")
    coherence: float = quantity(..., "1", "lowest share of the acceleration's power that the drive explains")
    lines: int = quantity(..., "1", "lines in it")


def thirds(model: TableModel) -> Iterator[IdentifiedBand]:
    """The model in thirds of an octave around 1 Hz times powers of 2^(1/3); those without a line are left out."""
    frequency = np.array(model.frequency)
    response = np.array(model.real) + 1j * np.array(model.imaginary)
    low, high = model.band
    for number in range(floor(3.0 * log2(low)), ceil(3.0 * log2(high)) + 1):
        middle = 2.0 ** (number / 3.0)
        inside = (frequency >= middle * 2.0 ** (-1.0 / 6.0)) & (frequency < middle * 2.0 ** (1.0 / 6.0))
        if not inside.any():
            continue
        gain = _rms(np.abs(response[inside]))
        nearest = int(np.argmin(np.abs(frequency - middle)))
        yield IdentifiedBand(
            frequency_hz=middle,
            gain_m_s2_v=gain,
            phase_rad=float(np.angle(response[nearest])),
            uncertainty=COVERAGE * _rms(np.array(model.uncertainty)[inside]) / gain,
            distortion=_rms(np.array(model.distortion)[inside]) / gain,
            noise_m_s2_hz=_rms(np.array(model.noise)[inside]),
            coherence=float(np.array(model.coherence)[inside].min()),
            lines=int(np.count_nonzero(inside)),
        )


def _rms(values: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> float:
    return float(np.sqrt(np.mean(values**2)))
