"""Remarks on a measured point: an unsteady motion, an unstable orbit, errors of the table, a difference."""

from collections.abc import Iterator, Mapping
from typing import Any

from bench.analysis.uncertainty import plus_minus
from protocols.common.sine.settling import Held, Settled
from protocols.harmonic.conditions import ROCKING
from sim.gain import Branch

AMPLITUDE_NOTE = 0.002
"""Relative error of the table's amplitude above which a remark is added; the prediction is always for the achieved
amplitude.
"""

HARMONICS_NOTE = 0.01
"""Total harmonic distortion of the table above which a remark is added; the prediction is for a pure sine."""

DIFFERS = "the difference from the prediction exceeds the combined uncertainty"


def remarks_on(
    settled: Settled,
    reference: Settled,
    name: str,
    branches: dict[str, Branch],
    agrees: bool | None,
    on_table: float | None,
    free: Mapping[str, Any],
    orbit: Mapping[str, Any],
) -> Iterator[str]:
    """Remarks on a `settled` motion of the branch `name` relative to a `reference`, which `agrees` with the prediction
    or does not, with the greatest modulus of the multipliers of the predicted orbit `on_table`, and the fields of a
    `free` motion and of its `orbit`.
    """
    state, peak = settled.steadiness, settled.peak
    if not state.steady:
        peaks = ""
        if free:
            least, greatest = (
                plus_minus(free[f"alpha_2_{end}"], free[f"alpha_2_{end}_uncertainty"]) for end in ("least", "greatest")
            )
            peaks = f", the largest drift within a period is between alpha_2 = {least} and {greatest}"
        yield f"not steady after {settled.time:.0f} s: {_described(settled)}{peaks}"
        if on_table is not None:
            yield f"disturbances of the predicted orbit {_growth(branches[ROCKING].multiplier, on_table)}"
        if orbit:
            gained = f"alpha_2 = {orbit['alpha_2_orbit']:.4f} +- {orbit['alpha_2_orbit_uncertainty']:.4f}"
            verdict = {True: ", which agrees with the prediction", False: ", which differs from the prediction"}
            yield f"the mean cycle gives the gain of the orbit: {gained}{verdict.get(orbit['orbit_agrees'], '')}"
    elif name in branches and not branches[name].stable:
        growth = _growth(branches[name].multiplier, on_table)
        yield f"steady while measured; disturbances of the predicted orbit {growth}"
    elif name != ROCKING and ROCKING in branches and branches[ROCKING].stable:
        yield "no start reached the stable rocking motion; the block rests"
    yield from amplitude_remark(settled)
    if peak.harmonics > HARMONICS_NOTE:
        yield f"the table's harmonics are {100.0 * peak.harmonics:.1f} % of its fundamental"
    if not reference.steadiness.steady:
        yield "the bare frame was not steady, so its drift is not a valid reference"
    if agrees is False:
        yield DIFFERS


def amplitude_remark(table: Settled | Held) -> Iterator[str]:
    """A remark if the amplitude of the table is far from the requested one."""
    if abs(table.amplitude_error) > AMPLITUDE_NOTE:
        yield f"the table's amplitude has an error of {100.0 * table.amplitude_error:+z.2f} %"


def _described(settled: Settled) -> str:
    """Description of an unsteady motion."""
    motion = settled.motion
    if motion is not None and motion.rate is not None and motion.rate.decays:
        decay, doubt = 100.0 * (1.0 - motion.rate.modulus), 200.0 * motion.rate.uncertainty
        return (
            f"the motion approaches a periodic one: the deviation decays by ({decay:.2g} +- {doubt:.1g}) % per "
            "cycle; with a longer --settle-limit it may become steady"
        )
    repeats = settled.steadiness.repeats if motion is None else motion.repeats
    return f"the motion repeats every {repeats} cycles" if repeats else "the motion does not repeat"


def _growth(fixed: float, on_table: float | None) -> str:
    """Growth or decay of disturbances, from the moduli of the dominant multipliers on fixed ground and on the table."""

    def change(modulus: float) -> str:
        return f"{'grow' if modulus > 1.0 else 'decay'} by {100.0 * abs(modulus - 1.0):.2g} % per cycle"

    found = f"{change(fixed)} on fixed ground"
    return found if on_table is None else f"{found} and {change(on_table)} on this table"
