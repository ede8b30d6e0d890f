"""Seismic campaign (section 5 of the paper): predicted curves, results, and verdicts on the paper's statement."""

import textwrap
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from bench.config.model import BenchConfiguration
from bench.datafile.tables import Column, Table, arrays
from bench.figures.earthquake_figure import DriftPicture, MotionPicture, drift_figure, gain_figure, motion_figure
from bench.figures.style import write_figure
from bench.figures.summary import PointLike, plain
from bench.figures.text_table import TextColumn, text_table
from bench.prediction.statements import ABOUT
from bench.preflight.margins import Forecast
from bench.protocol import Plan, Prepared, Result, Sources
from protocols.earthquake.forecast import Combination, beyond_limits, combinations, forecast
from protocols.earthquake.laser_check import advice, laser_check
from protocols.earthquake.measurement import STEP, Histories
from protocols.earthquake.plan import EarthquakePlan
from protocols.earthquake.protocol import EarthquakeParameters, PointStatus
from protocols.earthquake.records import FileSources, LeftOut, Shaking, band_used, shakings
from protocols.earthquake.table import TableSource
from sim.gain import SeismicGain, seismic_curve
from sim.parameters import Parameters
from sim.specimen import Specimen

Curves = Mapping[str, Sequence[SeismicGain]]
"""Gains of each record, by ascending stiffness ratio."""


class EarthquakeCampaign(Prepared[EarthquakeParameters]):
    """Seismic campaign. Reads and prepares the records; raises InvalidInput for records unsuitable for the bench."""

    def __init__(
        self, parameters: EarthquakeParameters, configuration: BenchConfiguration, stored: Sources | None = None
    ) -> None:
        super().__init__(parameters, configuration, stored)
        self._stored = kept = None if stored is None else FileSources.stored(stored)
        self.table = TableSource.of(parameters, configuration, kept)
        self.shakings = shakings(parameters, configuration, kept)
        self.check = laser_check(parameters, configuration)
        self._histories = Histories()

    @cached_property
    def curves(self) -> Curves:
        """Predicted gains under the target motions."""
        return curves(self.parameters, self.shakings, self.configuration.known_specimen)

    @cached_property
    def combinations(self) -> Sequence[Combination]:
        """Every record with every specimen, and its simulated demands."""
        return combinations(self.parameters, self.configuration, self.shakings, self.progress)

    @cached_property
    def left_out(self) -> LeftOut:
        """Combinations of record and specimen that are not played; in a replay, those stored in the data file."""
        if self._stored is not None:
            return self._stored.left_out
        return beyond_limits(self.combinations, self.configuration)

    @cached_property
    def forecast(self) -> Forecast:
        return forecast(
            self.parameters,
            self.configuration,
            self.shakings,
            self.table,
            self.combinations,
            self.left_out,
            self.check,
        )

    @cached_property
    def prediction(self) -> Table:
        return gain_curves(self.curves)

    @cached_property
    def sources(self) -> Sources:
        records = tuple(shaking.accelerogram for shaking in self.shakings)
        return FileSources(records, self.table.model, self.left_out).tables

    def plan(self) -> Plan:
        kept = self._histories = Histories()
        targets = target_gains(self.curves, self.parameters.beta)
        plan = EarthquakePlan(
            self.parameters, self.configuration, self.shakings, self.table, targets, self.left_out, kept, self.check
        )
        return self.collected(plan.steps())

    def result(self, points: Sequence[Parameters]) -> Result:
        kept = self._histories
        statement = check_statement(points, band_used(self.parameters, self.configuration))

        def gains(path: Path) -> None:
            write_figure(path, gain_figure(points, arrays(self.prediction)))

        def motions(path: Path) -> None:
            asked = kept.requested.items()
            pictures = [MotionPicture(name, kept.interval, a, kept.achieved[name]) for name, a in asked]
            write_figure(path, motion_figure(pictures))

        def drifts(path: Path) -> None:
            shown = [
                DriftPicture(name, beta, kept.interval, each.measured, each.predicted, STEP)
                for (name, beta), each in kept.drifts.items()
            ]
            write_figure(path, drift_figure(shown))

        recommended = "\n".join(textwrap.wrap(advice(self.parameters, self.configuration, plain(points)), WIDTH))
        return Result(
            points=tuple(points),
            text="\n\n".join(filter(None, (earthquake_table(points), recommended, statement_text(statement)))),
            figures={"gain_curves.png": gains, "table_motions.png": motions, "drift_histories.png": drifts},
            findings={"records": [shaking.described() for shaking in self.shakings], "statement": statement},
        )


