"""Samples of channels of recorded runs: intervals at screen resolution, values at given times and amplitude spectra."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.app.display import texts
from bench.app.ipc.messages import extremes
from bench.datafile.reader import DataFile, open_datafile
from sim.errors import InvalidInput

DRIVE = "drive"
"""Channel name of the drive signal."""
CHUNK = 1_000_000
"""Number of rows read at a time, because the samples of a long run may not fit into memory."""
LONGEST = 2_000_000
"""Largest number of samples of a spectrum."""
SHORTEST = 64
"""Smallest number of samples of a spectrum."""
LINES = 2000
"""Largest number of drawn frequencies of a spectrum."""


@dataclass(frozen=True)
class Track:
    """A channel of run number `run` in a data file; `name` is shown in the legend."""

    path: Path
    run: int
    channel: str
    name: str = ""


@dataclass(frozen=True, eq=False)
class Stretch:
    """Samples of a track from `begin` to `end` [s since the rig was armed] as a line through the minimum and the
    maximum of each part, or through the samples themselves. `time` [s] and `values`, in the channel's unit, have shape
    (n,).
    """

    time: NDArray[np.float64]
    values: NDArray[np.float32]
    track: Track
    unit: str
    begin: float
    end: float


@dataclass(frozen=True)
class Probe:
    """Samples of `tracks` at `times` [s]: for each track one value per time, in the channel's unit; NaN outside the
    run.
    """

    tracks: Sequence[Track]
    times: tuple[float, float]
    values: list[list[float]]


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Amplitude spectrum of a track: frequencies [Hz] and amplitudes in the channel's unit, both of shape (n,)."""

    frequency: NDArray[np.float64]
    amplitude: NDArray[np.float64]
    track: Track
    unit: str


def read_stretches(tracks: Sequence[Track], begin: float, end: float, parts: int) -> list[Stretch]:
    """Samples of the tracks between two times [s since the rig was armed], reduced to the minimum and the maximum of
    each of fewer than 2 x `parts` parts.

    An interval of fewer than 2 x `parts` samples is returned sample by sample. Raises RockbenchError for an unreadable
    file.
    """
    return [_stretch(record, track, begin, end, parts) for record, track in _opened(tracks)]


def read_values(tracks: Sequence[Track], times: Sequence[float]) -> list[list[float]]:
    """For each track, the samples nearest to the `times` [s since the rig was armed], in the channel's unit; NaN
    outside the run. Raises RockbenchError for an unreadable file.
    """
    found = list[list[float]]()
    for record, track in _opened(tracks):
        rows = _rows(record, track)
        places = [round(time * record.sample_rate) for time in times]
        found.append(
            [
                float(_values(record, track, slice(rows.start + at, rows.start + at + 1))[0])
                if 0 <= at < len(rows)
                else np.nan
                for at in places
            ]
        )
    return found


def probe(tracks: Sequence[Track], times: tuple[float, float]) -> Probe:
    """The samples of the tracks at two cursors. Raises the errors of `read_values`."""
    return Probe(tracks, times, read_values(tracks, times))


def read_spectra(tracks: Sequence[Track], begin: float, end: float) -> list[Spectrum]:
    """Amplitude spectra of all samples of the tracks between two times [s since the rig was armed].

    Missing samples are interpolated, and a track without valid samples is omitted. A spectrum with more than `LINES`
    frequencies is reduced to the largest amplitude in each group of adjacent frequencies. Raises InvalidInput for too
    few or too many samples, and RockbenchError for an unreadable file.
    """
    found = list[Spectrum]()
    for record, track in _opened(tracks):
        rate = record.sample_rate
        part = _part(record, track, begin, end)
        count = part.stop - part.start
        if count > LONGEST:
            raise InvalidInput("range", f"{count} samples", texts.SPECTRUM_LONG.format(most=LONGEST / rate))
        if count < SHORTEST:
            raise InvalidInput("range", f"{count} samples", texts.SPECTRUM_SHORT.format(least=SHORTEST))
        values = _values(record, track, part)
        time = np.arange(count, dtype=np.float64) / rate
        known = np.isfinite(values)
        if not known.any():
            continue
        frequency, amplitude = amplitude_spectrum(time, np.interp(time, time[known], values[known]))
        width = -(-frequency.size // LINES)
        first = np.arange(0, frequency.size, width)
        largest = np.maximum.reduceat(amplitude, first)
        at = [int(start + np.argmax(amplitude[start : start + width])) for start in first]
        found.append(Spectrum(frequency[at], largest, track, _unit(record, track.channel)))
    return found


def amplitude_spectrum(
    time: NDArray[np.float64], values: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Frequencies [Hz] and amplitudes of equally spaced samples, in the unit of the samples, both of shape (n,). The
    mean is removed, and a Hann window is applied; the peak of a sine at one of the frequencies is its amplitude.
    """
    window = np.hanning(values.size)
    lines: NDArray[np.float64] = np.abs(np.fft.rfft((values - values.mean()) * window)) * 2.0 / window.sum()
    return np.asarray(np.fft.rfftfreq(values.size, float(time[1] - time[0])), dtype=np.float64), lines


def _opened(tracks: Sequence[Track]) -> Iterator[tuple[DataFile, Track]]:
    """Every track with its open file, grouped by file, so that each file is opened once."""
    for path in dict.fromkeys(track.path for track in tracks):
        with open_datafile(path) as record:
            for track in tracks:
                if track.path == path:
                    yield record, track


def _rows(record: DataFile, track: Track) -> range:
    return next(each.rows for each in record.runs if each.number == track.run)


def _part(record: DataFile, track: Track, begin: float, end: float) -> slice:
    """Rows of the file with the samples between two times [s since the rig was armed]."""
    rows, rate = _rows(record, track), record.sample_rate
    first = rows.start + min(max(int(begin * rate), 0), len(rows))
    last = rows.start + min(max(int(np.ceil(end * rate)) + 1, 0), len(rows))
    return slice(first, last)


def _values(record: DataFile, track: Track, part: slice) -> NDArray[np.float64]:
    if track.channel == DRIVE:
        return record.drive(part).astype(np.float64)
    return record.values(track.channel, part)


def _unit(record: DataFile, channel: str) -> str:
    return "V" if channel == DRIVE else next(each.unit for each in record.channels if each.name == channel)


def _stretch(record: DataFile, track: Track, begin: float, end: float, parts: int) -> Stretch:
    rate, start = record.sample_rate, _rows(record, track).start
    part = _part(record, track, begin, end)
    first, last = part.start, part.stop
    width = max((last - first) // max(parts, 1), 1)
    lows, highs = [np.zeros(0, np.float32)], [np.zeros(0, np.float32)]
    step = max(CHUNK // width, 1) * width
    for at in range(first, last, step):
        low, high = extremes(_values(record, track, slice(at, min(at + step, last)))[:, None], width)
        lows.append(low[:, 0])
        highs.append(high[:, 0])
    low, high = np.concatenate(lows), np.concatenate(highs)
    time = (first - start + width * np.arange(low.size, dtype=np.float64)) / rate
    unit = _unit(record, track.channel)
    if width == 1:
        return Stretch(time, low, track, unit, begin, end)
    return Stretch(np.repeat(time, 2), np.column_stack((low, high)).ravel(), track, unit, begin, end)
