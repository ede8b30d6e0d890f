"""Time per trajectory of many members, against heyoka's batch mode."""

from importlib.util import find_spec

import pytest

from bench.app.benchmark import members as part
from bench.app.benchmark.members import OURS, THEIRS, members


def test_members_are_timed_and_compared_at_equal_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(part, "TOLERANCES", (1e-8, 1e-11))
    monkeypatch.setattr(part, "PEER_TOLERANCES", (1e-9,))
    section = members(1)
    ours = [row for row in section.rows if row["method"] == OURS]
    assert [row["status"] for row in ours] == ["ok", "ok"]
    first, second = (row["error"] for row in ours)
    assert isinstance(first, float)
    assert isinstance(second, float)
    assert second < 1e-12 < first < 1e-8
    (target,) = section.targets
    if find_spec("heyoka") is None:
        assert target.measured is None
        return
    (theirs,) = (row for row in section.rows if row["method"] == THEIRS)
    assert theirs["status"] == "ok"
    assert target.measured == pytest.approx(float(ours[1]["min_ms"] or 0.0) / float(theirs["min_ms"] or 1.0))
