"""Comparison of a free motion, one that is not held, with the model's long-term motion, where the orbit is unstable."""

from math import hypot, isfinite
from typing import Any

from bench.config.model import BenchConfiguration
from bench.prediction import attractors
from bench.prediction.attractors import CYCLES, LongTerm, long_term
from bench.result_cache import cached
from protocols.harmonic.protocol import HarmonicPoint
from sim.attractor import KEPT
from sim.gain import predict_gain
from sim.specimen import Specimen
from sim.steady import NoOrbit

MEMBERS = attractors.MEMBERS
"""Number of specimens drawn, within the uncertainty, for the ranges of the peaks."""

FEWEST = 20
"""Smallest number of drawn specimens that give ranges with which peaks are compared: a further one lies within a range
of 20 with 90 %, of fewer with less.
"""

PEAKS = ("least", "mean", "greatest")


def with_free_prediction(
    point: HarmonicPoint, specimen: Specimen, amplitude: float, configuration: BenchConfiguration, harmonics: int
) -> HarmonicPoint:
    """Add to a point the prediction of its unsteady free motion at `amplitude` [m/s2].

    Other points are unchanged. Nothing is added without a model of the table, or where disturbances of the orbit decay,
    since the free motion then tends to the orbit.
    """
    multiplier = point.table_multiplier
    if point.alpha_2_greatest is None or multiplier is None or multiplier <= 1.0:
        return point
    found = _predicted(specimen, point.omega_rad_s, amplitude, configuration, harmonics)
    if found is None:
        return point
    fields: dict[str, Any] = {"repeats_predicted": found["repeats"] or None, "falls_predicted": found["falls"]}
    outside, compared = list[str](), found["counted"] >= FEWEST
    for name, low, high in zip(PEAKS, found["low"], found["high"], strict=True):
        fields[f"alpha_2_{name}_predicted"] = found[name]
        fields[f"alpha_2_{name}_low"], fields[f"alpha_2_{name}_high"] = low, high
        measured, uncertainty = (getattr(point, f"alpha_2_{name}{end}") for end in ("", "_uncertainty"))
        # the prediction is for the requested amplitude, to which the peaks are assumed to be proportional
        doubt = hypot(uncertainty, 2.0 * configuration.sensors.table_scale * measured)
        if compared and low is not None and not low - doubt <= measured <= high + doubt:
            outside.append(name)
    fields["free_agrees"] = not outside if compared else None
    reason = "; ".join(filter(None, (point.reason, _remark(found, outside))))
    return point.model_copy(update=fields | {"reason": reason})


def _predicted(
    specimen: Specimen, omega: float, amplitude: float, configuration: BenchConfiguration, harmonics: int
) -> dict[str, Any] | None:
    """Characteristics of the long-term motion, from the cache if possible; None without a rocking orbit on the
    table.
    """
    # the model of the table contains the recoil: it is not an uncertainty here
    shaker, known = configuration.simulated_shaker, configuration.known
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
        "low": [known(value) for value in motion.low.tolist()],
        "high": [known(value) for value in motion.high.tolist()],
        "counted": motion.counted,
        "falls": known(motion.falls),
    }


def _remark(found: dict[str, Any], outside: list[str]) -> str:
    names = " and ".join(outside) if len(outside) < 3 else "least, mean and greatest"
    apart = f"; outside the predicted ranges: the measured {names} peak{'s' * (len(outside) > 1)}" if outside else ""
    if found["greatest"] is None:
        return f"the model's free motion ends with a fall of the block{apart}"
    repeats = f"repeats every {found['repeats']} cycles" if found["repeats"] else "does not repeat"
    text = f"the model's free motion {repeats}, with peaks up to alpha_2 = {found['greatest']:.3f}"
    low, high = found["low"][-1], found["high"][-1]
    if low is not None:
        number = found["counted"]
        among = f"{MEMBERS} specimens within the uncertainty"
        if number < MEMBERS:
            among = f"the {number} of {among} whose block does not fall within {KEPT} cycles"
        text += f" ({low:.3f} to {high:.3f} among {among}{', too few for a comparison' * (number < FEWEST)})"
    return text + apart
