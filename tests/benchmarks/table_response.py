"""Response of the table as identified, on benches without friction, whose response has a closed form: for `audit`."""

import numpy as np

from sim.shaker import Shaker
from sim.specimen import Frame, Specimen
from sim.virtual_bench import VirtualBenchParameters
from tests.bench.control.virtual_table import RATE, bench_with, closed_form, identify
from tests.benchmarks.estimates import Estimate

SHAKER = Shaker(friction=0.0)
SPECIMEN = Specimen(frame=Frame(xi1=0.3, xi2=0.3))
"""A frame that settles within the discarded period."""

PLACES = (2.0, 10.0, 40.0)
"""Frequencies at which the response is compared [Hz]."""


def keys(place: float) -> tuple[str, str]:
    """Names of magnitude and phase at a frequency [Hz]."""
    return f"magnitude at {place:g} Hz", f"phase at {place:g} Hz"


def responses(seed: int) -> dict[str, Estimate]:
    """Magnitude (relative) and phase [rad] of measured over true response at `PLACES`."""
    model = identify(bench_with(SPECIMEN, seed, VirtualBenchParameters(shaker=SHAKER)))
    f = np.array(model.frequency)
    ratio = model.response(f) / closed_form(f, SHAKER, SPECIMEN, RATE)
    # half of the variance is in the magnitude, half in the phase
    u = np.array(model.uncertainty) / np.abs(model.response(f)) / np.sqrt(2.0)
    found: dict[str, Estimate] = {}
    for place in PLACES:
        at = int(np.argmin(np.abs(f - place)))
        magnitude, phase = keys(place)
        found[magnitude] = Estimate(float(abs(ratio[at])), float(u[at]), 1.0)
        found[phase] = Estimate(float(np.angle(ratio[at])), float(u[at]), 0.0)
    return found
