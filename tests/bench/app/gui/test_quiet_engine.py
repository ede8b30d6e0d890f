"""A session that lives and an engine that hangs: the window shows no link, never the last known state."""

from pathlib import Path

import pytest
from pytestqt.qtbot import QtBot

from bench.app.display import texts
from bench.app.gui.controller import Controller
from bench.app.ipc.messages import SILENCE, Beat
from bench.events import State
from tests.bench.app.gui.conftest import ScriptedClient
from tests.bench.app.ipc.experiment import bench, order

LATE = SILENCE + bench().acquisition.block_duration + 0.01


@pytest.mark.parametrize(
    ("state", "realtime", "quiet", "word"),
    [
        (State.RUNNING, True, LATE, texts.NO_LINK),
        (State.ARMED, True, LATE, texts.NO_LINK),
        (State.RUNNING, True, LATE - 0.02, texts.WORDS[State.RUNNING]),
        # a person may take their time, and a model that does not follow the clock may be slow
        (State.WAITING, True, LATE, texts.WORDS[State.WAITING]),
        (State.RUNNING, False, LATE, texts.WORDS[State.RUNNING]),
    ],
)
def test_an_engine_that_is_quiet_while_it_drives_is_no_link(
    qtbot: QtBot, spoken: type[ScriptedClient], state: State, realtime: bool, quiet: float, word: str
) -> None:
    controller = Controller()
    controller.start(order(Path("never"), realtime=realtime))
    for each, shown in ((quiet, word), (0.0, texts.WORDS[state])):
        spoken.latest.said.append(Beat(state, "a test", 1.0, 0, 0, each))
        controller._look()
        assert controller.status.word == shown
        if shown == texts.NO_LINK:
            assert controller.armed
            assert f"{quiet:.1f} s" in controller.status.reason
    controller.close()
    assert qtbot is not None
