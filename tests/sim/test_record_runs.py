"""Runs in memory that is used again have the bits of single runs, whatever was integrated before."""

import numpy as np
import pytest

from sim.errors import InvalidInput
from sim.excitation import SampledRecord
from sim.record_runs import BLOCK, RecordRuns
from sim.rocking import Motion, Status, simulate
from sim.specimen import Specimen

DT = 0.001
T = np.arange(2 * BLOCK + 501) * DT


def wave(scale: float, seed: int) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    noise = np.random.default_rng(seed).standard_normal(T.size)
    return scale * np.sin(16.0 * T) * np.sin(np.pi * T / T[-1]) + 0.05 * noise


def content(motion: Motion) -> tuple[object, ...]:
    return motion.status, motion.end_time, motion.end, motion.peaks, motion.impacts, motion.steps


def test_every_run_has_the_bits_of_a_single_one() -> None:
    runs = RecordRuns(T.size, DT)
    endings = set[Status]()
    for k, (scale, beta) in enumerate([(1.6, 0.4), (9.0, 0.25), (0.5, None), (1.6, 0.64), (0.3, 0.4)]):
        specimen, record = Specimen(beta=beta), wave(scale, k)
        found = runs.run(specimen, record, tolerance=1e-8, overturning_angle=0.35)
        alone = simulate(specimen, SampledRecord(record, DT), tolerance=1e-8, overturning_angle=0.35)
        assert content(found) == content(alone)
        endings.add(found.status)
    assert len(endings) > 1


@pytest.mark.parametrize("values", [np.zeros(T.size - 1), np.full(T.size, np.nan)])
def test_another_length_or_missing_numbers_are_refused(values: np.ndarray[tuple[int], np.dtype[np.float64]]) -> None:
    with pytest.raises(InvalidInput, match="finite samples"):
        RecordRuns(T.size, DT).run(Specimen(), values)
