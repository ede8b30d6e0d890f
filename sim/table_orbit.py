"""Steady rocking on a table moved by the reaction of the specimen: its orbit and Floquet multipliers.

The motion of the table is part of the state: a disturbance of the block moves the table, which changes the stability of
the orbit, so that the same orbit may be stable on a light table and unstable on fixed ground. The drive is periodic,
and the same in every cycle, since a slow amplitude control hardly changes it within a few cycles. Its harmonics are
such that the acceleration of the table is a sine.
"""

from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import exp, tau

import numpy as np
from numpy.typing import NDArray

from sim.arrangement import plant_of
from sim.excitation import SineProgram, Sweep
from sim.rocking import simulate
from sim.shaker import Shaker
from sim.specimen import Specimen
from sim.steady import NoOrbit, Orbit, slowest_of

Array = NDArray[np.float64]

TICKS, SUBSTEPS = 600, 2
"""Number of intervals of constant drive per period, and Runge-Kutta steps in each; the error of the multipliers is then
about 4e-5.
"""

STEP = 1e-5
"""Step of the finite differences, relative to the scale of each state."""

CLOSED, QUICK = 1e-9, 0.2
"""Relative mismatch over a period up to which an orbit counts as closed, and ratio of successive mismatches up to which
the derivatives are reused.
"""

PURE = 1e-4
"""Largest deviation of a harmonic of the table's acceleration from the requested sine, relative to the fundamental."""

NEWTON, CORRECTIONS = 20, 12
"""Maximum number of Newton steps, and of corrections of the drive."""


@dataclass(frozen=True, eq=False)
class TableOrbit:
    """Steady rocking on the table.

    `start`, shape (8,), is the state [x, v, u1, u2, v1, v2, theta, omega] at the start of the period, at the `phase`
    [rad] of the base's sine. `drive` and `acceleration`, shape (H,), are the complex harmonics of the amplifier's
    command [V or A] and of the table's acceleration [m/s2]. `multipliers`, shape (8,), are the complex Floquet
    multipliers of table and specimen together. `drift` [m] is the peak drift.
    """

    omega: float
    phase: float
    start: Array
    drive: NDArray[np.complex128]
    acceleration: NDArray[np.complex128]
    multipliers: NDArray[np.complex128]
    drift: float

    @cached_property
    def slowest(self) -> complex:
        """Multiplier with the greatest modulus; of a conjugate pair, the one in the upper half plane."""
        return slowest_of(self.multipliers)

    @property
    def stable(self) -> bool:
        """Whether small disturbances of specimen and table decay."""
        return abs(self.slowest) < 1.0


def table_orbit(fixed: Orbit, shaker: Shaker, harmonics: int = 5) -> TableOrbit:
    """Orbit on the table of `shaker` that corresponds to the rocking orbit `fixed` on fixed ground.

    The drive contains the harmonics 1 to `harmonics`, of which the table's acceleration has only the fundamental, with
    the amplitude of `fixed`. Raises NoOrbit if Newton's method does not find the orbit, or the block comes to rest or
    falls. Recent orbits are kept: parts of a run that need the same one share it, and its arrays cannot be written.
    """
    return _found(_Sought(fixed, shaker, harmonics))


class _Sought:
    """Arguments of `table_orbit`, equal to others with the same parameters and the same start of the orbit."""

    def __init__(self, fixed: Orbit, shaker: Shaker, harmonics: int) -> None:
        self.fixed, self.shaker, self.harmonics = fixed, shaker, harmonics
        orbit = fixed.specimen, fixed.omega, fixed.amplitude, fixed.phase, fixed.start
        self._key = *orbit, shaker, harmonics

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Sought) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)


