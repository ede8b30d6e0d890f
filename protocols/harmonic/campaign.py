"""Harmonic campaign (section 4.3 of the paper): checks, forecast, predicted spectra and result."""

import textwrap
from collections import Counter
from collections.abc import Mapping, Sequence
from functools import cached_property
from math import tau
from typing import Any

import numpy as np

from bench.analysis.contributions import SOURCES
from bench.analysis.steady import WINDOW
from bench.config.model import BenchConfiguration
from bench.control.cycle_identification import EXCITATION
from bench.control.starts import OVERSHOOTS, Start, plan_starts
from bench.datafile.tables import Column, Table, arrays
from bench.document.typography import counted
from bench.figures.summary import PointLike, plain
from bench.figures.text_table import TextColumn, text_table
from bench.prediction.bands import bands
from bench.preflight.demands import Travel
from bench.preflight.margins import Forecast
from bench.progress import counting
from bench.protocol import Plan, Prepared, Result, Sources
from bench.result_cache import cached
from protocols.harmonic.forecast import forecast
from protocols.harmonic.plan import HarmonicPlan
from protocols.harmonic.protocol import COMPARED, HarmonicParameters
from sim.errors import InvalidInput
from sim.gain import gain_spectrum, predict_gain
from sim.knowledge import SpecimenKnowledge
from sim.linear import steady_response
from sim.loading import load_model
from sim.parameters import Parameters
from sim.specimen import Specimen
from sim.steady import NoOrbit, rocking_orbit

STEP = 0.05
"""Frequency step of a predicted spectrum [rad/s]."""

MARGIN = 1.0
"""Extension of a predicted spectrum beyond the measured frequencies [rad/s]."""


class HarmonicCampaign(Prepared[HarmonicParameters]):
    """Harmonic campaign.

    Raises InvalidInput if the steady motions, which are quick to compute, exceed the stroke, the ranges of the lasers
    or a limit on displacement, velocity or acceleration, or if the settle limit is too short. The error names the
    parameter to change. The forecast simulates all stages, including starts.
    """

    def __init__(
        self, parameters: HarmonicParameters, configuration: BenchConfiguration, stored: Sources | None = None
    ) -> None:
        super().__init__(parameters, configuration, stored)
        self._specimen = configuration.known_specimen
        self._amplitude = parameters.amplitude_factor * self._specimen.uplift_acceleration
        self._motions: dict[tuple[float | None, float], Travel | None] = {}
        self._check_table()
        self._check_storeys()
        if parameters.model_free and parameters.hold_authority < EXCITATION:
            needs = f"without a model, the motion is identified with controls of {EXCITATION:g} of the amplitude"
            raise InvalidInput("hold_authority", parameters.hold_authority, needs)

    @cached_property
    def starts(self) -> Mapping[tuple[float, float], tuple[Start, ...]]:
        """Starts to try at each stiffness ratio and frequency [rad/s], the most promising first.

        Forecast and plan share the starts, so that none has to be planned while the bench is armed.
        """
        p, amplitude = self.parameters, self._amplitude
        found: dict[tuple[float, float], tuple[Start, ...]] = {}
        load_model(self.progress)
        done = counting(self.progress, "planning the starts")
        for beta in p.beta:
            coupled = self._specimen.coupled(beta)
            for omega in p.omega:
                branch = predict_gain(coupled, omega, amplitude).rocking
                orbit = branch.orbit if branch else None
                planned = plan_starts(coupled, omega, amplitude, orbit, p.starts, self.configuration.known)
                found[beta, omega] = tuple(planned)
                done(len(found), len(p.beta) * len(p.omega))
        return found

    @cached_property
    def forecast(self) -> Forecast:
        return forecast(self.parameters, self.configuration, self.starts, self._steady_motion, self.progress)

    @cached_property
    def prediction(self) -> Table:
        known = self.configuration.known_on_table
        inputs = [each.model_dump(mode="json") for each in (self.parameters, self._specimen, known)]

        def spectra() -> dict[str, Any]:
            table = gain_spectra(self.parameters, self._specimen, known)
            return {name: [each.values.tolist(), each.unit, each.description] for name, each in table.items()}

        stored = cached("gain_spectra", inputs, spectra)
        return {name: Column(np.array(values), unit, text) for name, (values, unit, text) in stored.items()}

    def plan(self) -> Plan:
        points = yield from HarmonicPlan(self.parameters, self.configuration, self.starts).steps()
        return self.result(points)

    def result(self, points: Sequence[Parameters]) -> Result:
        from bench.figures.spectra_figure import gain_spectra as drawn
        from bench.figures.style import write_figure

        return Result(
            points=tuple(points),
            text=points_table(points),
            figures={"gain_spectra.png": lambda path: write_figure(path, drawn(points, arrays(self.prediction)))},
        )

    def _steady_motion(self, beta: float | None, omega: float) -> Travel | None:
        """Peak displacements of the storeys, as the lasers measure them, and peak drift [m], in the steady state at
        `omega` [rad/s].

        The motion is that of the bare frame if `beta` is None, otherwise the rocking motion; None without an orbit.
        """
        if (beta, omega) not in self._motions:
            grounded = self.configuration.laser_reference == "ground"
            specimen = self._specimen if beta is None else self._specimen.coupled(beta)
            peaks = _bare_peaks if beta is None else _rocking_peaks
            self._motions[beta, omega] = peaks(specimen, omega, self._amplitude, grounded)
        return self._motions[beta, omega]

    def _check_table(self) -> None:
        """Raise InvalidInput if the table's motion (x = a / Omega^2), including the overshoot of a start, exceeds a
        limit or the stroke, or if the settle limit is too short for the detection of a steady state.
        """
        parameters, configuration = self.parameters, self.configuration
        limits, stroke = configuration.limits, configuration.half_stroke
        peak = max(OVERSHOOTS) * self._amplitude
        if peak > limits.acceleration:
            allowed = f"a start needs {peak:.3g} m/s2, but limits.acceleration = {limits.acceleration:g} m/s2"
            raise InvalidInput("amplitude_factor", parameters.amplitude_factor, allowed)
        start = f"a start of {peak:.3g} m/s2"
        reach, owner = min((stroke, "the shaker's stroke"), (limits.displacement, "limits.displacement"))
        for omega in parameters.omega:
            travel, speed = peak / omega**2, peak / omega
            at = f"{start} at {omega / tau:.2f} Hz"
            if travel > reach:
                needs = f"{at} needs {1e3 * travel:.1f} mm, but {owner} allows {1e3 * reach:.1f} mm"
                raise InvalidInput("omega", omega, needs)
            if speed > limits.velocity:
                needs = f"{at} needs {speed:.3g} m/s, but limits.velocity = {limits.velocity:g} m/s"
                raise InvalidInput("omega", omega, needs)
            if parameters.settle_limit < 2 * WINDOW * tau / omega:
                needs = f"detecting a steady state at {omega:g} rad/s takes at least {2 * WINDOW * tau / omega:.1f} s"
                raise InvalidInput("settle_limit", parameters.settle_limit, needs)

    def _check_storeys(self) -> None:
        """Raise InvalidInput for a frequency at which a storey would leave its laser's range, with the bare frame or in
        the steady rocking motion.
        """
        halves = self.configuration.laser_half_ranges
        for omega in self.parameters.omega:
            for beta in (None, *self.parameters.beta):
                motion = self._steady_motion(beta, omega)
                peaks = () if motion is None else (motion.storey_1, motion.storey_2)
                for number, (peak, half) in enumerate(zip(peaks, halves, strict=False), 1):
                    if peak > half:
                        what = "the bare frame" if beta is None else f"the frame with beta = {beta:g}"
                        moves = f"storey {number} of {what} moves by {1e3 * peak:.0f} mm at this frequency"
                        needs = f"{moves}, but its laser measures only up to {1e3 * half:.0f} mm"
                        raise InvalidInput("omega", omega, needs)


