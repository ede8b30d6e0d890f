"""What a run identified of the specimen, as often as it was said: findings and their correlations as rows."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Any

from bench.record.fields import Field, Kind
from bench.record.rows import Rows
from sim.identified import Correlation, Finding, Identified

FINDINGS = (
    Field("number", Kind.WHOLE, "1", "how many findings had been written before these were said: the last count"),
    Field("time", Kind.REAL, "s", "bench time"),
    Field("name", Kind.TEXT, "", "the quantity, as in a specimen file"),
    Field("value", Kind.REAL, "of the row", "best estimate"),
    Field("standard_uncertainty", Kind.REAL, "of the row", "standard uncertainty (k = 1)"),
    Field("unit", Kind.TEXT, "", "SI unit of both"),
    Field("source", Kind.TEXT, "", "what it was found from"),
    Field("date", Kind.TEXT, "", "when it was measured, ISO 8601 with zone"),
)
CORRELATIONS = (
    Field("number", Kind.WHOLE, "1", "that of the findings which it goes with"),
    Field("first", Kind.TEXT, "", "name of a finding"),
    Field("second", Kind.TEXT, "", "name of another"),
    Field("coefficient", Kind.REAL, "1", "correlation coefficient of their errors; of other pairs it is 0"),
)
TABLES = {"identified": FINDINGS, "identified_correlations": CORRELATIONS}


def add(rows: Mapping[str, Rows], time: float, identified: Identified) -> None:
    """Append what was said to its tables."""
    number = len(rows["identified"])
    for one in identified.correlations:
        rows["identified_correlations"].add(number, one.first, one.second, one.coefficient)
    for each in identified.findings:
        uncertain = (each.value, each.standard_uncertainty, each.unit)
        rows["identified"].add(number, time, each.name, *uncertain, each.source, each.date.isoformat())


def last(findings: Sequence[Mapping[str, Any]], correlations: Sequence[Mapping[str, Any]]) -> Identified | None:
    """What was said last, from the rows of both tables; None where nothing was."""
    if not findings:
        return None
    number = findings[-1]["number"]
    names = ("name", "value", "standard_uncertainty", "source")
    return Identified(
        findings=tuple(
            Finding(**{name: row[name] for name in names}, date=datetime.fromisoformat(row["date"]))
            for row in findings
            if row["number"] == number
        ),
        correlations=tuple(
            Correlation(first=row["first"], second=row["second"], coefficient=row["coefficient"])
            for row in correlations
            if row["number"] == number
        ),
    )
