"""Steady response to a sine, as the solution of a boundary-value problem.

Two branches of periodic motion are computed: the block rocks with two impacts per period of the drive, or it never
lifts. Both motions can coexist. The rocking motion is a fixed point of the return map with the section "just after the
impact into theta > 0". The map covers the full period, because the spring is on one side only, so that the model is not
symmetric in theta.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import isfinite, tau
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sim.errors import InvalidInput, RockbenchError
from sim.excitation import SineProgram, Sweep
from sim.linear import frame_matrices, steady_peaks, steady_response
from sim.return_map import MOST_KNOWN, STEEP, Solution, extrapolated, follow, follow_each, newton, parameters
from sim.rocking import Peaks, State, simulate
from sim.specimen import Specimen

SEED_SPECIMEN, SEED_OMEGA, SEED_AMPLITUDE = Specimen(beta=0.4), 16.0, 1.238512
"""Parameters of a known orbit, from which continuation starts."""

SEED_SECTION = (3.11068, -0.0010828, 0.00037455, 0.049398, -0.11073, 0.67994)
"""Known orbit to five digits, as a start for Newton's method: [phase, u1, u2, v1, v2, omega] on the section."""


class NoOrbit(RockbenchError):
    """Error: no periodic rocking motion was found."""

    error_code = "no_orbit"


def slowest_of(multipliers: NDArray[np.complex128]) -> complex:
    """Multiplier with the greatest modulus; of a conjugate pair, the one in the upper half plane."""
    found = multipliers[int(np.argmax(np.abs(multipliers)))]
    return complex(found.real, abs(found.imag))


@dataclass(frozen=True, eq=False)
class Orbit:
    """Steady motion with the period of the drive.

    `start` is a point of the orbit, at the `phase` [rad] of the base's sine. `peaks` and `impacts` are those of one
    period. `multipliers` are the complex Floquet multipliers, shape (6,) if the block rocks, (4,) if it rests.
    """

    specimen: Specimen
    omega: float
    amplitude: float
    branch: Literal["rocking", "resting"]
    phase: float
    start: State
    peaks: Peaks
    impacts: int
    multipliers: NDArray[np.complex128]

    @property
    def section(self) -> NDArray[np.float64]:
        """Point of the orbit on the return map's section: [phase, u1, u2, v1, v2, omega] at `start`, shape (6,)."""
        x = self.start.as_array()
        return np.array([self.phase, *x[:4], x[5]])

    @property
    def period(self) -> float:
        """2 pi / omega [s]."""
        return tau / self.omega

    @cached_property
    def slowest(self) -> complex:
        """Multiplier with the greatest modulus; of a conjugate pair, the one in the upper half plane."""
        return slowest_of(self.multipliers)

    @cached_property
    def multiplier(self) -> float:
        """Modulus of the dominant Floquet multiplier: factor by which a disturbance changes in one period."""
        return float(np.abs(self.multipliers).max())

    @property
    def stable(self) -> bool:
        """Whether small disturbances decay."""
        return self.multiplier < 1.0

    def samples(self, n: int) -> NDArray[np.float64]:
        """One period in `n` equal steps, shape (n, 4): phase of the base's sine [rad] from 0, u1, u2 [m], theta [rad].

        Raises InvalidInput for n < 1.
        """
        if n < 1:
            raise InvalidInput("n", n, "it must be at least one sample per period")
        phases = np.arange(n) * (tau / n)
        # integrate from the known point to the start of the next period of the base's sine
        wait = -self.phase % tau
        drive = SineProgram([Sweep.dwell(2.0 * self.period, self.amplitude, self.omega)], phase=self.phase)
        motion = simulate(self.specimen, drive, state=self.start, sample_times=(wait + phases) / self.omega)
        if motion.samples is None or len(motion.samples) < n:
            raise NoOrbit(f"the orbit at omega = {self.omega:g} rad/s is too unstable to be drawn over one period")
        table = np.empty((n, 4))
        table[:, 0], table[:, 1:] = phases, motion.samples[:, [0, 1, 4]]
        return table