def _bare_peaks(specimen: Specimen, omega: float, amplitude: float, grounded: bool) -> Travel:
    u1, u2 = steady_response(specimen, omega, amplitude)
    table = -amplitude / omega**2 if grounded else 0.0
    return Travel(abs(u1 + table), abs(u2 + table), abs(u2 - u1))


def _rocking_peaks(specimen: Specimen, omega: float, amplitude: float, grounded: bool) -> Travel | None:
    try:
        phase, u1, u2, _ = rocking_orbit(specimen, omega, amplitude).samples(64).T
    except NoOrbit:
        return None
    table = -amplitude / omega**2 * np.sin(phase) if grounded else np.zeros_like(phase)
    return Travel(*(float(np.abs(each).max()) for each in (u1 + table, u2 + table, u2 - u1)))


def gain_spectra(parameters: HarmonicParameters, specimen: Specimen, known: SpecimenKnowledge) -> Table:
    """alpha_2 against Omega for every spring at the configured amplitude, one row for each existing branch.

    The uncertainty band of alpha_2 (k = 2, first order) follows from the uncertainty of the specimen.
    """
    amplitude = parameters.amplitude_factor * specimen.uplift_acceleration
    low, high = max(min(parameters.omega) - MARGIN, STEP), max(parameters.omega) + MARGIN
    omegas = np.linspace(low, high, round((high - low) / STEP) + 1)
    rows = [
        (prediction.omega, beta, branch, name)
        for beta in parameters.beta
        for prediction in gain_spectrum(specimen.coupled(beta), omegas, amplitude)
        for name, branch in prediction.branches.items()
    ]
    if not rows:
        raise InvalidInput("specimen", "as configured", "no steady motion exists at the frequencies of the campaign")
    omega, beta, branches, names = (list(column) for column in zip(*rows, strict=True))
    alpha_2 = np.array([branch.alpha_2 for branch in branches])
    band = bands([branch.orbit for branch in branches], alpha_2, known)
    return {
        "omega": Column(np.array(omega), "rad/s", "circular frequency of the base motion"),
        "beta": Column(np.array(beta), "1", "stiffness ratio of the coupling spring"),
        "alpha_1": Column(np.array([branch.alpha_1 for branch in branches]), "1", "gain of the peak displacement u1"),
        "alpha_2": Column(alpha_2, "1", "gain of the peak drift"),
        "alpha_2_uncertainty": Column(
            band.uncertainty, "1", "expanded uncertainty of alpha_2 (k = 2) due to the specimen"
        ),
        "alpha_2_low": Column(band.low, "1", "lower bound of the band of alpha_2"),
        "alpha_2_high": Column(band.high, "1", "upper bound of the band of alpha_2"),
        "stable": Column(np.array([branch.stable for branch in branches]), "1", "whether the motion is stable"),
        "layer": Column(np.array(names), "", "branch: rocking, or resting if the block never lifts"),
    }


