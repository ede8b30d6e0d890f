"""Gain coefficients alpha_1 and alpha_2 predicted by the model for a steady sine and for a record.

alpha is a peak of the coupled frame divided by the same peak of the bare one (Eq. 10). Under a sine, two steady motions
can coexist, so that a prediction has up to two branches; the start of a test decides which one the motion reaches.
Under a record, the peaks are those of the motion that starts at rest, unless the block overturns.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import hypot, log

import numpy as np
from numpy.typing import NDArray

from sim.ensemble import simulate_many
from sim.errors import InvalidInput
from sim.excitation import SampledRecord
from sim.linear import steady_peaks
from sim.rocking import Motion, Peaks, Status, simulate
from sim.specimen import Specimen
from sim.steady import NoOrbit, Orbit, resting_state, rocking_branch, rocking_orbit


@dataclass(frozen=True, eq=False)
class Branch:
    """Steady motion and its gain coefficients."""

    orbit: Orbit
    alpha_1: float
    alpha_2: float

    @property
    def stable(self) -> bool:
        """Whether the motion is stable."""
        return self.orbit.stable

    @property
    def multiplier(self) -> float:
        """Modulus of the dominant Floquet multiplier, per period of the drive."""
        return self.orbit.multiplier


@dataclass(frozen=True, eq=False)
class GainPrediction:
    """Gain coefficients at one frequency. A branch is None where its motion does not exist or was not found.

    `omega` is in rad/s, `beta` is the label of the spring, and `bare` contains the exact peaks of the frame without
    block.
    """

    omega: float
    beta: float
    amplitude: float
    bare: Peaks
    rocking: Branch | None
    resting: Branch | None

    @property
    def branches(self) -> dict[str, Branch]:
        """Branches of steady motion that exist, by name: "rocking", "resting"."""
        named = {"rocking": self.rocking, "resting": self.resting}
        return {name: branch for name, branch in named.items() if branch is not None}


@dataclass(frozen=True, eq=False)
class SeismicGain:
    """Gain coefficients of the spring labelled `beta` under a record; both None unless the run was completed.

    `motion` contains the peaks and the overturning, if any (`motion.overturned`, `motion.end_time`); `bare` contains
    the peaks of the frame without the block.
    """

    beta: float
    alpha_1: float | None
    alpha_2: float | None
    bare: Peaks
    motion: Motion


def nearest_branch(branches: Mapping[str, Branch], drift: float, u1: float) -> str | None:
    """Name of the branch whose peaks of drift and u1 [m] are closest to the given ones on a logarithmic scale; None
    without a branch.
    """

    def distance(name: str) -> float:
        expected = branches[name].orbit.peaks
        return hypot(log(drift / expected.drift), log(u1 / expected.u1))

    return min(branches, key=distance, default=None)


def predict_gain(
    specimen: Specimen, omega: float, amplitude: float, bare_amplitude: float | None = None
) -> GainPrediction:
    """Gain coefficients under `amplitude` [m/s2] sin(`omega` [rad/s] t).

    `bare_amplitude` [m/s2] is the amplitude of the test without the block, if different.
    Raises InvalidInput for a bare specimen or values outside their ranges. Source: Eq. (10).
    """
    resting = resting_state(specimen, omega, amplitude)
    try:
        rocking = rocking_orbit(specimen, omega, amplitude)
    except NoOrbit:
        rocking = None
    return _prediction(specimen, omega, amplitude, bare_amplitude, rocking, resting)


def gain_spectrum(
    specimen: Specimen,
    omegas: Sequence[float] | NDArray[np.float64],
    amplitude: float,
    bare_amplitude: float | None = None,
) -> list[GainPrediction]:
    """Results of `predict_gain` at each of `omegas` [rad/s], computed faster, because each orbit is extrapolated from
    the previous ones.
    """
    places = [float(omega) for omega in omegas]
    try:
        branch = rocking_branch(specimen, places, amplitude)
    except NoOrbit:
        return [predict_gain(specimen, omega, amplitude, bare_amplitude) for omega in places]
    return [
        _prediction(specimen, omega, amplitude, bare_amplitude, orbit, resting_state(specimen, omega, amplitude))
        for omega, orbit in zip(places, branch, strict=True)
    ]


def seismic_curve(
    specimen: Specimen,
    record: SampledRecord,
    betas: Sequence[float] | NDArray[np.float64],
    scheduler: str | None = None,
) -> list[SeismicGain]:
    """Gain coefficients under `record`, from rest, for each spring label of `betas`, computed on all processors.

    The peaks are those during the record, without the free motion after it. Raises InvalidInput for a negative label,
    and for a record under which the bare frame does not move or does not remain finite. Source: Eq. (10).
    """
    bare = simulate(specimen.bare(), record)
    if bare.status is not Status.COMPLETED or not min(bare.peaks.u1, bare.peaks.drift) > 0.0:
        raise InvalidInput(
            "record",
            f"peak u1 {bare.peaks.u1:.3g} m and peak drift {bare.peaks.drift:.3g} m of the bare frame",
            "the response of the bare frame must be finite and not zero",
        )
    coupled = [specimen.coupled(float(beta)) for beta in betas]
    curve: list[SeismicGain] = []
    for member, motion in zip(coupled, simulate_many(coupled, record, scheduler=scheduler), strict=True):
        known = motion.status is Status.COMPLETED
        alpha_1 = motion.peaks.u1 / bare.peaks.u1 if known else None
        alpha_2 = motion.peaks.drift / bare.peaks.drift if known else None
        curve.append(SeismicGain(member.label or 0.0, alpha_1, alpha_2, bare.peaks, motion))
    return curve


def _prediction(
    specimen: Specimen,
    omega: float,
    amplitude: float,
    bare_amplitude: float | None,
    rocking: Orbit | None,
    resting: Orbit | None,
) -> GainPrediction:
    bare = steady_peaks(specimen, omega, amplitude if bare_amplitude is None else bare_amplitude)

    def branch(orbit: Orbit | None) -> Branch | None:
        if orbit is None:
            return None
        return Branch(orbit, alpha_1=orbit.peaks.u1 / bare.u1, alpha_2=orbit.peaks.drift / bare.drift)

    return GainPrediction(
        omega=omega,
        beta=specimen.label or 0.0,
        amplitude=amplitude,
        bare=bare,
        rocking=branch(rocking),
        resting=branch(resting),
    )
