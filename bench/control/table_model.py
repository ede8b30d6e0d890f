"""Identified model of the shake table: its response to the drive, with uncertainty, and the inverse of the response for
corrections of the drive.
"""

import json
from datetime import datetime, timedelta
from math import exp2
from pathlib import Path
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray
from pydantic import AwareDatetime, model_validator

from bench.bounded import read_bounded, require_shallow
from bench.config.validation import validated
from bench.control.target import Target
from sim.errors import InvalidInput
from sim.parameters import Parameters, quantity

Number = TypeVar("Number", np.float64, np.complex128)

_REACH = exp2(1.0 / 6.0)
"""Ratio of the ends of an averaging band to its centre frequency: a sixth of an octave on either side."""


def octave_mean(values: NDArray[Number], frequency: NDArray[np.float64]) -> NDArray[Number]:
    """Mean of `values` over a third-octave band centred on each `frequency`, positive and ascending, same shape."""
    total: NDArray[Number] = np.concatenate((np.zeros(1, values.dtype), np.cumsum(values)))
    first = np.searchsorted(frequency, frequency / _REACH)
    last = np.searchsorted(frequency, frequency * _REACH, side="right")
    # numpy's stubs lose the element type in a division
    return cast(NDArray[Number], (total[last] - total[first]) / (last - first))


Array = NDArray[np.float64]

Values = tuple[float, ...]

LONGEST_AGE = timedelta(hours=12)
"""Default age after which a model is rejected, because the temperatures of coil and guides change."""


ROUNDING = 1e-9
"""Relative tolerance at the ends of the band: its lines are rounded multiples of a resolution."""


