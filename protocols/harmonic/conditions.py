"""Conditions of a measured dwell: what its gain is computed with, and the prediction with which it is compared."""

from dataclasses import dataclass, replace
from math import hypot, log
from typing import Any

from bench.analysis.gain import Gain, SteadyPeak, gain, without_rounding
from bench.analysis.linearity import LinearFrame
from bench.analysis.sensor_uncertainty import SensorUncertainty
from bench.analysis.steady_correction import corrected
from bench.config.model import BenchConfiguration
from bench.prediction.bands import expanded_uncertainty
from protocols.common.sine.settling import Held, Settled, linear_frame
from protocols.harmonic.protocol import HarmonicParameters
from sim.gain import Branch, predict_gain
from sim.knowledge import SpecimenKnowledge
from sim.shaker import Shaker
from sim.specimen import Specimen

ROCKING = "rocking"
"""Name of the branch on which the block rocks."""

AMPLITUDE_STEP = 0.002
"""Relative change of the amplitude in the finite difference for the sensitivity."""


@dataclass(frozen=True)
class Conditions:
    """Conditions of a test at `omega` [rad/s], and the model and reference with which its result is compared.

    `reference` is the bare frame's dwell at the same frequency, `known` the uncertainty of the `specimen`. Stability on
    the table is predicted with the model `shaker`, if there is one; `harmonics` is the number of harmonics of the
    table's motion that are controlled. Errors of the lasers are found according to the model of the bare `frame`, in an
    unsteady motion with residuals that may be correlated for `block` seconds; neither without a frame, nor if `block`
    is zero.
    """

    omega: float
    specimen: Specimen
    known: SpecimenKnowledge
    reference: Settled
    sensors: SensorUncertainty
    shaker: Shaker | None = None
    harmonics: int = 1
    frame: LinearFrame | None = None
    block: float = 0.0

    @classmethod
    def of(
        cls,
        omega: float,
        specimen: Specimen,
        reference: Settled,
        sensors: SensorUncertainty,
        configuration: BenchConfiguration,
        parameters: HarmonicParameters,
    ) -> "Conditions":
        """Conditions on the bench of `configuration`, with the `parameters` of the run."""
        return cls(
            omega,
            specimen,
            configuration.known_on_table,
            reference,
            sensors,
            configuration.simulated_shaker,
            parameters.harmonics,
            linear_frame(configuration),
            parameters.laser_block or 0.0,
        )

    def rounded(self, peak: SteadyPeak) -> SteadyPeak:
        """The peak without the rounding errors of calibrated lasers."""
        step = self.sensors.accuracy.laser_resolution
        if self.sensors.calibration is None or step == 0.0:
            return peak
        return without_rounding(peak, self.omega, step)

    def corrected(self, peak: SteadyPeak) -> tuple[SteadyPeak, "Conditions"]:
        """A periodic peak without the rounding errors of calibrated lasers, or without the linearity errors of others
        that the harmonics of the tests reveal; and the conditions of its gain.
        """
        peak = self.rounded(peak)
        if self.frame is None or not self.block:
            return peak, self
        found = corrected(peak, self.reference.peak, self.sensors, self.frame, self.omega)
        if found is None:
            return peak, self
        return found.peak, self.found(found.reference, found.sensors)

    def found(self, reference: SteadyPeak, sensors: SensorUncertainty) -> "Conditions":
        """Conditions with a corrected peak of the `reference`, and the `sensors` with the errors found."""
        return replace(self, reference=replace(self.reference, peak=reference), sensors=sensors)

    def branches(self, peak: SteadyPeak) -> dict[str, Branch]:
        """Predicted branches at the measured amplitudes of the table."""
        return predict_gain(self.specimen, self.omega, peak.amplitude, self.reference.peak.amplitude).branches

    def slope(self, name: str, peak: SteadyPeak) -> float:
        """d ln alpha_2 / d ln amplitude of a branch, with both tests at the same amplitude; 0 at the end of the branch.

        Central difference between orbits of the steady solver. The gains of the resting block and of the bare frame do
        not depend on the amplitude.
        """
        around = (peak.amplitude * (1.0 - AMPLITUDE_STEP), peak.amplitude * (1.0 + AMPLITUDE_STEP))
        less, more = (predict_gain(self.specimen, self.omega, each).branches.get(name) for each in around)
        if less is None or more is None:
            return 0.0
        return log(more.alpha_2 / less.alpha_2) / log(around[1] / around[0])

    def gain(self, peak: SteadyPeak, slope: float = 0.0) -> Gain:
        """Gain of a peak; for `slope` see `slope()`, zero for a gain at the amplitude that occurred."""
        return gain(peak, self.reference.peak, self.sensors, slope)

    def comparison(self, name: str, branch: Branch | None, peak: SteadyPeak) -> "Comparison":
        """Comparison with the branch `name` at the amplitude of `peak`; `branch` is None if it does not exist."""
        return Comparison(self, branch, self.slope(name, peak), predicted_fields(name, branch, self.known))


@dataclass(frozen=True)
class Comparison:
    """Predicted branch with which gains are compared; for `slope` see `Conditions.slope`."""

    conditions: Conditions
    branch: Branch | None
    slope: float
    predicted: dict[str, Any]

    def compare(self, peak: SteadyPeak) -> tuple[Gain, bool | None]:
        """Gain of a peak, and whether it agrees with the predicted gain, i.e. differs by no more than the combined
        expanded uncertainty (|E_n| <= 1, ISO 13528). The verdict is None without a prediction or a steady reference.
        """
        reference, branch = self.conditions.reference, self.branch
        measured = self.conditions.gain(peak, self.slope)
        uncertainty = self.predicted["alpha_2_predicted_uncertainty"]
        if branch is None or uncertainty is None or not reference.steadiness.steady:
            return measured, None
        return measured, abs(measured.alpha_2 - branch.alpha_2) <= hypot(measured.uncertainty, uncertainty)

    def fields(self, peak: SteadyPeak, measured: Gain, agrees: bool | None, table: Settled | Held) -> dict[str, Any]:
        """Fields of a measured motion: gain, comparison with the prediction, and errors of the table's motion."""
        return self.predicted | {
            "alpha_2": measured.alpha_2,
            "alpha_2_uncertainty": measured.uncertainty,
            **measured.budget.fields,
            "agrees": agrees,
            "drift_peak_m": peak.drift,
            "amplitude_m_s2": peak.amplitude,
            "cycles_measured": peak.cycles,
            "amplitude_error": table.amplitude_error,
            "phase_error_rad": table.phase_error,
            "table_harmonics": peak.harmonics,
        }


def predicted_fields(name: str, branch: Branch | None, known: SpecimenKnowledge) -> dict[str, Any]:
    """Prediction fields of a point for the branch `name`; the predicted values are None if it does not exist."""
    return {
        "layer": name if branch else "none",
        "alpha_2_predicted": branch.alpha_2 if branch else None,
        "alpha_2_predicted_uncertainty": expanded_uncertainty(branch, known) if branch else None,
        "predicted_stable": branch.stable if branch else None,
    }
