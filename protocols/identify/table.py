"""The identified table as text for the terminal."""

from collections.abc import Sequence
from math import degrees

from bench.report.columns import right_aligned
from protocols.identify.point import IdentifiedBand

_TITLES = ("frequency", "gain", "phase", "U (k=2)", "distortion", "noise", "coherence", "lines")
_UNITS = ("[Hz]", "[m/s2/V]", "[deg]", "[%]", "[%]", "[m/s2/Hz^0.5]", "[1]", "[1]")


def bands_table(points: Sequence[IdentifiedBand]) -> str:
    """One row for each third of an octave."""
    if not points:
        return "Nothing was identified."
    return "\n".join(right_aligned(_TITLES, _UNITS, (_cells(point) for point in points)))


def _cells(point: IdentifiedBand) -> tuple[str, ...]:
    return (
        f"{point.frequency_hz:.3g}",
        f"{point.gain_m_s2_v:.4g}",
        f"{degrees(point.phase_rad):.1f}",
        f"{100.0 * point.uncertainty:.2g}",
        f"{100.0 * point.distortion:.2g}",
        f"{point.noise_m_s2_hz:.2g}",
        f"{point.coherence:.5f}",
        f"{point.lines}",
    )
