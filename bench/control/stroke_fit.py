"""Fits of a record to the stroke of the table, and their effect on its response spectrum."""

from dataclasses import dataclass
from enum import StrEnum
from math import tau

import numpy as np

from bench.analysis.response_spectrum import DAMPING, pseudo_acceleration
from bench.analysis.table_motion import Array, TableMotion, table_motion, with_final_rest
from bench.control.least_change import fit_by_least_change
from bench.control.target import FLAT, Reach, integrated, windowed
from sim.errors import InvalidInput
from sim.excitation import SampledRecord
from sim.specimen import Frame

ORDER = 2
"""Order n of the Butterworth filter, applied forward and backward: gain 1 / (1 + (f_c / f)^2n), zero phase."""

CORNERS = (0.005, 5.0)
"""Range of corner frequencies [Hz] searched for the lowest that fits the record."""

HALVINGS = 24
"""Number of bisections of that range on a logarithmic scale; the final relative width is below 1e-6."""

PAD = 1.5
"""Length of the zero padding before and after the record, in which the filter's response decays, in periods of the
corner frequency, per order of the filter.
"""


@dataclass(frozen=True, eq=False)
class HighPassed:
    """The filtered record [m/s2], the number of zeros inserted before it, and the corner frequency [Hz]."""

    acceleration: Array
    lead: int
    corner: float


def fit_by_high_pass(acceleration: Array, dt: float, reach: Reach) -> HighPassed:
    """`acceleration` [m/s2], shape (n,), high-pass filtered with the lowest corner frequency that keeps the table
    within `reach`.

    Raises InvalidInput if no corner frequency up to 5 Hz is sufficient.
    """
    low, high = CORNERS
    found = high_passed(acceleration, dt, high)
    motion = table_motion(found.acceleration, dt)
    if not reach.holds(motion):
        needs = f"even high-passed at {high:g} Hz, the record requires {1e3 * motion.peak_displacement:.3g} mm and"
        allowed = f"{1e3 * reach.displacement:.3g} mm and {reach.velocity:.3g} m/s are allowed: scale the record down"
        raise InvalidInput("record", "", f"{needs} {motion.peak_velocity:.3g} m/s; {allowed}")
    for _ in range(HALVINGS):
        corner = (low * high) ** 0.5
        tried = high_passed(acceleration, dt, corner)
        if reach.holds(table_motion(tried.acceleration, dt)):
            found, high = tried, corner
        else:
            low = corner
    return found


def high_passed(acceleration: Array, dt: float, corner: float) -> HighPassed:
    """`acceleration` without its content below `corner` [Hz], ending at rest, with padding before and after for the
    filter.
    """
    lead = int(np.ceil(PAD * ORDER / (corner * dt)))
    padded = np.pad(acceleration, lead)
    # padded to twice the length, to prevent wrap-around of the periodic transform
    length = 2 * padded.size
    frequencies = np.fft.rfftfreq(length, dt)
    gain = np.zeros_like(frequencies)
    gain[1:] = 1.0 / (1.0 + (corner / frequencies[1:]) ** (2 * ORDER))
    filtered = np.fft.irfft(np.fft.rfft(padded, length) * gain, length)[: padded.size]
    return HighPassed(with_final_rest(filtered, dt), lead, corner)


PERIODS = np.geomspace(0.1, 2.0, 40)
"""Default periods [s] at which a fit reports the change of the response spectrum; the least change keeps it small."""

SHORTEST = 16
"""Minimum number of samples of a record."""

TURNS = 8
"""Maximum number of successive fits within a band; each leaves about a tenth of the change to the next."""

TIGHTER = 0.995
"""Factor by which the reach is reduced from one fit to the next."""

SAME = 0.01
"""Largest accepted deviation of the band-limited displacement from the fitted one, as a fraction of the reach."""

ROUNDING = 1e-9
"""Fraction of the peak velocity or displacement below which a value counts as zero."""


NOT_BOTH = "band and stroke are incompatible: lower the band's lower end, or scale the record down"


class Method(StrEnum):
    """Method of the fit: the smallest sufficient change, or the high-pass filter with the lowest sufficient corner."""

    LEAST_CHANGE = "least-change"
    HIGH_PASS = "high-pass"


