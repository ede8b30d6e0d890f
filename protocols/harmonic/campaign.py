"""The harmonic campaign on a bench (section 4.3 of the paper): its starts, forecast, predicted spectra and result."""

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from bench.config.model import BenchConfiguration
from bench.control.starts import Start, plan_starts
from bench.prediction.bands import bands
from bench.preflight.forecast import Forecast
from bench.progress import counting
from bench.protocol import Plan, Prepared, Result, Sources
from bench.record.tables import Column, Table, arrays
from protocols.harmonic.forecast import forecast
from protocols.harmonic.protocol import HarmonicParameters
from protocols.harmonic.reach import Reach
from protocols.harmonic.sheet import HarmonicSheet
from sim.errors import InvalidInput
from sim.gain import gain_spectrum, predict_gain
from sim.knowledge import SpecimenKnowledge
from sim.loading import load_model
from sim.parameters import Parameters
from sim.specimen import Specimen

STEP = 0.05
"""Distance of the frequencies of a spectrum [rad/s]."""

MARGIN = 1.0
"""How far a spectrum goes beyond the measured frequencies [rad/s]."""


class HarmonicCampaign(Prepared[HarmonicParameters]):
    """Refuses what table, lasers or limits of the bench do not allow, as far as closed forms tell."""

    def __init__(
        self, parameters: HarmonicParameters, configuration: BenchConfiguration, stored: Sources | None = None
    ) -> None:
        super().__init__(parameters, configuration, stored)
        self._reach = Reach(parameters, configuration)
        self._reach.check()

    @cached_property
    def starts(self) -> Mapping[tuple[float, float], tuple[Start, ...]]:
        """The starts that are tried at each stiffness ratio and frequency [rad/s], best first: forecast and plan share
        them, and nothing is planned while the bench is armed.
        """
        p, configuration = self.parameters, self.configuration
        specimen = configuration.known_specimen
        amplitude = p.amplitude_factor * specimen.uplift_acceleration
        found: dict[tuple[float, float], tuple[Start, ...]] = {}
        load_model(self.progress)
        done = counting(self.progress, "planning the starts")
        for beta in p.beta:
            coupled = specimen.coupled(beta)
            for omega in p.omega:
                layer = predict_gain(coupled, omega, amplitude).rocking
                orbit = layer.orbit if layer else None
                planned = plan_starts(coupled, omega, amplitude, orbit, p.starts, configuration.known)
                found[beta, omega] = tuple(planned)
                done(len(found), len(p.beta) * len(p.omega))
        return found

    @cached_property
    def forecast(self) -> Forecast:
        return forecast(self.parameters, self.configuration, self.starts, self._reach, self.progress)

    @cached_property
    def prediction(self) -> Table:
        return gain_spectra(self.parameters, self.configuration.known_specimen, self.configuration.known_on_table)

    def plan(self) -> Plan:
        points = yield from HarmonicSheet(self.parameters, self.configuration, self.starts).plan()
        return self.result(points)

    def result(self, points: Sequence[Parameters]) -> Result:
        from bench.report.figure import gain_spectra as drawn
        from bench.report.figure import write_figure
        from protocols.harmonic.table import points_table

        return Result(
            points=tuple(points),
            text=points_table(points),
            figures={"gain_spectra.png": lambda path: write_figure(path, drawn(points, arrays(self.prediction)))},
        )


def gain_spectra(parameters: HarmonicParameters, specimen: Specimen, known: SpecimenKnowledge) -> Table:
    """alpha_2 against Omega for every spring and layer, at the asked amplitude: one row per layer that exists.

    Its band, k = 2 and to first order, is what is left open of the specimen.
    """
    amplitude = parameters.amplitude_factor * specimen.uplift_acceleration
    omegas = _frequencies(parameters.omega)
    rows = [
        (prediction.omega, beta, layer, name)
        for beta in parameters.beta
        for prediction in gain_spectrum(specimen.coupled(beta), omegas, amplitude)
        for name, layer in prediction.layers.items()
    ]
    if not rows:
        raise InvalidInput("specimen", "as configured", "no steady motion of it is known at the asked frequencies")
    omega, beta, layers, names = (list(column) for column in zip(*rows, strict=True))
    alpha_2 = np.array([layer.alpha_2 for layer in layers])
    band = bands([layer.orbit for layer in layers], alpha_2, known)
    return {
        "omega": Column(np.array(omega), "rad/s", "circular frequency of the base motion"),
        "beta": Column(np.array(beta), "1", "stiffness ratio of the coupling spring"),
        "alpha_1": Column(np.array([layer.alpha_1 for layer in layers]), "1", "gain of the peak of u1"),
        "alpha_2": Column(alpha_2, "1", "gain of the peak drift"),
        "alpha_2_uncertainty": Column(band.uncertainty, "1", "expanded uncertainty of alpha_2 (k = 2), specimen's"),
        "alpha_2_low": Column(band.low, "1", "where the band of alpha_2 begins"),
        "alpha_2_high": Column(band.high, "1", "where the band of alpha_2 ends"),
        "stable": Column(np.array([layer.stable for layer in layers]), "1", "whether the motion is stable"),
        "layer": Column(np.array(names), "", "rocking, or resting where the block never lifts"),
    }


def _frequencies(measured: tuple[float, ...]) -> NDArray[np.float64]:
    low, high = max(min(measured) - MARGIN, STEP), max(measured) + MARGIN
    return np.linspace(low, high, round((high - low) / STEP) + 1)