BETA_STEP = 0.05
"""Step of the stiffness ratio along a predicted curve."""

BETA_MARGIN = 0.15
"""Extension of a predicted curve beyond the stiffness ratios of the campaign."""


def curves(parameters: EarthquakeParameters, shakings: Sequence[Shaking], specimen: Specimen) -> Curves:
    """Gains for every record under its target motion, at the given stiffness ratios and on a grid around them."""
    first, last = max(min(parameters.beta) - BETA_MARGIN, BETA_STEP), max(parameters.beta) + BETA_MARGIN
    grid = np.linspace(first, last, round((last - first) / BETA_STEP) + 1)
    betas = sorted({*(round(float(beta), 6) for beta in grid), *parameters.beta})
    return {shaking.name: seismic_curve(specimen, shaking.prepared.record, betas) for shaking in shakings}


def gain_curves(curves: Curves) -> Table:
    """alpha_1 and alpha_2 against beta, one row per record and beta; NaN where the block topples."""
    rows = [(name, gain) for name, curve in curves.items() for gain in curve]

    def numbers(values: list[float | None], unit: str, description: str) -> Column:
        return Column(np.array([np.nan if value is None else value for value in values]), unit, description)

    return {
        "record": Column(np.array([name for name, _ in rows], dtype=np.str_), "", "name of the record"),
        "beta": Column(np.array([gain.beta for _, gain in rows]), "1", "stiffness ratio of the coupling spring"),
        "alpha_1": numbers([gain.alpha_1 for _, gain in rows], "1", "gain of the peak of u1"),
        "alpha_2": numbers([gain.alpha_2 for _, gain in rows], "1", "gain of the peak drift"),
        "toppled_s": numbers(
            [None if gain.motion.overturned is None else gain.motion.end_time for _, gain in rows],
            "s",
            "time of overturning from the start of the drive; NaN if the block does not topple",
        ),
    }


def target_gains(curves: Curves, betas: Sequence[float]) -> dict[tuple[str, float], float | None]:
    """alpha_2 under the target motion, by record and beta; None where the block topples."""
    return {(name, gain.beta): gain.alpha_2 for name, curve in curves.items() for gain in curve if gain.beta in betas}


WIDTH = 120
ABSENT = "-"

_COLUMNS = (
    TextColumn("record", words=True),
    TextColumn("beta"),
    TextColumn("status", words=True),
    TextColumn("alpha_2"),
    TextColumn("U (k=2)"),
    TextColumn("predicted"),
    TextColumn("95 % interval"),
    TextColumn("target"),
    TextColumn("topples"),
    TextColumn("agrees", words=True),
    TextColumn("dominated by", words=True),
)


def earthquake_table(points: Sequence[PointLike]) -> str:
    """Text table with a row for each point, followed by the number of points that agree and the remarks; absent values
    are "-".
    """
    rows = plain(points)
    return "\n".join([text_table(_COLUMNS, map(_cells, rows)), *_remarks(rows)])


def _cells(row: dict[str, Any]) -> list[str]:
    low, high, agrees = row["alpha_2_low"], row["alpha_2_high"], row["agrees"]
    return [
        str(row["record"]),
        f"{row['beta']:g}",
        str(row["status"]),
        _number(row["alpha_2"]),
        _number(row["alpha_2_uncertainty"]),
        _number(row["alpha_2_predicted"]),
        ABSENT if low is None else f"{low:.3f} to {high:.3f}",
        _number(row["alpha_2_target"]),
        ABSENT if row["topple_chance"] is None else f"{row['topple_chance']:.0%}",
        ABSENT if agrees is None else "yes" if agrees else "NO <",
        row["dominating"] or ABSENT,
    ]


def _remarks(rows: Sequence[dict[str, Any]]) -> list[str]:
    compared = [row for row in rows if row["agrees"] is not None]
    agreeing = sum(bool(row["agrees"]) for row in compared)
    toppled = sum(row["status"] == "overturned" for row in rows)
    played = [row for row in rows if row["status"] != "not played"]
    lines = [
        "",
        f"Gains that agree with the prediction: {agreeing} of {len(compared)}. Runs in which the block toppled: "
        f"{toppled} of {len(played)}.",
    ]
    for row in rows:
        if row["reason"]:
            head = f"{row['record']}, beta {row['beta']:g}: "
            lines += textwrap.wrap(head + str(row["reason"]), WIDTH, subsequent_indent="    ")
    return lines


def _number(value: float | None) -> str:
    return ABSENT if value is None else f"{value:.4f}"


