"""Whether a drive that was learned is good enough to be played, and what is to be said of it."""

from protocols.common.replicate import Replicated
from protocols.earthquake.protocol import EarthquakeParameters


def refused(learned: Replicated, parameters: EarthquakeParameters) -> str | None:
    """Why the best drive is not used; None where it is."""
    if learned.acceleration is None:
        return f"nothing was learned: {learned.reason}"
    if learned.repeatable <= parameters.usable:
        return None
    return (
        f"after {len(learned.passes)} passes the table is off by {learned.repeatable:.1%} rms, more than"
        f" {parameters.usable:.1%} (--usable); {learned.reason}"
    )


def shortfall(learned: Replicated, parameters: EarthquakeParameters, lowest: float) -> str:
    """What a drive that is used lacks, in words; empty where it meets both tolerances.

    `lowest` [Hz] is the lower end of the band that the record was limited to.
    """
    said: list[str] = []
    if learned.repeatable > parameters.tolerance:
        said.append(f"the table is off by {learned.repeatable:.2%} rms, asked {parameters.tolerance:.2%}")
    off, period = learned.spectrum_error
    if off > parameters.spectrum_tolerance:
        below = " (below the record's band)" if period * lowest > 1.0 else ""
        asked = f"asked {parameters.spectrum_tolerance:.1%}"
        said.append(f"its response spectrum is off by {off:.1%} at {period:.3g} s{below}, {asked}")
    if said and learned.status != "converged":
        said.append(learned.reason)
    return "; ".join(said)
