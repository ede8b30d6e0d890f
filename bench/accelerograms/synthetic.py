"""Synthetic ground motions with the main parameters of the paper's seven records, for use without record files.

They consist of filtered shot noise; five of them also have a near-fault velocity pulse. The envelope is that of
Saragoni and Hart (Earthquake Eng. Struct. Dyn. 2, 1974) with exponent 1, e(t) = c t exp(1 - c t). The filters are
those of Kanai (1957) and Tajimi (1960), which models the ground as an oscillator, and of Clough and Penzien
(Dynamics of Structures, 1975), a high-pass that brings velocity and displacement back to zero. The noise is modulated
before filtering, as by Amin and Ang, J. Eng. Mech. Div. ASCE 94, 1968.

Peaks, durations and bands of six motions were measured on the records themselves. For Parkfield, the peak is the value
in the record's database, and the pulse, ten inches of displacement within one and a half seconds, is that of Housner
and Trifunac (Bull. Seism. Soc. Am. 57, 1967); its duration and band are estimates. Periods and amplitudes of the other
pulses were chosen by eye from the velocity pulses of the records, not fitted. Filter frequencies and noise durations
were adjusted so that the means over many seeds agree with the declared values.
"""

from dataclasses import dataclass
from hashlib import sha256
from math import ceil, pi

import numpy as np
from numpy.typing import NDArray

from bench.accelerograms.accelerogram import Accelerogram
from bench.accelerograms.units import STANDARD_GRAVITY
from bench.analysis.table_motion import with_final_rest
from sim.errors import InvalidInput

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Pulse:
    """Near-fault velocity pulse: period [s], amplitude [m/s], number of half cycles gamma, phase nu [rad]."""

    period: float
    velocity: float
    gamma: float = 2.0
    phase: float = 0.0


@dataclass(frozen=True)
class Shape:
    """Parameters of a synthetic motion.

    peak : peak acceleration [g].
    duration : time between 5 and 95 % of the Arias intensity [s].
    band : range that contains the middle 68 % of the acceleration's energy [Hz].
    ground : frequency [Hz] and damping ratio of the ground, and frequency [Hz] of the high-pass.
    significant : time between 5 and 95 % of the energy of the noise alone [s].
    pulse : velocity pulse added to the noise; None if there is none.
    """

    peak: float
    duration: float
    band: tuple[float, float]
    ground: tuple[float, float, float]
    significant: float
    pulse: Pulse | None = None


SHAPES: dict[str, Shape] = {
    "pacoima": Shape(1.219, 7.0, (1.0, 7.1), (1.93, 0.78, 0.73), 7.2, Pulse(1.5, 0.9)),
    "parkfield": Shape(0.476, 7.0, (0.6, 3.5), (1.6, 0.6, 0.15), 7.6, Pulse(1.5, 0.6, phase=0.5 * pi)),
    "erzincan": Shape(0.515, 7.5, (0.4, 2.4), (0.46, 0.9, 0.26), 7.7, Pulse(2.2, 0.6)),
    "el-centro": Shape(0.313, 24.1, (1.15, 6.0), (1.32, 0.78, 0.89), 24.2),
    "l-aquila": Shape(0.664, 8.6, (1.8, 9.4), (3.24, 0.63, 0.74), 8.6),
    "newhall": Shape(0.590, 5.5, (0.85, 3.7), (1.65, 0.54, 0.39), 5.7, Pulse(1.0, 0.4)),
    "kobe": Shape(0.697, 4.6, (0.63, 3.7), (1.3, 0.6, 0.25), 4.8, Pulse(1.4, 0.5)),
}

NAMES = tuple(SHAPES)
"""Names of the motions, in the order of the paper's records."""


SIGNIFICANT = 2.73905
"""c times the time between 5 and 95 % of the envelope's energy: e^2 is a gamma density with shape parameter 3."""

DECAYED = 6.5
"""Value of c t at which the noise ends, where its envelope has fallen to 2.7 % of the maximum; the filters smooth the
end.
"""

HIGH_PASS_DAMPING = 0.6
"""Usual damping ratio of Clough and Penzien's second filter."""


def shot_noise(
    seed: int, member: int, n: int, dt: float, significant: float, ground: tuple[float, float, float]
) -> Array:
    """A realisation of the noise, shape (n,), starting from rest, with arbitrary scale.

    `significant` [s] is the duration between 5 and 95 % of its energy; `ground` are frequency [Hz] and damping ratio of
    the ground and frequency [Hz] of the high-pass. The same `seed` and `member` produce the same noise on every
    machine.
    """
    from scipy.fft import next_fast_len

    rate = SIGNIFICANT / significant
    time = np.arange(n) * dt
    white = _white(seed, member, n) * np.where(rate * time < DECAYED, rate * time * np.exp(1.0 - rate * time), 0.0)
    # double the length, so that the filters' ringing does not wrap around to the beginning
    length = next_fast_len(2 * n, real=True)
    frequency = np.fft.rfftfreq(length, dt).astype(np.float64)
    filtered = np.fft.irfft(np.fft.rfft(white, length) * _response(frequency, *ground), length)
    return np.asarray(filtered[:n], dtype=np.float64)