NAME = "seismic gains are below one, about 0.5 at best, and approach one as beta grows"

_SOURCES = {
    "measured": ("alpha_2", "alpha_2_uncertainty"),
    "predicted for the achieved motion": ("alpha_2_predicted", None),
    "predicted for the requested motion": ("alpha_2_target", None),
}
"""Fields of the gain and of its uncertainty, by the source of the gain."""

_TOPPLED = {
    "alpha_2": (PointStatus.OVERTURNED,),
    "alpha_2_predicted": (PointStatus.MEASURED,),
    "alpha_2_target": tuple(PointStatus),
}
"""Statuses of points without a gain whose block, or that of the model, topples; the gain of other points is unknown."""


def check_statement(points: Sequence[PointLike], band: tuple[float, float]) -> dict[str, Any]:
    """Verdicts on each part of the statement ("holds", "does not hold" or "undecided"), with the gains, per record and
    overall.
    """
    rows = plain(points)
    return {
        "statement": NAME,
        "source": "section 5 of the paper",
        "band_hz": list(band),
        **{name: _checked(rows, *fields) for name, fields in _SOURCES.items()},
    }


def statement_text(checked: Mapping[str, Any]) -> str:
    """The verdicts as lines of text for the terminal."""
    low, high = checked["band_hz"]
    lines = [f"Statement of the paper: {checked['statement']}. Band of the records: {low:g} to {high:g} Hz."]
    for name in _SOURCES:
        found = checked[name]
        best = f"best {_gain_text(found['best'])}, around 0.5: {found['around_half']}"
        lines.append(f"  {name}: below one: {found['below_one']}; {best}; towards one: {found['towards_one']}")
        for record in found["records"]:
            pairs = zip(record["beta"], record["alpha_2"], strict=True)
            gains = ", ".join(f"{beta:g}: {_gain_text(gain)}" for beta, gain in pairs)
            lines.append(f"    {record['record']}: {gains}: {record['below_one']}, {record['towards_one']}")
    return "\n".join(lines)


def _checked(rows: Sequence[Mapping[str, Any]], gain: str, uncertainty: str | None) -> dict[str, Any]:
    records = [
        _record(name, [row for row in rows if row["record"] == name], gain, uncertainty)
        for name in dict.fromkeys(str(row["record"]) for row in rows)
    ]
    gains = [value for record in records for value in record["alpha_2"] if value is not None]
    best = min(gains, default=None)
    return {
        "below_one": _all([record["below_one"] for record in records]),
        "best": best,
        "around_half": "undecided" if best is None else _verdict(abs(best - 0.5) <= ABOUT),
        "towards_one": _all([record["towards_one"] for record in records]),
        "records": records,
    }


def _record(name: str, rows: list[Mapping[str, Any]], gain: str, uncertainty: str | None) -> dict[str, Any]:
    rows = sorted(rows, key=lambda row: row["beta"])
    gains = [row[gain] for row in rows]
    doubts = [0.0 if uncertainty is None else row[uncertainty] or 0.0 for row in rows]
    known = [(value, doubt) for value, doubt in zip(gains, doubts, strict=True) if value is not None]
    below = [_below_one(value, doubt) for value, doubt in known]
    # a block that topples has no gain, and counts as a failure of alpha_2 < 1, as in the predicted statement
    below += ["does not hold"] * sum(row[gain] is None and row["status"] in _TOPPLED[gain] for row in rows)
    return {
        "record": name,
        "beta": [row["beta"] for row in rows],
        "alpha_2": gains,
        "toppled": [row["beta"] for row in rows if row["status"] == "overturned"],
        "below_one": _all(below),
        "towards_one": _towards_one(known) if len(known) > 1 else "undecided",
    }


def _below_one(gain: float, uncertainty: float) -> str:
    return "undecided" if abs(gain - 1.0) <= uncertainty else _verdict(gain < 1.0)


def _towards_one(known: Sequence[tuple[float, float]]) -> str:
    """Verdict on whether the gain is closer to one with the stiffest spring than with the softest."""
    (first, doubt), (last, other) = known[0], known[-1]
    nearer = abs(first - 1.0) - abs(last - 1.0)
    return "undecided" if abs(nearer) <= (doubt**2 + other**2) ** 0.5 else _verdict(nearer > 0.0)


def _all(verdicts: Sequence[str]) -> str:
    if "does not hold" in verdicts:
        return "does not hold"
    return "holds" if verdicts and set(verdicts) == {"holds"} else "undecided"


def _verdict(holds: bool) -> str:
    return "holds" if holds else "does not hold"


def _gain_text(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"