@lru_cache(maxsize=64)
def _found(sought: _Sought) -> TableOrbit:
    fixed, shaker, harmonics = sought.fixed, sought.shaker, sought.harmonics
    period = TablePeriod(fixed.specimen, shaker, fixed.omega)
    phase, start = _widest(fixed)
    orders: Array = np.arange(1.0, harmonics + 1.0)
    wanted = np.zeros(harmonics, dtype=np.complex128)
    # the base's sine as coefficients of exp(i k omega t)
    wanted[0] = -1j * fixed.amplitude * np.exp(1j * phase)
    frequencies: Array = orders * fixed.omega
    response = shaker.gain / shaker.frequency_response(frequencies, fixed.specimen.mass)
    drive = wanted * response
    for _ in range(CORRECTIONS):
        start = period.closed(start, drive)
        _, samples = period.run(start, drive)
        found = harmonics_of(samples[:, -1], harmonics)
        error = wanted - found
        if float(np.abs(error).max()) <= PURE * fixed.amplitude:
            jacobian = period.jacobian(start, drive)
            drift = float(np.abs(samples[:, 3] - samples[:, 2]).max())
            multipliers = np.linalg.eigvals(jacobian).astype(np.complex128)
            for shared in (start, drive, found, multipliers):
                shared.setflags(write=False)
            return TableOrbit(fixed.omega, phase, start, drive, found, multipliers, drift)
        drive = drive + error * response
    raise NoOrbit(
        f"no drive was found that keeps the table's motion sinusoidal at omega = {fixed.omega:g} rad/s "
        "while the block rocks"
    )


def harmonics_of(accelerations: Array, harmonics: int) -> NDArray[np.complex128]:
    """Harmonics 1 to `harmonics` of an acceleration, from its means over the ticks of a period."""
    orders = np.arange(1.0, harmonics + 1.0)
    found = 2.0 * np.fft.rfft(accelerations)[1 : harmonics + 1] / accelerations.size
    # a mean over a tick has the phase of the middle of the tick
    return found * np.exp(-1j * np.pi * orders / accelerations.size)


def corner(state: Array) -> int:
    """Contact mode of a rocking block in `state`."""
    from sim.kernel.plant import ROCK_A, ROCK_B

    return ROCK_A if state[6] > 0.0 else ROCK_B


def _widest(fixed: Orbit) -> tuple[float, Array]:
    """Phase of the base's sine [rad] and state at the largest angle of the block, away from impacts."""
    times = np.arange(256) * (fixed.period / 256)
    program = SineProgram([Sweep.dwell(1.5 * fixed.period, fixed.amplitude, fixed.omega)], phase=fixed.phase)
    motion = simulate(fixed.specimen, program, state=fixed.start, sample_times=times, peaks_from=None)
    if motion.samples is None or len(motion.samples) < times.size:
        raise NoOrbit(f"the orbit at omega = {fixed.omega:g} rad/s is too unstable to be followed over one period")
    at = int(np.argmax(np.abs(motion.samples[:, 4])))
    phase = (fixed.phase + fixed.omega * times[at]) % tau
    velocity = -fixed.amplitude / fixed.omega * np.cos(phase)
    displacement = -fixed.amplitude / fixed.omega**2 * np.sin(phase)
    return phase, np.concatenate(([displacement, velocity], motion.samples[at]))


