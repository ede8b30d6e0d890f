"""Comparison of a free motion, one that is not held, with the model's long-term motion, where the orbit is unstable."""

from math import hypot, isfinite
from typing import Any

from bench.config.model import BenchConfiguration
from bench.prediction.attractors import CYCLES, LongTerm, long_term
from bench.result_cache import cached
from protocols.harmonic.protocol import HarmonicPoint
from sim.gain import predict_gain
from sim.specimen import Specimen
from sim.steady import NoOrbit

MEMBERS = 8
"""Number of specimens drawn, within the uncertainty, for the range of the greatest peak."""


def with_free_prediction(
    point: HarmonicPoint, specimen: Specimen, amplitude: float, configuration: BenchConfiguration, harmonics: int
) -> HarmonicPoint:
    """Add to a point the prediction of its unsteady free motion at `amplitude` [m/s2].

    Other points are unchanged. Nothing is added without a model of the table, or where disturbances of the orbit decay,
    since the free motion then tends to the orbit.
    """
    greatest, doubt, multiplier = point.alpha_2_greatest, point.alpha_2_greatest_uncertainty, point.table_multiplier
    if greatest is None or doubt is None or multiplier is None or multiplier <= 1.0:
        return point
    found = _predicted(specimen, point.omega_rad_s, amplitude, configuration, harmonics)
    if found is None:
        return point
    agrees, low, high = None, found["low"], found["high"]
    # the prediction is for the requested amplitude, to which the peaks are assumed to be proportional
    doubt = hypot(doubt, 2.0 * configuration.sensors.table_scale * greatest)
    if low is not None:
        agrees = low - doubt <= greatest <= high + doubt
    fields: dict[str, Any] = {
        "alpha_2_least_predicted": found["least"],
        "alpha_2_mean_predicted": found["mean"],
        "alpha_2_greatest_predicted": found["greatest"],
        "alpha_2_greatest_low": low,
        "alpha_2_greatest_high": high,
        "repeats_predicted": found["repeats"] or None,
        "falls_predicted": found["falls"],
        "free_agrees": agrees,
    }
    return point.model_copy(update=fields | {"reason": "; ".join(filter(None, (point.reason, _remark(found, agrees))))})


def _predicted(
    specimen: Specimen, omega: float, amplitude: float, configuration: BenchConfiguration, harmonics: int
) -> dict[str, Any] | None:
    """Characteristics of the long-term motion, from the cache if possible; None without a rocking orbit on the
    table.
    """
    shaker, known = configuration.simulated_shaker, configuration.known_on_table
    if shaker is None:
        return None
    inputs = [each.model_dump(mode="json") for each in (specimen, known, shaker)]

    def compute() -> dict[str, Any] | None:
        branch = predict_gain(specimen, omega, amplitude).rocking
        try:
            return None if branch is None else _numbers(long_term(branch, known, shaker, harmonics, members=MEMBERS))
        except NoOrbit:
            return None

    return cached("long_term", [*inputs, omega, amplitude, harmonics, CYCLES, MEMBERS], compute)


def _numbers(motion: LongTerm) -> dict[str, Any]:
    """Characteristics of a long-term motion as JSON content; absent ones are None."""

    def known(value: float) -> float | None:
        return value if isfinite(value) else None

    return {
        "least": known(motion.least),
        "mean": known(motion.mean),
        "greatest": known(motion.greatest),
        "repeats": motion.repeats,
        "low": known(motion.low),
        "high": known(motion.high),
        "falls": known(motion.falls),
    }


def _remark(found: dict[str, Any], agrees: bool | None) -> str:
    if found["greatest"] is None:
        return "the model's free motion ends with a fall of the block"
    repeats = f"repeats every {found['repeats']} cycles" if found["repeats"] else "does not repeat"
    text = f"the model's free motion {repeats}, with peaks up to alpha_2 = {found['greatest']:.3f}"
    if found["low"] is not None:
        text += f" ({found['low']:.3f} to {found['high']:.3f} for 95 % of the drawn specimens)"
    return text if agrees is not False else f"{text}; the measured peak is outside this range"
