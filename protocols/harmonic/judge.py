"""What a measured dwell means: on which layer it lies, and whether it agrees with the prediction for that layer."""

from collections.abc import Iterator
from math import hypot, log

from bench.analysis.gain import SteadyPeak, gain
from bench.analysis.sensor_accuracy import SensorDoubt
from bench.prediction.model_uncertainty import expanded_uncertainty
from protocols.harmonic.protocol import HarmonicPoint, PointStatus
from protocols.harmonic.settle import Settled
from sim.gain import Layer, predict_gain
from sim.knowledge import SpecimenKnowledge
from sim.specimen import Specimen

_ROCKING = "rocking"

AMPLITUDE_NOTE = 0.002
"""Relative error of the table's amplitude that is worth a word; the prediction is for the achieved one all the same."""

AMPLITUDE_STEP = 0.002
"""Relative change of the amplitude over which the sensitivity to it is taken."""

HARMONICS_NOTE = 0.01
"""Total harmonic distortion of the table that is worth a word: the prediction is for a pure sine."""


def judge(
    settled: Settled,
    reference: Settled,
    omega: float,
    specimen: Specimen,
    known: SpecimenKnowledge,
    sensors: SensorDoubt,
    starts: int,
) -> HarmonicPoint:
    """The point that a dwell makes, compared with the layer whose drift and u1 are nearest to the measured ones.

    `reference` is the bare frame's dwell at the same frequency; `known` says how well the `specimen` is. The two gains
    agree when they differ by no more than their uncertainties together, |E_n| <= 1 of ISO 13528.
    """
    peak, bare = settled.peak, reference.peak
    layers = predict_gain(specimen, omega, peak.amplitude, bare.amplitude).layers
    steady = settled.steadiness.steady
    name = _nearest(layers, peak) if steady else _ROCKING
    layer = layers.get(name)
    measured = gain(peak, bare, sensors, _amplitude_slope(specimen, omega, peak.amplitude, name))
    predicted = layer.alpha_2 if layer else None
    open_ = expanded_uncertainty(layer, known) if layer else None
    agrees = None
    if steady and reference.steadiness.steady and predicted is not None and open_ is not None:
        agrees = abs(measured.alpha_2 - predicted) <= hypot(measured.uncertainty, open_)
    return HarmonicPoint(
        omega_rad_s=omega,
        beta=specimen.label or 0.0,
        status=_status(settled, name),
        layer=name if layer else "none",
        alpha_2=measured.alpha_2,
        alpha_2_uncertainty=measured.uncertainty,
        dominating=measured.budget.dominating,
        uncertainty_parts=measured.budget.as_json,
        alpha_2_predicted=predicted,
        alpha_2_predicted_uncertainty=open_,
        predicted_stable=layer.stable if layer else None,
        agrees=agrees,
        drift_peak_m=peak.drift,
        bare_drift_peak_m=bare.drift,
        amplitude_m_s2=peak.amplitude,
        bare_amplitude_m_s2=bare.amplitude,
        starts_tried=starts,
        cycles_measured=peak.cycles,
        settle_time_s=settled.time,
        amplitude_error=settled.amplitude_error,
        phase_error_rad=settled.phase_error,
        table_harmonics=peak.harmonics,
        table_updates=settled.updates,
        reason="; ".join(_reasons(settled, reference, name, layers, agrees)),
    )


def _amplitude_slope(specimen: Specimen, omega: float, amplitude: float, layer: str) -> float:
    """d ln alpha_2 / d ln amplitude of a layer, both tests at one amplitude [m/s2]; 0 where the layer does not go on to
    either side.

    A difference over the steady solver's orbits: the gain of a block that rests, and of the bare frame, has none.
    """
    around = (amplitude * (1.0 - AMPLITUDE_STEP), amplitude * (1.0 + AMPLITUDE_STEP))
    less, more = (predict_gain(specimen, omega, each).layers.get(layer) for each in around)
    if less is None or more is None:
        return 0.0
    return log(more.alpha_2 / less.alpha_2) / log(around[1] / around[0])


def _nearest(layers: dict[str, Layer], peak: SteadyPeak) -> str:
    """The layer whose peaks of drift and u1 are nearest in ratio to the measured ones."""

    def distance(name: str) -> float:
        expected = layers[name].orbit.peaks
        return hypot(log(peak.drift / expected.drift), log(peak.u1 / expected.u1))

    return min(layers, key=distance, default=_ROCKING)


def _status(settled: Settled, layer: str) -> PointStatus:
    if not settled.steadiness.steady:
        return PointStatus.MODULATED
    return PointStatus.STEADY if layer == _ROCKING else PointStatus.RESTING


def _reasons(
    settled: Settled, reference: Settled, name: str, layers: dict[str, Layer], agrees: bool | None
) -> Iterator[str]:
    """Everything that a reader of the point should know."""
    state, peak = settled.steadiness, settled.peak
    if not state.steady:
        how = f"repeats every {state.repeats} cycles" if state.repeats else "does not repeat"
        yield f"not steady after {settled.time:.0f} s: the motion {how}, spread {100.0 * state.spread:.1f} %"
    elif name in layers and not layers[name].stable:
        grows = 100.0 * (layers[name].multiplier - 1.0)
        yield f"steady while it was measured, but the predicted orbit is unstable: it leaves by {grows:.1f} % a cycle"
    elif name != _ROCKING and _ROCKING in layers and layers[_ROCKING].stable:
        yield "no start reached the stable rocking motion: the block rests"
    if abs(settled.amplitude_error) > AMPLITUDE_NOTE:
        yield f"the table's amplitude is {100.0 * settled.amplitude_error:+.2f} % off"
    if peak.harmonics > HARMONICS_NOTE:
        yield f"the table's harmonics are {100.0 * peak.harmonics:.1f} % of its fundamental"
    if not reference.steadiness.steady:
        yield "the bare frame was not steady: its drift is no reference"
    if agrees is False:
        yield "differs from the prediction by more than the uncertainty of both"