class TablePeriod:
    """One period of table and specimen under a periodic drive that is held constant in each of `ticks` intervals."""

    def __init__(
        self, specimen: Specimen, shaker: Shaker, omega: float, ticks: int = TICKS, substeps: int = SUBSTEPS
    ) -> None:
        from sim.kernel import table

        self._stream, self._substeps = table.stream, substeps
        self._plant = plant_of(specimen, shaker, catch_angle=np.pi / 2)
        self._omega, self._tick = omega, tau / omega / ticks
        self._decay = exp(-self._tick / shaker.amplifier_lag) if shaker.amplifier_lag > 0.0 else 0.0
        # each command is held for a tick, so that its phase is that of the middle of the tick
        self._phase = np.asarray((np.arange(ticks) + 0.5) * (tau / ticks), dtype=np.float64)
        self._harmonics = np.empty((ticks, 0), dtype=np.complex128)
        self._step: Array | None = None

    def commands(self, drive: NDArray[np.complex128]) -> Array:
        """Commands in the ticks of a period, shape (ticks,), from the complex harmonics `drive`, shape (H,)."""
        if self._harmonics.shape[1] != drive.size:
            # the same in all periods of an orbit
            self._harmonics = np.exp(1j * np.outer(self._phase, np.arange(1, drive.size + 1)))
        return np.ascontiguousarray((self._harmonics @ drive).real)

    def output(self, commands: Array) -> float:
        """Output of the amplifier at the end of the last of many periods with these `commands`, shape (ticks,): their
        mean with the exponential weights of the amplifier's lag.
        """
        weights = (1.0 - self._decay) * self._decay ** np.arange(commands.size - 1.0, -1.0, -1.0)
        return float(weights @ commands) / (1.0 - self._decay**commands.size)

    def advance(self, mode: int, y: Array, carried: Array, commands: Array) -> tuple[int, Array]:
        """Advance by one period. Returns the mode after it, and the samples, shape (ticks, 9).

        The last column of the samples is the mean acceleration in the tick that follows the sample. Updates the state
        `y`, shape (8,), and `carried` (see `sim.kernel.table.stream`).
        """
        samples = np.empty((commands.size, 9))
        after = self._stream(
            self._plant, self._tick, self._substeps, commands, np.zeros(commands.size), mode, y, carried, samples
        )
        samples[:-1, -1] = samples[1:, -1]
        samples[-1, -1] = carried[1]
        return after, samples

    def run(
        self, start: Array, drive: NDArray[np.complex128], changes: tuple[Array, Array] | None = None
    ) -> tuple[Array, Array]:
        """Return the state after one period and the samples (see `advance`).

        `changes`, shape (ticks,) each, are added to the commands of the periods before, and to those of this period.
        Raises NoOrbit if the block does not end the period rocking about the corner at which it started.
        """
        commands, y, mode = self.commands(drive), start.copy(), corner(start)
        before, now = (0.0, 0.0) if changes is None else changes
        carried = np.array([self.output(commands + before), 0.0])
        after, samples = self.advance(mode, y, carried, commands + now)
        if after != mode:
            raise NoOrbit(f"the block does not rock with the period of the drive at omega = {self._omega:g} rad/s")
        return y, samples

    def closed(self, start: Array, drive: NDArray[np.complex128]) -> Array:
        """Start of the closed orbit under this drive, by Newton's method. The derivatives are reused while each step
        reduces the mismatch to at most the fraction `QUICK`.
        """
        y, before = start, np.inf
        for _ in range(NEWTON):
            mismatch = self.run(y, drive)[0] - y
            size = float(np.abs(mismatch / self.scales(y)).max())
            if size <= CLOSED:
                return y
            if self._step is None or size > QUICK * before:
                self._step = np.asarray(np.linalg.inv(np.eye(y.size) - self.jacobian(y, drive)), dtype=np.float64)
            y, before = y + self._step @ mismatch, size
        raise NoOrbit(f"no steady rocking on the table was found at omega = {self._omega:g} rad/s")

    def jacobian(self, start: Array, drive: NDArray[np.complex128]) -> Array:
        """Derivatives of the state after one period with respect to the state before it, by central differences."""
        columns = list[Array]()
        for step in np.diag(STEP * self.scales(start)):
            ahead, behind = self.run(start + step, drive)[0], self.run(start - step, drive)[0]
            columns.append((ahead - behind) / (2.0 * step.max()))
        return np.stack(columns, axis=1)

    def scales(self, y: Array) -> Array:
        """Scales of the states: largest displacement and angle in `y`, multiplied by omega for velocities."""
        lengths, angle = float(np.abs(y[[0, 2, 3]]).max()), abs(float(y[6]))
        rates = np.array([1.0, self._omega, 1.0, 1.0, self._omega, self._omega, 1.0, self._omega])
        return rates * np.where(np.arange(8) < 6, lengths, angle)
