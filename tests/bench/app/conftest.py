"""What the tests of the link and of the window share."""

import sys
from collections.abc import Generator

import pytest

from tests.forked_sessions import ForkedSessions, forking


@pytest.fixture(scope="session")
def forked_sessions() -> Generator[ForkedSessions]:
    """A process that sessions can be forked from."""
    with ForkedSessions() as sessions:
        yield sessions


@pytest.fixture
def forked(forked_sessions: ForkedSessions, monkeypatch: pytest.MonkeyPatch) -> None:
    """Sessions that a test starts are forked, which saves it the second that a session takes to load the program."""
    if sys.platform != "win32":
        monkeypatch.setattr("bench.app.ipc.client.subprocess", forking(forked_sessions.link))