def _white(seed: int, member: int, n: int) -> Array:
    """White noise between -1 and 1, from the generator's integers, whose sequence numpy guarantees not to change."""
    raw = np.random.PCG64(np.random.SeedSequence((seed, member))).random_raw(n)
    return 2.0 * (raw >> np.uint64(11)).astype(np.float64) * 2.0**-53 - 1.0


def _response(frequency: Array, ground: float, damping: float, high_pass: float) -> NDArray[np.complex128]:
    """Transfer function from rock to ground acceleration at `frequency` [Hz], for the time factor exp(+i omega t)."""
    x, y = frequency / ground, frequency / high_pass
    kanai_tajimi = (1.0 + 2j * damping * x) / (1.0 - x**2 + 2j * damping * x)
    return np.asarray(kanai_tajimi * -(y**2) / (1.0 - y**2 + 2j * HIGH_PASS_DAMPING * y), dtype=np.complex128)


DT = 0.01
"""Step of the synthetic records [s]."""

DEFAULT_SEED = 1

HASHED = 1e-6
"""Resolution [m/s2] to which a record is rounded before hashing, since rounding errors may differ between machines."""

FADING = 1.5
"""Duration after the noise for the decay of the filters' response, in periods of the high-pass."""


def synthetic_record(name: str, seed: int = DEFAULT_SEED) -> Accelerogram:
    """A synthetic ground motion with the main parameters of the record `name`, one of NAMES.

    The peak is exact; the means of duration and band over many seeds agree with the declared values. The motion begins
    and ends at rest, with zero velocity and displacement. The same seed produces the same record on every machine, to
    rounding. Raises InvalidInput.
    """
    if name not in SHAPES:
        raise InvalidInput("synthetic record", name, f"it must be one of {', '.join(NAMES)}")
    if seed < 0:
        raise InvalidInput("seed", seed, "it must be an integer of at least 0")
    shape = SHAPES[name]
    acceleration = _motion(shape, seed, NAMES.index(name))
    rounded = np.round(acceleration / HASHED).astype("<i8")
    low, high = shape.band
    header = {
        "kind": "synthetic motion, not a measurement",
        "method": "filtered shot noise (Kanai, Tajimi, Clough and Penzien; envelope of Saragoni and Hart)",
        "pulse": "none",
        "seed": str(seed),
        "declared peak": f"{shape.peak:g} g",
        "declared duration": f"{shape.duration:g} s between 5 and 95 % of the Arias intensity",
        "declared band": f"{low:g} to {high:g} Hz, the middle 68 % of the energy",
    }
    if shape.pulse is not None:
        pulse = shape.pulse
        header["pulse"] = f"{pulse.velocity:g} m/s, {pulse.period:g} s (Mavroeidis and Papageorgiou 2003)"
    return Accelerogram(
        name=f"synthetic {name}",
        acceleration=acceleration,
        dt=DT,
        source=f"synthetic, seed {seed}",
        format="synthetic",
        unit="m/s2",
        sha256=sha256(rounded.tobytes()).hexdigest(),
        header=header,
        synthetic=True,
    )


def _motion(shape: Shape, seed: int, member: int) -> Array:
    """Acceleration [m/s2]: the noise is scaled so that noise and pulse together have the declared peak."""
    from scipy.optimize import brentq

    rate = SIGNIFICANT / shape.significant
    n = ceil((DECAYED / rate + FADING / shape.ground[2]) / DT) + 1
    noise = with_final_rest(shot_noise(seed, member, n, DT, shape.significant, shape.ground), DT)
    noise /= np.abs(noise).max()
    peak = shape.peak * STANDARD_GRAVITY
    if shape.pulse is None:
        return peak * noise
    time = np.asarray(np.arange(n) * DT - 1.0 / rate, dtype=np.float64)
    pulse = with_final_rest(pulse_acceleration(shape.pulse, time), DT)

    def excess(level: float) -> float:
        return float(np.abs(pulse + level * noise).max()) - peak

    whole = pulse + float(brentq(excess, 0.0, 2.0 * peak)) * noise
    return whole * (peak / np.abs(whole).max())


def pulse_acceleration(pulse: Pulse, time: Array) -> Array:
    """Acceleration [m/s2] of the pulse at `time` [s], counted from its middle; same shape as `time`.

    v = V/2 (1 + cos(2 pi t / (gamma T))) cos(2 pi t / T + nu) for |t| < gamma T / 2; for integer gamma above
    1 the residual displacement is zero. Source: Mavroeidis and Papageorgiou, Bull. Seism. Soc. Am. 93, 2003.
    """
    omega = 2.0 * np.pi / pulse.period
    slow, fast = omega / pulse.gamma * time, omega * time + pulse.phase
    rate = np.sin(slow) / pulse.gamma * np.cos(fast) + (1.0 + np.cos(slow)) * np.sin(fast)
    return np.where(np.abs(slow) < np.pi, -0.5 * pulse.velocity * omega * rate, 0.0)