WIDTH = 118
ABSENT = "-"

_COLUMNS = (
    TextColumn("beta", "1"),
    TextColumn("omega", "rad/s"),
    TextColumn("status", words=True),
    TextColumn("branch", words=True),
    TextColumn("alpha_2", "1"),
    TextColumn("U (k=2)", "1"),
    TextColumn("predicted", "1"),
    TextColumn("diff.", "%"),
    TextColumn("orbit", words=True),
    TextColumn("starts", "1"),
    TextColumn("chance", "1"),
    TextColumn("settled", "s"),
    TextColumn("agrees", words=True),
)


def points_table(points: Sequence[PointLike]) -> str:
    """Text table of harmonic points, followed by remarks. Absent values are "-"; "NO <" in the last column marks a
    disagreement with the prediction.
    """
    rows = plain(points)
    return "\n".join([text_table(_COLUMNS, map(_cells, rows)), *_remarks(rows)])


def _cells(row: dict[str, Any]) -> list[str]:
    def number(name: str, form: str) -> str:
        value = row.get(name)
        return ABSENT if value is None else format(value, form)

    def verdict(name: str, yes: str, no: str) -> str:
        value = row.get(name)
        return ABSENT if value is None else yes if value else no

    measured, predicted = row.get("alpha_2"), row.get("alpha_2_predicted")
    compared = row.get("status") in COMPARED
    return [
        number("beta", ".3f"),
        number("omega_rad_s", ".3f"),
        str(row.get("status") or ABSENT),
        str(row.get("layer") or ABSENT),
        number("alpha_2", ".4f"),
        number("alpha_2_uncertainty", ".4f"),
        number("alpha_2_predicted", ".4f"),
        f"{100.0 * (measured / predicted - 1.0):+.2f}" if compared and measured is not None and predicted else ABSENT,
        verdict("predicted_stable", "stable", "unstable"),
        number("starts_tried", "d"),
        number("start_chance", ".2f"),
        number("settle_time_s", ".1f"),
        verdict("agrees", "yes", "NO <"),
    ]


def _remarks(rows: list[dict[str, Any]]) -> list[str]:
    compared = [row["agrees"] for row in rows if row.get("agrees") is not None]
    disagreeing = len(compared) - sum(compared)
    verdict = counted(disagreeing, "disagrees", "disagree")
    result = f"{len(compared)} of {len(rows)} points compared with the prediction, {verdict}."
    lines = ["", result if rows else "No point was measured."]
    orbits = [row["orbit_agrees"] for row in rows if row.get("orbit_agrees") is not None and row.get("agrees") is None]
    if orbits:
        verdict = counted(len(orbits) - sum(orbits), "disagrees", "disagree")
        lines.append(f"Unsteady points compared by the gain of their mean cycle: {len(orbits)}, {verdict}.")
    known = [row for row in rows if row.get("dominating") and row.get("alpha_2")]
    if known:
        shares = [100.0 * row["alpha_2_uncertainty"] / row["alpha_2"] for row in known]
        most = Counter(str(row["dominating"]) for row in known).most_common()
        named = ", ".join(f"{name} ({number})" for name, number in most)
        span = " to ".join(dict.fromkeys(f"{share:.2f}" for share in (min(shares), max(shares))))
        text = f"Expanded uncertainty of alpha_2 (k = 2): {span} %; largest contribution (number of points): {named}."
        if (source := SOURCES.get(most[0][0])) is not None:
            text += f" To reduce {'it' if len(most) == 1 else 'the first'}: {source.measure}."
        lines += textwrap.wrap(text, WIDTH)
    remarks = [str(row.get("reason") or "").split("; ") for row in rows]
    shared = [each for each in remarks[0] if each and all(each in own for own in remarks)] if len(rows) > 1 else []
    heads = ["every point: ", *(f"omega {row['omega_rad_s']:g} rad/s, beta {row['beta']:g}: " for row in rows)]
    own = [[each for each in remark if each and each not in shared] for remark in remarks]
    for head, texts in zip(heads, [shared, *own], strict=True):
        if texts:
            lines += textwrap.wrap(head + "; ".join(texts), WIDTH, subsequent_indent="    ")
    return lines
