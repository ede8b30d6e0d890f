"""What has been identified of the table: its response to the drive, how certain, where, when and at what level."""

import json
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import AwareDatetime, model_validator

from bench.config.validation import validated
from sim.errors import InvalidInput
from sim.parameters import Parameters, quantity

Array = NDArray[np.float64]

Values = tuple[float, ...]

LONGEST_AGE = timedelta(hours=12)
"""Age after which a model is refused unless a protocol says otherwise: coil and guides have another temperature."""


class TableModel(Parameters):
    """Table acceleration per drive [m/s2/V] at ascending frequencies, everything of shape (n_lines,).

    The response holds what lies between a drive sample and the sample of the channel: hold, amplifier, table,
    specimen, filter card. Convention exp(+i omega t).
    """

    date: AwareDatetime = quantity(..., "", "when the table was identified")
    specimen: str = quantity(..., "", "what stood on the table")
    sample_rate: float = quantity(..., "1/s", "samples per second of drive and channels", gt=0)
    level: float = quantity(..., "m/s2", "root mean square of the table acceleration during the identification", gt=0)
    frequency: Values = quantity(..., "Hz", "lines of the identification, ascending", min_length=2)
    real: Values = quantity(..., "m/s2/V", "real part of the response")
    imaginary: Values = quantity(..., "m/s2/V", "imaginary part of the response")
    uncertainty: Values = quantity(..., "m/s2/V", "standard uncertainty of the response, noise and distortion together")
    distortion: Values = quantity(..., "m/s2/V", "standard deviation of the response by nonlinear distortion alone")
    coherence: Values = quantity(..., "1", "share of the acceleration's power that the drive explains")
    noise: Values = quantity(..., "m/s2/Hz^0.5", "spectral density of the noise in the acceleration")

    @model_validator(mode="after")
    def _lines_of_one_length(self) -> "TableModel":
        n = len(self.frequency)
        for name in ("real", "imaginary", "uncertainty", "distortion", "coherence", "noise"):
            if len(getattr(self, name)) != n:
                raise InvalidInput(name, len(getattr(self, name)), f"there are {n} frequencies: as many values belong")
        if not np.all(np.diff(self.frequency) > 0.0) or self.frequency[0] <= 0.0:
            raise InvalidInput("frequency", self.frequency[0], "the frequencies must be positive and ascend")
        return self

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest frequency [Hz] for which the model holds."""
        return self.frequency[0], self.frequency[-1]

    def response(self, frequency: Array) -> NDArray[np.complex128]:
        """The response at `frequency` [Hz], same shape. InvalidInput outside the band: nothing is extrapolated."""
        self._require(frequency)
        return np.interp(frequency, self.frequency, self._complex)

    def coherence_at(self, frequency: Array) -> Array:
        """The coherence at `frequency` [Hz] within the band, same shape."""
        self._require(frequency)
        return np.interp(frequency, self.frequency, self.coherence)

    def noise_at(self, frequency: Array) -> Array:
        """Density of the noise [m/s2/Hz^0.5] at `frequency` [Hz] within the band, same shape."""
        self._require(frequency)
        return np.interp(frequency, self.frequency, self.noise)

    def require_fresh(self, now: datetime, longest: timedelta = LONGEST_AGE) -> None:
        """Raise InvalidInput when the model is older than `longest`, or not from the past."""
        age = now - self.date
        if not timedelta(0) <= age <= longest:
            hours = longest.total_seconds() / 3600.0
            allowed = (
                f"at {now.isoformat(timespec='seconds')} it must be at most {hours:g} h old; identify the table again"
            )
            raise InvalidInput("date of the table model", self.date.isoformat(timespec="seconds"), allowed)

    def require_rate(self, sample_rate: float) -> None:
        """Raise InvalidInput when drive and channels run at another rate than during the identification."""
        if sample_rate != self.sample_rate:
            allowed = f"the table model was identified at {self.sample_rate:g}; identify the table again"
            raise InvalidInput("sample_rate", sample_rate, allowed)

    def write(self, path: Path) -> None:
        """Write the model as JSON; InvalidInput when the file exists or cannot be written."""
        try:
            with path.open("x", encoding="utf-8", newline="\n") as file:
                file.write(self.model_dump_json(indent=1) + "\n")
        except FileExistsError:
            raise InvalidInput("table model", str(path), "it exists already; it is never overwritten") from None
        except OSError as error:
            raise InvalidInput("table model", str(path), f"it cannot be written: {error.strerror}") from None

    @staticmethod
    def read(path: Path) -> "TableModel":
        """The model in a JSON file. Raises InvalidInput naming file and key."""
        try:
            data: Any = json.loads(path.read_text(encoding="utf-8"))
        except FileNotFoundError:
            raise InvalidInput("table model", str(path), "there is no such file") from None
        except OSError as error:
            raise InvalidInput("table model", str(path), f"it cannot be read: {error.strerror}") from None
        except ValueError as error:
            raise InvalidInput("table model", str(path), f"it is not JSON: {error}") from None
        return validated(TableModel, data)

    @property
    def _complex(self) -> NDArray[np.complex128]:
        return np.array(self.real) + 1j * np.array(self.imaginary)

    def _require(self, frequency: Array) -> None:
        low, high = self.band
        outside = frequency[(frequency < low) | (frequency > high)]
        if outside.size:
            allowed = f"the table model holds from {low:g} to {high:g} Hz; identify the table in a wider band"
            raise InvalidInput("frequency", float(outside[0]), allowed)
