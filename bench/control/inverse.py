"""The inverse of the table: what must be added to the drive for a motion that is missing."""

import numpy as np
from numpy.typing import NDArray

from bench.control.octaves import octave_mean
from bench.control.table_model import TableModel
from bench.control.target import Target

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

REGULARISATION = 1e-3
"""eps: lines whose response is below this share of the largest get less than half of the drive that they ask for."""

_TINY = 1e-12
"""Share of the largest power below which a line holds rounding and nothing else."""


class TableInverse:
    """Goes between drive and acceleration on the lines of a target's transform that lie within its support.

    Spectra are `numpy.fft.rfft` of whole records at those lines, shape (n_lines,).
    """

    def __init__(self, model: TableModel, target: Target) -> None:
        """Raises InvalidInput where the model does not cover the target's support or has another sample rate."""
        model.require_rate(target.sample_rate)
        low, high = target.support
        self._size = target.acceleration.size
        self._inside = (target.frequency > low) & (target.frequency < high)
        self.frequency = target.frequency[self._inside]
        self.window = target.window[self._inside]
        self._response = model.response(self.frequency)
        self._coherence = model.coherence_at(self.frequency)
        density = octave_mean(model.noise_at(self.frequency) ** 2, self.frequency)
        self.noise: Array = density * (0.5 * target.sample_rate * self._size)
        """Expected |spectrum|^2 of the measurement noise [(m/s2)^2], shape (n_lines,)."""

    def spectrum(self, record: Array) -> Complex:
        """The lines within the support of a record."""
        return np.fft.rfft(record)[self._inside]

    def record(self, spectrum: Complex) -> Array:
        """The record of a spectrum that is zero outside the support."""
        whole = np.zeros(self._inside.size, dtype=np.complex128)
        whole[self._inside] = spectrum
        return np.fft.irfft(whole, self._size)

    def predicted(self, volts: Array) -> Array:
        """Table acceleration [m/s2] that a drive makes, as far as it lies within the support."""
        return self.record(self._response * self.spectrum(volts))

    def correction(self, missing: Complex, noise: Array) -> Array:
        """Drive [V] for the spectrum of a `missing` acceleration, at the gain one.

        Every line counts by its coherence and by the share of its power that is not `noise`: noise is not learned.
        """
        power = octave_mean(np.abs(missing) ** 2, self.frequency)
        real_share = np.maximum(1.0 - noise / np.maximum(power, _TINY * power.max(initial=1e-300)), 0.0)
        size = np.abs(self._response) ** 2
        inverse = np.conj(self._response) / (size + REGULARISATION**2 * size.max())
        return self.record(self.window * self._coherence * real_share * inverse * missing)

    def refine(self, volts: Array, measured: Complex) -> None:
        """Correct the response by what a pass has shown of it: its smooth part, as far as it is coherent."""
        predicted = self._response * self.spectrum(volts)
        cross = octave_mean(np.conj(predicted) * measured, self.frequency)
        input_power = octave_mean(np.abs(predicted) ** 2, self.frequency)
        output_power = octave_mean(np.abs(measured) ** 2, self.frequency)
        input_power = np.maximum(input_power, _TINY * input_power.max())
        output_power = np.maximum(output_power, _TINY * output_power.max())
        coherence = np.abs(cross) ** 2 / (input_power * output_power)
        self._response = self._response * (1.0 + coherence * (cross / input_power - 1.0))
