"""Ensemble of specimens drawn from the uncertainty of one: their motions and gains under the same table motion."""

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from math import tau

import numpy as np
from numpy.typing import NDArray

from bench.analysis.fall import FALLEN_TILT
from bench.config.model import BenchConfiguration
from sim.linear import steady_peaks
from sim.specimen import Specimen
from sim.streaming import Stream

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Members:
    """Members of an ensemble: n specimens, the nominal one first, and `scales`, the ratios of true to measured table
    motion, shape (n,).
    """

    specimens: Sequence[Specimen]
    scales: Array

    def bare(self) -> "Members":
        """Return the members without the block and the spring."""
        return Members([specimen.bare() for specimen in self.specimens], self.scales)

    def first(self, n: int) -> "Members":
        """Return the first `n` members."""
        return Members(self.specimens[:n], self.scales[:n])


def draw_members(specimen: Specimen, configuration: BenchConfiguration) -> Members:
    """Draw members reproducibly from the uncertainties of `specimen` and of the scale of the table's accelerometer; the
    first member is `specimen`.
    """
    twin, random = configuration.twin, np.random.default_rng(configuration.twin.seed)
    others = configuration.known.draws(specimen, twin.members, random)
    scales = 1.0 + configuration.sensors.table_scale * random.standard_normal(twin.members)
    return Members([specimen, *others], np.concatenate(([1.0], scales)))


class Ensemble:
    """Integrates the motions of the members, from rest, under table accelerations sampled every `dt` [s]."""

    def __init__(self, those: Members, dt: float) -> None:
        self._scales = those.scales
        self._streams = [
            Stream(specimen, dt, peaks_from=None, overturning_angle=FALLEN_TILT) for specimen in those.specimens
        ]
        for stream in self._streams:
            # the table is at rest before the first sample
            stream.feed([0.0])

    def __len__(self) -> int:
        return len(self._streams)

    def keep(self, n: int) -> None:
        """Drop all but the first `n` members."""
        del self._streams[n:]

    def feed(self, acceleration: Array) -> Array:
        """Storey displacements u1, u2 [m] and block rotation theta [rad], shape (3, n_members, n), under the next table
        accelerations [m/s2], shape (n,).

        The values of a member are NaN after its block has fallen. Raises InvalidInput for accelerations that are not
        finite.
        """
        motions = np.full((3, len(self._streams), acceleration.size), np.nan)
        for k, (stream, scale) in enumerate(zip(self._streams, self._scales, strict=False)):
            states = stream.feed(scale * acceleration)
            motions[:, k, : len(states)] = states[:, [0, 1, 4]].T
        return motions


_CYCLES = 5.0
"""Number of cycles of a sine over which the peak drift and the amplitude of the table's acceleration are evaluated."""


@dataclass(frozen=True)
class Measured:
    """Measured gain `alpha_2`, as published by the protocol, under a sine of `omega` [rad/s] or, if `omega` is None,
    under an earthquake record.
    """

    alpha_2: float
    omega: float | None


class Gains:
    """Gain alpha_2 of every member during one run: ratio of its peak drifts with and without the block."""

    def __init__(self, those: Members, dt: float) -> None:
        self._those, self._dt = those, dt
        self._coupled = those.specimens[0].beta is not None
        self._peaks = np.zeros(len(those.specimens))
        self._bare_peaks = np.zeros(len(those.specimens))
        self._bare: Ensemble | None = None
        self._bare_per_unit: tuple[float, Array] | None = None
        # the accelerations and peak drifts still required: all of them until the kind of test is known
        self._held: deque[tuple[Array, Array]] = deque()

    def push(self, acceleration: Array, drift: Array, measured: Measured | None) -> Array:
        """Add accelerations [m/s2], shape (n,), and drifts [m], shape (k, n), of the k remaining members.

        Returns alpha_2 of the members, shape (k,). It is NaN for specimens without a block, after a member's block has
        fallen, while `measured` is None, and during the first cycles of a sine.
        """
        k = len(drift)
        if not self._coupled:
            return np.full(k, np.nan)
        largest = np.abs(drift).max(axis=1, initial=0.0)
        self._peaks = np.maximum(self._peaks[:k], largest)
        self._held.append((acceleration, largest))
        if measured is None:
            return np.full(k, np.nan)
        return self._under_record(k) if measured.omega is None else self._under_sine(measured.omega, k)

    def _under_sine(self, omega: float, k: int) -> Array:
        needed = round(_CYCLES * tau / omega / self._dt)
        held = sum(part.size for part, _ in self._held)
        while held - self._held[0][0].size >= needed:
            held -= self._held.popleft()[0].size
        if held < needed:
            return np.full(k, np.nan)
        acceleration = np.concatenate([part for part, _ in self._held])[-needed:]
        phase = omega * self._dt * np.arange(needed)
        waves = np.column_stack((np.cos(phase), np.sin(phase), np.ones(needed)))
        amplitude = float(np.hypot(*np.linalg.lstsq(waves, acceleration)[0][:2]))
        if self._bare_per_unit is None or self._bare_per_unit[0] != omega:
            drifts = [steady_peaks(specimen.bare(), omega, 1.0).drift for specimen in self._those.specimens]
            self._bare_per_unit = omega, np.array(drifts)
        bare = amplitude * (self._those.scales * self._bare_per_unit[1])[:k]
        return _ratio(np.array([largest[:k] for _, largest in self._held]).max(axis=0), bare)

    def _under_record(self, k: int) -> Array:
        if self._bare is None:
            self._bare = Ensemble(self._those.bare(), self._dt)
        self._bare.keep(k)
        u1, u2, _ = self._bare.feed(np.concatenate([part for part, _ in self._held]))
        self._held.clear()
        self._bare_peaks = np.maximum(self._bare_peaks[:k], np.abs(u2 - u1).max(axis=1, initial=0.0))
        return _ratio(self._peaks, self._bare_peaks)


def _ratio(coupled: Array, bare: Array) -> Array:
    return np.divide(coupled, bare, out=np.full(len(coupled), np.nan), where=bare > 0.0)