def rocking_orbit(specimen: Specimen, omega: float, amplitude: float, guess: Orbit | None = None) -> Orbit:
    """Rocking motion of period 2 pi / `omega` [rad/s] under `amplitude` [m/s2] sin(omega t).

    Found by continuation from `guess`, or from a known orbit, in all parameters at once, with adaptive steps. Raises
    InvalidInput for a bare frame or values outside their ranges, and NoOrbit if the continuation does not reach the
    requested parameters.
    """
    check_steady(specimen, omega, amplitude)
    origin, section = _origin(guess)
    return _orbit(specimen, omega, amplitude, _followed(origin, section, specimen, omega, amplitude))


def rocking_orbits(
    specimens: Sequence[Specimen], omega: float, amplitudes: Sequence[float], guess: Orbit
) -> list[Orbit | None]:
    """Rocking orbits of several specimens at `omega` [rad/s], each with its own amplitude [m/s2], by continuation from
    `guess` as in `rocking_orbit`; None where the continuation does not reach the orbit.

    Raises InvalidInput as `rocking_orbit` does.
    """
    cases = list(zip(specimens, amplitudes, strict=True))
    for case in cases:
        check_steady(case[0], omega, case[1])
    if not cases:
        return []
    origin, section = _origin(guess)
    targets = np.concatenate([parameters(specimen, omega, amplitude) for specimen, amplitude in cases])
    found = follow_each(origin, section, targets)
    return [
        None if solution is None else _orbit(specimen, omega, amplitude, solution)
        for (specimen, amplitude), solution in zip(cases, found, strict=True)
    ]


def rocking_branch(specimen: Specimen, omegas: Sequence[float] | NDArray[np.float64], amplitude: float) -> list[Orbit]:
    """Rocking orbits at `omegas` [rad/s], in the given order. The initial value of each is extrapolated from the
    previous ones.

    Raises the errors of `rocking_orbit`.
    """
    places = [float(omega) for omega in omegas]
    branch = branch_solutions(specimen, places, amplitude)
    return [_orbit(specimen, omega, amplitude, branch[omega]) for omega in places]


def branch_solutions(specimen: Specimen, omegas: Sequence[float], amplitude: float) -> dict[float, Solution]:
    """Fixed points for `rocking_branch`, by frequency, with unwrapped phases."""
    known: dict[float, Solution] = {}
    origin, section = _seed()
    for omega in omegas:
        check_steady(specimen, omega, amplitude)
        if omega in known:
            continue
        target, solution = parameters(specimen, omega, amplitude), None
        if len(known) > 1:
            near = list(known)[-MOST_KNOWN:]
            guess = extrapolated(near, [known[place].section for place in near], omega)
            slope = extrapolated(near, [known[place].jacobian for place in near], omega)
            solution = newton(target, guess[None], slope[None]).one(0)
        if solution is None:
            solution = _followed(origin, section, specimen, omega, amplitude)
        known[omega] = solution
        origin, section = target[0], solution.section
    return known


def resting_state(specimen: Specimen, omega: float, amplitude: float) -> Orbit | None:
    """Steady motion in which the block never lifts, in closed form; None where it does not exist.

    It exists if and only if |h_b M A - k_C h1 U1| < b g M, where U1 is the complex amplitude of the frame whose spring
    is attached to the resting block (Eq. 9 and A.3 over a whole period), and |U1| < d, because the spring's length is
    positive. It is stable if the frame is damped. Raises
    InvalidInput as `rocking_orbit` does.
    """
    check_steady(specimen, omega, amplitude)
    if not amplitude < resting_level(specimen, omega):
        return None
    u1, u2 = steady_response(specimen, omega, amplitude, resting=True)
    if specimen.beta and not abs(u1) < specimen.d:
        return None
    return Orbit(
        specimen=specimen,
        omega=omega,
        amplitude=amplitude,
        branch="resting",
        phase=0.0,
        start=State(u1=u1.imag, u2=u2.imag, v1=omega * u1.real, v2=omega * u2.real),
        peaks=steady_peaks(specimen, omega, amplitude, resting=True),
        impacts=0,
        multipliers=np.exp(resting_rates(specimen) * (tau / omega)),
    )


