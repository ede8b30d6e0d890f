"""Faults while a captured motion is held: the hold is released or the run ended, and the reason names the cause.

Whatever the fault: no command beyond its limits, output at zero at the end, table within its limits, file whole.
"""

import re
from collections.abc import Callable
from itertools import count
from pathlib import Path

import numpy as np
import pytest

from bench.datafile.reader import open_datafile
from bench.events import LimitExceeded
from drivers.rig import Block
from protocols.harmonic.campaign import HarmonicCampaign
from protocols.harmonic.protocol import HarmonicParameters, PointStatus
from tests.faults.audit import drive_rules, sample_rules, table_rules
from tests.faults.rig import FaultyRig
from tests.faults.samples import Making, invalid, late, lost_for, once, stuck
from tests.protocols.harmonic.held_bench import CONFIGURATION, Begin, Story, Tape, TapedRig, captured, continued
from tests.whole import partial

pytestmark = pytest.mark.usefixtures("shared_results", "no_specimens")

OMEGA = 15.0
PARAMETERS = HarmonicParameters(
    omega=(OMEGA,), beta=(0.97,), starts=1, settle_limit=12.0, ramp_time=4.0, harmonics=3, measured_cycles=12
)
RATE, BLOCK, LIMITS = CONFIGURATION.sample_rate, CONFIGURATION.block_samples, CONFIGURATION.limits
LASER_1, LASER_2 = 2, 3
"""Columns of the counts."""
LAG = np.radians(40.0)


@pytest.fixture(scope="module")
def tape(shared_results: None) -> Tape:  # noqa: ARG001 - its starts are planned once
    return captured(HarmonicCampaign(PARAMETERS, CONFIGURATION))


@pytest.fixture
def story(tape: Tape, tmp_path: Path) -> Callable[[Begin], Story]:
    """Continue the captured motion with a fault, and hold what came of it against the rules of every run."""

    def tell(begin: Begin) -> Story:
        path = tmp_path / "run.h5"
        found = continued(tape, begin, path)
        assert not unsound(found, path), found.ending
        return found

    return tell


def released(told: Story, tape: Tape) -> str:
    """Reason of a point whose hold was released within a few cycles of the fault, after which the run went on."""
    assert told.ending.status == "completed"
    (point,) = told.points
    assert point.status is PointStatus.MODULATED
    assert f"released after cycle {told.cycles[-1].cycle}" in point.reason
    assert not [event for event in told.events if isinstance(event, LimitExceeded)]
    assert tape.cycles < told.cycles[-1].cycle <= tape.cycles + 4
    return point.reason


def unsound(story: Story, path: Path) -> list[str]:
    """The rules that a continued campaign broke."""
    rig, ending = story.rig, story.ending
    broken = [rule for run in rig.runs for rule in (*drive_rules(run, LIMITS, RATE), *table_rules(run, LIMITS))]
    broken += [
        f"the output ended at {run.drive[run.read - 1]} V" for run in rig.runs if run.drive[run.read - 1 :].any()
    ]
    broken += ["the rig is armed at the end"] if rig.armed else []
    broken += ["the enable line was cut"] if rig.cuts else []
    if (lacking := partial(path)) is not None:
        broken.append(lacking)
    with open_datafile(path) as record:
        broken += sample_rules(record, rig.runs)
        if (record.status, record.summary) != (ending.status, ending.reason):
            broken.append(f"the file says {record.status}: {record.summary}")
    return broken


def sampled(making: Making) -> Begin:
    """A fault of what is read."""
    return lambda rig, _: rig.falsify.append(making(rig))


def amplified(gain: float, lag: float) -> Begin:
    """A table that answers with another gain, and later by `lag` [rad]."""

    def begin(_: FaultyRig, own: TapedRig) -> None:
        own.gain, own.late = gain, round(lag / OMEGA * RATE)

    return begin


def delayed(samples: int) -> Begin:
    """All channels are read later than assumed."""

    def begin(rig: FaultyRig, own: TapedRig) -> None:
        before = [own.blocks[-1][1]]

        def change(block: Block) -> Block:
            queue = np.concatenate((before[0], block.counts))
            before[0] = block.counts
            return Block(block.first, queue[BLOCK - samples : 2 * BLOCK - samples])

        rig.falsify.append(change)

    return begin


@pytest.mark.parametrize(
    ("begin", "gain", "phase"),
    [
        pytest.param(amplified(0.7, 0.0), 0.7, 0.0, id="gain too small"),
        pytest.param(amplified(1.3, 0.0), 1.3, 0.0, id="gain too large", marks=pytest.mark.soak),
        pytest.param(amplified(1.0, LAG), 1.0, -40.0, id="phase", marks=pytest.mark.soak),
        pytest.param(delayed(round(LAG / OMEGA * RATE)), 1.0, -40.0, id="samples late"),
    ],
)
def test_a_table_that_answers_otherwise_releases_the_hold(
    story: Callable[[Begin], Story], tape: Tape, begin: Begin, gain: float, phase: float
) -> None:
    reason = released(story(begin), tape)
    told = re.search(r"response to the drive changed: gain by a factor of (\S+), phase by (\S+) degrees", reason)
    assert told is not None, reason
    assert float(told[1]) == pytest.approx(gain, abs=0.03)
    assert float(told[2]) == pytest.approx(phase, abs=3.0)
    late = re.search(r"like a delay of (\d+) ms", reason)
    assert (late is not None) == (phase < 0.0)
    if late is not None:
        assert float(late[1]) == pytest.approx(1e3 * LAG / OMEGA, abs=4.0)


def test_a_laser_that_loses_its_target_in_every_block_releases_the_hold(
    story: Callable[[Begin], Story], tape: Tape
) -> None:
    """For eight seconds, so that a hold that bears it comes to an end."""

    def begin(rig: FaultyRig, _: TapedRig) -> None:
        lost, blocks = lost_for(LASER_1, BLOCK * 2 // 5)(rig), count()
        rig.falsify.append(lambda block: lost(block) if next(blocks) < 40 else block)

    reason = released(story(begin), tape)
    assert "3 successive cycles could not be measured: a sensor may have lost its target" in reason


@pytest.mark.parametrize(
    ("making", "says"),
    [
        pytest.param(invalid(LASER_1), "time without a valid sample from laser_1", id="laser lost"),
        pytest.param(
            stuck(LASER_2), "time with a constant count of laser_2", id="laser frozen", marks=pytest.mark.soak
        ),
        pytest.param(once(late(0.6)), "delay of a block of samples", id="block late"),
    ],
)
def test_the_run_is_ended_by_the_guard(story: Callable[[Begin], Story], making: Making, says: str) -> None:
    told = story(sampled(making))
    assert told.ending.status == "aborted"
    assert says in told.ending.reason
    assert not told.points


def test_stalls_shorter_than_the_limit_are_borne(story: Callable[[Begin], Story]) -> None:
    """Corrections begin at samples, not at times."""

    def begin(rig: FaultyRig, _: TapedRig) -> None:
        stalled = late(0.3)(rig)
        rig.falsify.append(lambda block: stalled(block) if block.first // BLOCK % 5 == 0 else block)

    told = story(begin)
    (point,) = told.points
    assert point.status is PointStatus.HELD, point.reason
    assert point.control_share is not None
    assert point.control_share < 1e-3
