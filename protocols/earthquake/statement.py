"""The paper's statement on earthquakes (section 5), checked by name: for the band and the records that were used.

"In all the cases, the gain coefficient alpha_2 is less than unity", "around the 50 % drift reduction" is reached, and
"for higher values of the stiffness ratio beta, the gain curves approach the unity".
"""

from collections.abc import Mapping, Sequence
from typing import Any

from bench.prediction.seismic_statement import ABOUT
from bench.report.rows import PointLike, plain

NAME = "seismic gains below one, best around 0.5, towards one as beta grows"

_SOURCES = {
    "measured": ("alpha_2", "alpha_2_uncertainty"),
    "predicted for the achieved motion": ("alpha_2_predicted", None),
    "predicted for the asked motion": ("alpha_2_target", None),
}
"""Where gains come from, and the fields that hold them and their uncertainty."""


def check_statement(points: Sequence[PointLike], band: tuple[float, float]) -> dict[str, Any]:
    """The verdicts "holds", "does not hold" or "undecided" on each part, with the numbers, per record and overall."""
    rows = plain(points)
    return {
        "statement": NAME,
        "source": "section 5 of the paper",
        "band_hz": list(band),
        **{name: _checked(rows, *fields) for name, fields in _SOURCES.items()},
    }


def statement_text(checked: Mapping[str, Any]) -> str:
    """The verdicts as lines for the terminal."""
    low, high = checked["band_hz"]
    lines = [f"Statement of the paper: {checked['statement']}. Records within {low:g} to {high:g} Hz."]
    for name in _SOURCES:
        found = checked[name]
        best = f"best {_number(found['best'])}: around 0.5 {found['around_half']}"
        lines.append(f"  {name}: below one {found['below_one']}; {best}; towards one {found['towards_one']}")
        for record in found["records"]:
            pairs = zip(record["beta"], record["alpha_2"], strict=True)
            gains = ", ".join(f"{beta:g}: {_number(gain)}" for beta, gain in pairs)
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
    return {
        "record": name,
        "beta": [row["beta"] for row in rows],
        "alpha_2": gains,
        "toppled": [row["beta"] for row in rows if row["status"] == "overturned"],
        "below_one": _all([_below_one(value, doubt) for value, doubt in known] + ["undecided"] * (not known)),
        "towards_one": _towards_one(known) if len(known) > 1 else "undecided",
    }


def _below_one(gain: float, uncertainty: float) -> str:
    return "undecided" if abs(gain - 1.0) <= uncertainty else _verdict(gain < 1.0)


def _towards_one(known: Sequence[tuple[float, float]]) -> str:
    """Whether the stiffest spring's gain is nearer to one than the softest one's."""
    (first, doubt), (last, other) = known[0], known[-1]
    nearer = abs(first - 1.0) - abs(last - 1.0)
    return "undecided" if abs(nearer) <= (doubt**2 + other**2) ** 0.5 else _verdict(nearer > 0.0)


def _all(verdicts: Sequence[str]) -> str:
    if "does not hold" in verdicts:
        return "does not hold"
    return "holds" if verdicts and set(verdicts) == {"holds"} else "undecided"


def _verdict(holds: bool) -> str:
    return "holds" if holds else "does not hold"


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"
