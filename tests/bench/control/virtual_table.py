"""The virtual bench as the tests of the table's control use it: identify it, play a drive, make a record."""

from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy import signal as filters

from bench.control.identification import (
    Multisine,
    band_lines,
    drive_amplitudes,
    identify_table,
    multisine,
    steady_periods,
)
from bench.control.preparation import prepare
from bench.control.table_model import TableModel
from bench.control.target import Target
from sim.excitation import SampledRecord
from sim.linear import frame_matrices
from sim.shaker import Shaker
from sim.specimen import Specimen
from sim.virtual_bench import VirtualBench, VirtualBenchParameters

Array = NDArray[np.float64]

RATE = 2000.0
IDENTIFIED = datetime(2026, 5, 4, 12, 0, tzinfo=UTC)


@dataclass(frozen=True)
class Played:
    """What the bench measured, and the true table acceleration; shape (n,)."""

    acceleration: Array
    displacement: Array
    truth: Array


def play(bench: VirtualBench, volts: Array) -> Played:
    """Play a drive on a bench at rest."""
    bench.mount(bench.arrangement)
    bench.run(np.zeros(400))
    counts = bench.run(volts)
    displacement, acceleration = (bench.channels[i].to_unit(counts[:, i]) for i in (0, 1))
    return Played(acceleration, displacement, bench.truth.a.copy())


def bench_with(specimen: Specimen, seed: int = 1, parameters: VirtualBenchParameters | None = None) -> VirtualBench:
    return VirtualBench(parameters or VirtualBenchParameters(), specimen, seed)


def identify(
    bench: VirtualBench, level: float = 0.6, period: float = 8.0, realisations: int = 3, periods: int = 3
) -> TableModel:
    """Identify the table with whatever stands on it, the first period left out, peaks of `level` [m/s2]."""
    signals = _multisines(level, period, realisations)
    drives: list[Array] = []
    accelerations: list[Array] = []
    for signal in signals:
        drive = signal.drive(periods + 1)
        drives.append(steady_periods(drive, signal.samples, 1))
        accelerations.append(steady_periods(play(bench, drive).acceleration, signal.samples, 1))
    return identify_table(
        np.array(drives), np.array(accelerations), signals[0].lines, RATE, date=IDENTIFIED, specimen="as mounted"
    )


@cache
def _multisines(level: float, period: float, realisations: int) -> list[Multisine]:
    """Drives of an identification, which are the same for every bench."""
    samples = round(period * RATE)
    lines = band_lines(samples, RATE, (0.4, 80.0))
    prior = np.abs(Shaker().frequency_response(2.0 * np.pi * lines * RATE / samples))
    amplitudes = drive_amplitudes(lines * RATE / samples, prior, "displacement", 1.0)
    random = np.random.default_rng(5)
    made = (multisine(lines, amplitudes, samples, RATE, random, prior) for _ in range(realisations))
    return [each.scaled_to(level, prior) for each in made]


def closed_form(f: Array, shaker: Shaker, specimen: Specimen, rate: float) -> NDArray[np.complex128]:
    """Table acceleration per drive of the virtual bench with the bare frame, as its channel gives it [m/s2/V].

    Table and storeys in absolute coordinates, the drive held between samples, discretised exactly; the mean over a tick
    that the accelerometer is given; the filter card.
    """
    _, damping, stiffness = frame_matrices(specimen.frame)
    relative = np.array([[-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]])
    mass = np.array([shaker.moving_mass, specimen.frame.m1, specimen.frame.m2])
    k = relative.T @ stiffness @ relative + np.diag([shaker.k_s, 0.0, 0.0])
    c = relative.T @ damping @ relative + np.diag([shaker.c_s + shaker.electric_damping, 0.0, 0.0])
    a = np.block([[np.zeros((3, 3)), np.eye(3)], [-k / mass[:, None], -c / mass[:, None]]])
    b = np.zeros((6, 1))
    b[3] = shaker.force_per_volt / shaker.moving_mass
    velocity = np.eye(6)[3:4]
    step, push, *_ = filters.cont2discrete((a, b, velocity, np.zeros((1, 1))), 1 / rate)
    z = np.exp(2j * np.pi * f / rate)
    moved = np.array([(velocity @ np.linalg.solve(zi * np.eye(6) - step, push))[0, 0] for zi in z])
    card = filters.sosfreqz(filters.butter(4, 100.0, fs=rate, output="sos"), 2 * np.pi * f / rate)[1]
    return moved * (1 - 1 / z) * rate * card


def target_of(record: Array, dt: float, band: tuple[float, float]) -> Target:
    """The part of a record that a table can make, at RATE, neither trimmed nor scaled."""
    return prepare(SampledRecord(record, dt), band=band, peak=None, trim=None).target(RATE)


def earthquake(seed: int, duration: float = 20.0, dt: float = 0.01) -> tuple[Array, float]:
    """A record of filtered noise with an envelope and strong low frequencies, greatest value 1 m/s2; and its step."""
    n = round(duration / dt)
    t, f = dt * np.arange(n), np.fft.rfftfreq(n, dt)
    shape = np.exp(-((f / 6.0) ** 2)) * (1.0 + 8.0 / (1.0 + (f / 0.4) ** 4))
    values = np.fft.irfft(np.fft.rfft(np.random.default_rng(seed).standard_normal(n)) * shape, n)
    values *= (t / 3.0) ** 2 * np.exp(2.0 * (1.0 - t / 3.0))
    return values / np.abs(values).max(), dt