def resting_rates(specimen: Specimen) -> NDArray[np.complex128]:
    """Poles [1/s] (complex eigenvalues) of the frame whose spring is attached to a resting block, shape (4,)."""
    mass, damping, stiffness = frame_matrices(specimen.frame)
    stiffness[0, 0] += specimen.k_c
    first_order = np.zeros((4, 4))
    first_order[:2, 2:] = np.eye(2)
    first_order[2:, :2] = -np.linalg.solve(mass, stiffness)
    first_order[2:, 2:] = -np.linalg.solve(mass, damping)
    return np.linalg.eigvals(first_order).astype(np.complex128)


def resting_level(specimen: Specimen, omega: float) -> float:
    """Amplitude of the base acceleration [m/s2] at which a block that rests in the steady state would begin to lift.

    The moment about a corner, h_b M A - k_C h1 U1, is linear in the amplitude A (Eq. 9 and A.3).
    """
    check_steady(specimen, omega, 1.0)
    frame, block = specimen.frame, specimen.block
    u1, _ = steady_response(specimen, omega, 1.0, resting=True)
    moment = abs(block.h_b * block.mass - specimen.k_c * frame.h1 * u1)
    return block.b * specimen.g * block.mass / moment


def check_steady(specimen: Specimen, omega: float, amplitude: float) -> None:
    """Raise InvalidInput for a bare frame, or unless frequency [rad/s] and amplitude [m/s2] are positive and finite."""
    if specimen.beta is None:
        raise InvalidInput("specimen", "bare frame", "a steady motion with the block requires beta to be 0 or more")
    if not (isfinite(omega) and omega > 0.0):
        raise InvalidInput("omega", omega, "it must be a positive circular frequency in rad/s")
    if not (isfinite(amplitude) and amplitude > 0.0):
        raise InvalidInput("amplitude", amplitude, "it must be a positive acceleration in m/s2")


def _origin(guess: Orbit | None) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Parameters and section from which a continuation starts."""
    if guess is not None and guess.branch == "rocking":
        return parameters(guess.specimen, guess.omega, guess.amplitude)[0], guess.section
    return _seed()


def _seed() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    return parameters(SEED_SPECIMEN, SEED_OMEGA, SEED_AMPLITUDE)[0], np.array(SEED_SECTION)


def _followed(
    origin: NDArray[np.float64], section: NDArray[np.float64], specimen: Specimen, omega: float, amplitude: float
) -> Solution:
    solution, steepness = follow(origin, section, parameters(specimen, omega, amplitude)[0])
    if solution is None:
        reason = ""
        if steepness > STEEP:
            reason = f" (the last orbit found on the way multiplies disturbances by up to {steepness:.2g} per period)"
        raise NoOrbit(
            f"no rocking orbit was found at omega = {omega:g} rad/s, beta = {specimen.beta:g}, amplitude = "
            f"{amplitude:g} m/s2{reason}: provide a closer guess, or values closer to those of a known orbit"
        )
    return solution


def _orbit(specimen: Specimen, omega: float, amplitude: float, solution: Solution) -> Orbit:
    phase, u1, u2, v1, v2, velocity = (float(value) for value in solution.section)
    return Orbit(
        specimen=specimen,
        omega=omega,
        amplitude=amplitude,
        branch="rocking",
        phase=phase % tau,
        start=State(u1=u1, u2=u2, v1=v1, v2=v2, theta=0.0, omega=velocity),
        peaks=Peaks(*(float(peak) for peak in solution.peaks)),
        impacts=2,
        multipliers=np.linalg.eigvals(solution.jacobian).astype(np.complex128),
    )
