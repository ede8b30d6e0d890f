"""What the tests of the link and of the window share."""

from collections.abc import Generator

import pytest

from tests.forked_sessions import ForkedSessions


@pytest.fixture(scope="session")
def forked_sessions() -> Generator[ForkedSessions]:
    """A process that sessions can be forked from."""
    with ForkedSessions() as sessions:
        yield sessions
