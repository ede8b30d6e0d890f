"""kill -9 of the program while the shaker is driven: what the hardware does then, and what it does not."""

import os
import signal
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from functools import cache

import numpy as np
import pytest

from bench.datafile.reader import open_datafile
from tests.faults.emulated.killed import Aftermath, kill_at
from tests.faults.emulated.setup import KEEPER, PLACES, SETTING
from tests.faults.emulated.truth import GRACE, rest_rules
from tests.faults.places import Place

pytestmark = [
    pytest.mark.skipif(os.name != "posix", reason="kills processes the POSIX way"),
    pytest.mark.milliseconds,
    pytest.mark.seconds,
]

DRIVEN = ("at rest", "dwelling", "stopping", "aborting")
"""A place in each state in which the rig is armed; the ramps have just begun there, and are not yet in the buffer."""
FEWER = ("dwelling", "aborting")
KEEPERS = {
    "watchdog": {"watchdog": True, "heartbeat": False},
    "heartbeat": {"watchdog": False, "heartbeat": True},
    "neither": {"watchdog": False, "heartbeat": False},
}
CASES = [(name, keeper) for keeper in KEEPERS for name in (DRIVEN if keeper == "watchdog" else FEWER)]
MORE = [(name, "heartbeat") for name in DRIVEN if name not in FEWER]
"""With the mark soak."""
AT_A_TIME = 4

Killed = Callable[[str, str], Aftermath]
"""What became of a case: place and keeper."""


def _each(cases: Sequence[tuple[str, str]]) -> pytest.MarkDecorator:
    more = [pytest.param(*case, marks=pytest.mark.soak) for case in MORE]
    return pytest.mark.parametrize(("name", "keeper"), [*cases, *more])


@pytest.fixture(scope="module")
def killed(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Killed]:
    """All of `CASES` at once: most of it is waiting."""
    with ThreadPoolExecutor(AT_A_TIME) as pool:

        @cache
        def begun(name: str, keeper: str) -> Future[Aftermath]:
            return pool.submit(kill_at, name, tmp_path_factory.mktemp("killed"), **KEEPERS[keeper])

        for case in CASES:
            begun(*case)
        yield lambda name, keeper: begun(name, keeper).result()


def _place(name: str) -> Place:
    return next(place for place in PLACES if place.name == name)


@_each([case for case in CASES if case[1] != "neither"])
def test_the_chain_opens_by_itself(name: str, keeper: str, killed: Killed) -> None:
    after = killed(name, keeper)
    assert after.exit_code == -signal.SIGKILL
    assert after.opened_after is not None
    assert after.opened_after < KEEPER + GRACE
    _within_limits(after)
    assert after.truth.amplifier[-1] == 0.0
    assert not list(rest_rules(after.witness))


@pytest.mark.parametrize("name", FEWER)
def test_with_neither_the_output_holds_its_last_value_on_a_closed_relay(name: str, killed: Killed) -> None:
    """What the software cannot do, and the emergency stop is for."""
    after = killed(name, "neither")
    assert after.exit_code == -signal.SIGKILL
    assert after.opened_after is None
    quiet = after.truth.amplifier[-round(0.5 * KEEPER * SETTING.rate) :]
    assert (quiet == after.held).all()
    assert after.held != 0.0
    _within_limits(after)


@_each(CASES)
def test_the_next_program_makes_it_safe_and_the_file_is_readable(name: str, keeper: str, killed: Killed) -> None:
    after = killed(name, keeper)
    assert "rockbench_out" in after.found
    assert (after.enabled_after, after.held_after) == (False, 0.0)
    with open_datafile(after.path) as record:
        assert record.status == "running"
        states = [event.text for event in record.events if event.kind == "StateChanged"]
        assert f"-> {_place(name).state}" in states[-1]
        drive, blocks = record.drive(), record.blocks
    # what the file says of the first run is what left the output stage, from its first sample that is not zero on
    ends = blocks["row"][blocks["run"] > 1]
    first = np.trim_zeros(drive[: ends[0]] if ends.size else drive, "f")
    left = np.trim_zeros(after.truth.output, "f")[: first.size]
    assert (left.astype(np.float32) == first).all()


def _within_limits(after: Aftermath) -> None:
    truth, limits = after.truth, SETTING.limits
    for values, limit in (
        (truth.output, limits.drive_voltage),
        (truth.x, limits.displacement),
        (truth.v, limits.velocity),
        (truth.a, limits.acceleration),
    ):
        assert np.abs(values).max() <= limit
