"""What a run identified is in its data file and in the journal beside, as it was said last."""

import json
from datetime import UTC, datetime
from pathlib import Path

import pytest

from bench.app.export.format import content_of
from bench.datafile.reader import open_datafile
from bench.datafile.writer import journal_path
from bench.findings import SpecimenIdentified
from sim.identified import Correlation, Finding, Identified
from tests.bench.datafile.example import begin, record

DATE = datetime(2026, 11, 20, 9, 30, tzinfo=UTC)


def found(name: str, value: float) -> Finding:
    return Finding(name=name, value=value, standard_uncertainty=0.01 * value, source="decay: ω₁", date=DATE)


FIRST = Identified(findings=(found("k1", 210.0),))
LAST = Identified(
    findings=(found("k1", 211.0), found("xi1", 0.01), found("k_c:0.25", 52.0)),
    correlations=(Correlation(first="k1", second="k_c:0.25", coefficient=-0.4),),
)


@pytest.mark.parametrize("said", [(), (FIRST,), (FIRST, LAST), (LAST, FIRST)])
def test_what_was_said_last_comes_back(said: tuple[Identified, ...], tmp_path: Path) -> None:
    path = tmp_path / "campaign.h5"
    record(begin(path), *(SpecimenIdentified(each, time=1.0) for each in said))
    with open_datafile(path) as kept:
        assert kept.identified == (said[-1] if said else None)
        assert [each.kind for each in kept.events] == ["SpecimenIdentified"] * len(said)
        assert not {"identified", "identified_correlations"} & set(kept.tables)
        tables = content_of(kept, path, raw=False).tables
    assert ("identified" in tables) == bool(said)
    journal = [json.loads(line) for line in journal_path(path).read_text(encoding="utf-8").splitlines()]
    assert [Identified.model_validate(line["identified"]) for line in journal if "identified" in line] == list(said)
