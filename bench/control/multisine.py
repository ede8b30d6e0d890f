"""The signal that identifies the table: a periodic multisine with random phases.

Its lines lie on the grid of the period, so a whole number of periods in steady state has no leakage; between the
periods of one realisation only noise differs, between realisations with other phases nonlinear distortion as well
(Pintelon and Schoukens, System Identification, 2nd ed., ch. 4). The crest factor is lowered by clipping the
waveform and giving its phases to the wanted amplitudes, again and again (Van der Ouderaa, Schoukens and Renneboog,
IEEE Trans. Instrum. Meas. 37, 1988).
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.random import Generator
from numpy.typing import NDArray

from sim.errors import InvalidInput

Array = NDArray[np.float64]
Lines = NDArray[np.int64]
Complex = NDArray[np.complex128]

Quantity = Literal["displacement", "velocity", "acceleration"]

_CLIPPINGS = 200
"""Rounds of clipping: the crest factor falls from about 3.5 to 1.5, in less than 0.1 s for 16 000 samples."""
_FIRST_CLIP, _LAST_CLIP = 0.75, 0.95
"""Level of the clipping over the peak in the first and in the last round."""


@dataclass(frozen=True)
class Multisine:
    """One period of drive, made of `lines` (multiples of the period's frequency) with complex `spectrum` [V].

    The amplitude of line k is |spectrum[k]|; both have shape (n_lines,). `samples` in a period, `sample_rate` [1/s].
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
        """The same multisine with a peak of `peak` units in what a linear `response` [unit/V] at its lines makes."""
        made = float(np.abs(waveform(self.lines, self.spectrum * response, self.samples)).max())
        return replace(self, spectrum=self.spectrum * (peak / made))

    def drive(self, periods: int) -> Array:
        """`periods` periods of volts, one after the other."""
        return np.tile(self.volts, periods)


def band_lines(samples: int, sample_rate: float, band: tuple[float, float], *, odd: bool = False) -> Lines:
    """The lines of a period of `samples` within `band` [Hz], ends included; only every other one if `odd`.

    Odd lines carry no distortion of even order. Raises InvalidInput for a band without lines or beyond half the
    sample rate.
    """
    low, high = band
    if not 0.0 < low < high < 0.5 * sample_rate:
        allowed = f"it must go up from above 0 to below half the sample rate, {0.5 * sample_rate:g} Hz"
        raise InvalidInput("band of the multisine", band, allowed)
    spacing = sample_rate / samples
    lines = np.arange(int(np.ceil(low / spacing - 1e-9)), int(np.floor(high / spacing + 1e-9)) + 1)
    if odd:
        lines = lines[lines % 2 == 1]
    if lines.size == 0:
        raise InvalidInput("band of the multisine", band, f"it holds no line: they are {spacing:g} Hz apart")
    return lines.astype(np.int64)


def drive_amplitudes(frequency: Array, gain: Array, flat: Quantity, corner: float) -> Array:
    """Relative amplitudes of the drive at `frequency` [Hz] for a motion that is flat in `flat` up to `corner` [Hz]
    and flat in acceleration above, shape (n,).

    `gain` is the table's acceleration per volt as far as it is known, shape (n,): a first `DriveCalibration` will do.
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

    The crest factor is that of the drive or, where a `response` at the lines is given, of what it makes of the drive:
    the acceleration that a standing block must not be lifted by. Every realisation of an identification takes another
    seed, or the same generator again.
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
