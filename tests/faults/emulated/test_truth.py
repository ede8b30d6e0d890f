"""The rules find what is not as it should be: each is broken once."""

import os
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.faults.emulated.bench import WiredBench
from tests.faults.emulated.fault import WiredFault
from tests.faults.emulated.judge import judge
from tests.faults.emulated.setup import PLACES, SETTING
from tests.faults.emulated.truth import end_rules, motion_rules, played_rules
from tests.faults.emulated.witness import Truth
from tests.faults.fault import never

pytestmark = pytest.mark.skipif(os.name != "posix", reason="an emulated laboratory for POSIX")

REST = Truth(0, *np.zeros((5, 100)))
COMPLETED: Any = SimpleNamespace(status="completed")
FAILED: Any = SimpleNamespace(status="failed")
NOTHING = WiredFault("nothing", lambda _: None, "completed", "", never)


def _with(**changed: float) -> Truth:
    """At rest but for one tick."""
    return replace(REST, **{name: np.where(np.arange(100) == 50, value, 0.0) for name, value in changed.items()})


@pytest.mark.parametrize(
    ("name", "value", "unit"),
    [("output", 3.01, "V"), ("x", -0.0051, "m"), ("v", 0.0901, "m/s"), ("a", -1.91, "m/s2"), ("x", float("nan"), "m")],
)
def test_one_tick_beyond_a_limit(name: str, value: float, unit: str) -> None:
    (broken,) = motion_rules(_with(**{name: value}), COMPLETED)
    assert f"{unit} where" in broken
    assert not list(motion_rules(_with(**{name: 0.0}), COMPLETED))


def test_a_step_is_allowed_only_to_zero_and_only_where_the_chain_was_cut() -> None:
    falling = replace(REST, amplifier=np.where(np.arange(100) < 50, np.minimum(0.3 * np.arange(100), 1.0), 0.0))
    assert "V/s" in " ".join(motion_rules(falling, COMPLETED))
    assert not list(motion_rules(falling, FAILED))
    rising = replace(REST, amplifier=falling.amplifier[::-1].copy())
    assert "V/s" in " ".join(motion_rules(rising, FAILED))


def test_what_was_left_driven_and_what_was_played_otherwise(tmp_path: Path) -> None:
    bench = WiredBench(tmp_path / "campaign.h5")
    try:
        rig = bench.wired
        rig.arm()
        rig.write(np.ones(SETTING.lead))
        for _ in range(3):
            rig.write(np.ones(SETTING.block))
            rig.read(SETTING.block)
        told = " ".join(end_rules(bench, NOTHING))
        truth = bench.witness.told()
        assert not list(played_rules(bench, truth))
        rig.runs[0].written[0] = 0.5 * rig.runs[0].written[0]
        assert "something else from sample 0" in " ".join(played_rules(bench, truth))
        rig.close()
        assert not list(end_rules(bench, NOTHING))
    finally:
        bench.rig.close()
        bench.laboratory.close()
        assert bench.recorder is not None
        bench.recorder.close("failed")
    assert "the relay is closed" in told
    assert "the output stage holds 1 V" in told
    assert "the amplifier hears 1 V" in told


def test_a_fault_that_does_not_strike_is_lost(tmp_path: Path) -> None:
    place = next(place for place in PLACES if place.name == "half aborted")
    verdict = judge(replace(NOTHING, fired=lambda _: False), place, tmp_path).verdict
    assert verdict.lost
    assert any("lost" in broken for broken in verdict.broken)