class TableModel(Parameters):
    """Table acceleration per drive [m/s2/V] at ascending frequencies; all arrays have shape (n_lines,).

    The response covers everything between a drive sample and a channel's sample: the hold of the output converter,
    amplifier, table, specimen and filter card. Convention exp(+i omega t).
    """

    date: AwareDatetime = quantity(..., "", "date of the identification")
    specimen: str = quantity(..., "", "specimen mounted on the table")
    sample_rate: float = quantity(..., "1/s", "samples per second of drive and channels", gt=0)
    level: float = quantity(..., "m/s2", "root mean square of the table acceleration during the identification", gt=0)
    frequency: Values = quantity(..., "Hz", "frequencies of the lines, ascending", min_length=2)
    real: Values = quantity(..., "m/s2/V", "real part of the response")
    imaginary: Values = quantity(..., "m/s2/V", "imaginary part of the response")
    uncertainty: Values = quantity(..., "m/s2/V", "standard uncertainty of the response due to noise and distortion")
    distortion: Values = quantity(..., "m/s2/V", "standard deviation of the response due to nonlinear distortion alone")
    coherence: Values = quantity(..., "1", "fraction of the acceleration's power explained by the drive")
    noise: Values = quantity(..., "m/s2/Hz^0.5", "amplitude spectral density of the noise in the acceleration")

    @model_validator(mode="after")
    def _check_lengths(self) -> "TableModel":
        n = len(self.frequency)
        for name in ("real", "imaginary", "uncertainty", "distortion", "coherence", "noise"):
            if len(getattr(self, name)) != n:
                raise InvalidInput(name, len(getattr(self, name)), f"it must have {n} values, one per frequency")
        if not np.all(np.diff(self.frequency) > 0.0) or self.frequency[0] <= 0.0:
            raise InvalidInput("frequency", self.frequency[0], "the frequencies must be positive and ascending")
        return self

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest frequency [Hz] of the model."""
        return self.frequency[0], self.frequency[-1]

    def response(self, frequency: Array) -> NDArray[np.complex128]:
        """The response at `frequency` [Hz], same shape. Raises InvalidInput outside the band, because a response is
        never extrapolated.
        """
        self._require(frequency)
        return np.interp(frequency, self.frequency, self._complex)

    def coherence_at(self, frequency: Array) -> Array:
        """The coherence at `frequency` [Hz] within the band, same shape."""
        self._require(frequency)
        return np.interp(frequency, self.frequency, self.coherence)

    def noise_at(self, frequency: Array) -> Array:
        """Amplitude spectral density of the noise [m/s2/Hz^0.5] at `frequency` [Hz] within the band, same shape."""
        self._require(frequency)
        return np.interp(frequency, self.frequency, self.noise)

    def require_fresh(self, now: datetime, longest: timedelta = LONGEST_AGE) -> None:
        """Raise InvalidInput if the model is older than `longest`, or dated in the future."""
        age = now - self.date
        if not timedelta(0) <= age <= longest:
            hours = longest.total_seconds() / 3600.0
            allowed = (
                f"at {now.isoformat(timespec='seconds')} it must be at most {hours:g} h old, and not in the future; "
                "identify the table again"
            )
            raise InvalidInput("date of the table model", self.date.isoformat(timespec="seconds"), allowed)

    def require_rate(self, sample_rate: float) -> None:
        """Raise InvalidInput if drive and channels run at a rate other than that of the identification."""
        if sample_rate != self.sample_rate:
            allowed = f"the table model was identified at {self.sample_rate:g} 1/s; identify the table again"
            raise InvalidInput("sample_rate", sample_rate, allowed)

    def write(self, path: Path) -> None:
        """Write the model as JSON. Raises InvalidInput if the file exists or cannot be written."""
        try:
            with path.open("x", encoding="utf-8", newline="\n") as file:
                file.write(self.model_dump_json(indent=1) + "\n")
        except FileExistsError:
            raise InvalidInput("table model", str(path), "the file exists and is never overwritten") from None
        except OSError as error:
            raise InvalidInput("table model", str(path), f"the file cannot be written: {error.strerror}") from None

    @staticmethod
    def read(path: Path) -> "TableModel":
        """The model in a JSON file. Raises InvalidInput naming the unreadable file or the key with an invalid value."""
        try:
            data: Any = json.loads(read_bounded(path).decode())
            require_shallow(data)
        except FileNotFoundError:
            raise InvalidInput("table model", str(path), "there is no such file") from None
        except OSError as error:
            raise InvalidInput(
                "table model", str(path), f"the file cannot be read ({error.strerror}); check its path and permissions"
            ) from None
        except (ValueError, RecursionError) as error:
            raise InvalidInput("table model", str(path), f"the file cannot be read as JSON: {error}") from None
        return validated(TableModel, data)

    @property
    def _complex(self) -> NDArray[np.complex128]:
        return np.array(self.real) + 1j * np.array(self.imaginary)

    def _require(self, frequency: Array) -> None:
        low, high = self.band
        outside = frequency[(frequency < low * (1.0 - ROUNDING)) | (frequency > high * (1.0 + ROUNDING))]
        if outside.size:
            allowed = f"the table model is valid from {low:g} to {high:g} Hz; identify the table in a wider band"
            raise InvalidInput("frequency", float(outside[0]), allowed)


Complex = NDArray[np.complex128]

REGULARISATION = 1e-3
"""eps: a line whose response is below this fraction of the largest receives less than half the drive that an exact
inverse requires.
"""

_TINY = 1e-12
"""Fraction of the largest power below which a line contains only rounding errors."""


class TableInverse:
    """Conversion between drive and acceleration at the lines of a target's transform within the target's support.

    Spectra are `numpy.fft.rfft` of whole records at those lines, shape (n_lines,).
    """

    def __init__(self, model: TableModel, target: Target) -> None:
        """Raises InvalidInput if the model does not cover the target's support or has a different sample rate."""
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
        """The lines of a record's spectrum within the support."""
        return np.fft.rfft(record)[self._inside]

    def record(self, spectrum: Complex) -> Array:
        """The record with this `spectrum` within the support and zero outside it."""
        whole = np.zeros(self._inside.size, dtype=np.complex128)
        whole[self._inside] = spectrum
        return np.fft.irfft(whole, self._size)

    def predicted(self, volts: Array) -> Array:
        """Table acceleration [m/s2] predicted for a drive, within the support."""
        return self.record(self._response * self.spectrum(volts))

    def correction(self, missing: Complex, noise: Array) -> Array:
        """Correction of the drive [V], at unit gain, for the spectrum of the `missing` acceleration.

        Every line is weighted by its coherence and by the fraction of its power that is not `noise`, so that the drive
        does not reproduce noise.
        """
        power = octave_mean(np.abs(missing) ** 2, self.frequency)
        real_share = np.maximum(1.0 - noise / np.maximum(power, _TINY * power.max(initial=1e-300)), 0.0)
        size = np.abs(self._response) ** 2
        inverse = np.conj(self._response) / (size + REGULARISATION**2 * size.max())
        return self.record(self.window * self._coherence * real_share * inverse * missing)

    def refine(self, volts: Array, measured: Complex) -> None:
        """Update the response from the smooth, coherent part of the response measured in a pass."""
        predicted = self._response * self.spectrum(volts)
        cross = octave_mean(np.conj(predicted) * measured, self.frequency)
        input_power = octave_mean(np.abs(predicted) ** 2, self.frequency)
        output_power = octave_mean(np.abs(measured) ** 2, self.frequency)
        input_power = np.maximum(input_power, _TINY * input_power.max())
        output_power = np.maximum(output_power, _TINY * output_power.max())
        coherence = np.abs(cross) ** 2 / (input_power * output_power)
        self._response = self._response * (1.0 + coherence * (cross / input_power - 1.0))
