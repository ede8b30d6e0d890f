"""The model that runs beside the test, in one line."""

from math import isfinite

from bench.cli.words import ABSENT, number
from bench.events import TwinEstimate


def twin_line(event: TwinEstimate) -> str:
    """Peak drifts, how far measured and modelled drift part, and gains where there are any, with the model's band."""
    words = [f"drift peak {_millimetres(event.drift_peak_measured)}, model {_millimetres(event.drift_peak)}"]
    words.append(f"residual {_share(event.residual)}, outside the band {_share(event.excess)}")
    if isfinite(event.alpha_2):
        band = f"{number(event.alpha_2_low)} to {number(event.alpha_2_high)}"
        words.append(f"alpha_2 {number(event.alpha_2_measured)}, model {number(event.alpha_2)} ({band})")
    if event.standing < 1.0:
        words.append(f"blocks standing {event.standing:.0%}")
    return "; ".join(words)


def _millimetres(metres: float) -> str:
    return f"{1e3 * metres:.2f} mm" if isfinite(metres) else ABSENT


def _share(value: float) -> str:
    return f"{100.0 * value:.1f} %" if isfinite(value) else ABSENT
