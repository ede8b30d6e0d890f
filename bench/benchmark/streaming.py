"""The streaming form: 20 000 states a second read off while the base's acceleration comes block by block."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from bench.benchmark.records import ROCKING, ROCKING_OMEGA, ROCKING_PHASE, ROCKING_START
from bench.benchmark.section import Cell, Column, Section, Target
from bench.benchmark.timing import timed
from bench.comparators.catalogue import solve
from sim.excitation import SampledRecord
from sim.streaming import Stream

RATE = 20_000
"""States read off per second."""

BLOCK = 0.05
"""Seconds handed over at once."""

CHECKED = 0.5
"""Seconds compared with another integrator."""

COLUMNS = (
    Column("drive_hz", "updates of the drive [1/s]", "d"),
    Column("error", "error, first 0.5 s", ".1e"),
    Column("bitwise", "other blocks: same bits", "s"),
    Column("min_ms", "min [ms]", ".4g"),
    Column("median_ms", "median [ms]", ".4g"),
    Column("times_real_time", "times real time", ".0f"),
)


def streaming(duration: float, repetitions: int, drives: Sequence[int] = (1_000, 2_000, 20_000)) -> Section:
    """Steady rocking for `duration` [s] on one core, at several rates of the drive's updates."""
    rows = [_row(rate, duration, repetitions) for rate in drives]
    fastest = rows[0]["times_real_time"]
    notes = (
        f"{RATE} states per second, blocks of {1e3 * BLOCK:g} ms, peaks watched, block rocking throughout. The target "
        "is for the first row: between two updates of the drive the motion is smooth.",
        "Error of the end state in SI units against dop853 at 1e-13.",
    )
    share = 200.0 / fastest if isinstance(fastest, float) else None
    targets = (Target("streaming: 200 over times real time", 1.0, share, "1"),)
    return Section("streaming", "Streaming", COLUMNS, rows, notes, targets)


def _row(rate: int, duration: float, repetitions: int) -> dict[str, Cell]:
    t = np.arange(round(duration * rate) + 1) / rate
    wave = 1.01 * ROCKING.uplift_acceleration * np.sin(ROCKING_OMEGA * t + ROCKING_PHASE)
    timing = timed(lambda: _stream(wave, rate, round(BLOCK * rate)), repetitions)
    short = wave[: round(CHECKED * rate) + 1]
    truth = solve("dop853", ROCKING, SampledRecord(short, 1.0 / rate), state=ROCKING_START, tolerance=1e-13)
    found = _stream(short, rate, round(BLOCK * rate))[-1]
    same = bool((_stream(wave, rate, round(BLOCK * rate)) == _stream(wave, rate, 137)).all())
    return {
        "drive_hz": rate,
        "error": float(np.abs(found - truth.end.as_array()).max()),
        "bitwise": same,
        "min_ms": 1e3 * timing.minimum,
        "median_ms": 1e3 * timing.median,
        "times_real_time": duration / timing.minimum,
    }


def _stream(wave: NDArray[np.float64], rate: int, block: int) -> NDArray[np.float64]:
    """All states read off, shape (n, 6)."""
    stream = Stream(ROCKING, 1.0 / rate, state=ROCKING_START, divisions=RATE // rate)
    return np.concatenate([stream.feed(wave[k : k + block]) for k in range(0, wave.size, block)])