@dataclass(frozen=True, eq=False)
class StrokeFit:
    """A fitted record: it ends at rest where it began, and stays within the table's reach at every sample.

    `record` begins `lead` [s] before the original. `before` and `after` are the table's motions under the original and
    the fitted record. `spectrum` and `spectrum_before`, shape (n,), are the pseudo-accelerations [m/s2] of both at
    `periods` [s]. `done` describes the fit.
    """

    record: SampledRecord
    lead: float
    done: str
    before: TableMotion
    after: TableMotion
    periods: Array
    spectrum_before: Array
    spectrum: Array

    @property
    def change(self) -> Array:
        """Relative change of the response spectrum at `periods`, shape (n,)."""
        return self.spectrum / self.spectrum_before - 1.0


def periods_of(frame: Frame) -> Array:
    """`PERIODS` and the periods of the frame's modes [s], ascending."""
    return np.unique(np.append(PERIODS, [tau / omega for omega in frame.natural_frequencies]))


def fit_stroke(
    record: SampledRecord,
    reach: Reach,
    method: Method = Method.LEAST_CHANGE,
    periods: Array = PERIODS,
    damping: float = DAMPING,
    band: tuple[float, float] | None = None,
) -> StrokeFit:
    """`record` modified to keep the table within `reach`; a record within `band` [Hz] stays within that band.

    A record that already fits and ends at rest is returned unchanged. Raises InvalidInput for a record without motion
    or shorter than 16 samples, and if the method finds no fit.
    """
    original, dt = record.acceleration, record.dt
    if original.size < SHORTEST or not original.any():
        needs = f"fitting requires at least {SHORTEST} samples, not all of them zero"
        raise InvalidInput("record", f"{original.size} samples", needs)
    before = table_motion(original, dt)
    lead = 0
    if reach.holds(before) and _at_rest(before):
        fitted, done = original, "unchanged: the record already fits"
    elif method is Method.HIGH_PASS:
        passed = fit_by_high_pass(original, dt, reach)
        fitted, lead = passed.acceleration, passed.lead
        done = f"zero-phase high-pass at {passed.corner:.3g} Hz"
    else:
        fitted = _least_change(original, dt, reach, periods, damping, band)
        changed = float(np.sqrt(np.mean((fitted - original) ** 2) / np.mean(original**2)))
        where = "below 2 Hz" if band is None else f"within {band[0]:g} to {band[1]:g} Hz"
        done = f"least change {where}: {100.0 * changed:.3g} % of the record's rms acceleration"
    spectrum = pseudo_acceleration(original, dt, periods, damping)
    return StrokeFit(
        record=SampledRecord(fitted, dt),
        lead=lead * dt,
        done=done,
        before=before,
        after=table_motion(fitted, dt),
        periods=periods,
        spectrum_before=spectrum,
        spectrum=spectrum if fitted is original else pseudo_acceleration(fitted, dt, periods, damping),
    )


def _least_change(
    original: Array, dt: float, reach: Reach, periods: Array, damping: float, band: tuple[float, float] | None
) -> Array:
    """The record with the smallest sufficient change. The sines end with the record and therefore have slight
    content below their frequency, outside the table's `band`. This content is removed; if the motion then exceeds the
    reach or does not end at rest, the record is fitted again.
    """
    if band is None:
        return fit_by_least_change(original, dt, reach, periods, damping)
    made, asked = original, reach
    allowed = np.array([reach.displacement, reach.velocity])
    for turn in range(TURNS):
        made = fit_by_least_change(made, dt, asked, periods, damping, band[0] / FLAT)
        kept = windowed(made, dt, band)
        velocity, displacement = (wave[: made.size] for wave in integrated(kept, 1.0 / dt))
        over = np.array([np.abs(displacement).max(), np.abs(velocity).max()]) / allowed
        lost = np.abs(displacement - table_motion(made, dt).displacement).max()
        if over.max() <= 1.0 and lost <= SAME * reach.displacement:
            return made
        made, share = kept[: made.size], TIGHTER ** (turn + 1)
        asked = Reach(share * reach.displacement, share * reach.velocity)
    needs = f"no change from {band[0] / FLAT:.3g} Hz upward is sufficient: {1e3 * reach.displacement:.3g} mm and"
    raise InvalidInput("record", "", f"{needs} {reach.velocity:.3g} m/s are allowed; {NOT_BOTH}")


def _at_rest(motion: TableMotion) -> bool:
    """Whether the table ends at rest where it began, to within rounding."""
    still = abs(motion.velocity[-1]) <= ROUNDING * motion.peak_velocity
    return still and abs(motion.displacement[-1]) <= ROUNDING * motion.peak_displacement
