"""The live page as a service: follows the sessions on this computer and publishes their state to browsers."""

import os
import secrets
import threading

from bench.app.ipc.sessions import FOLDER, sessions_folder
from bench.app.watch.document import document_of
from bench.app.watch.feed import Feed
from bench.app.watch.follower import SessionFollower
from bench.app.watch.server import PageServer
from sim import waiting
from sim.errors import InvalidInput

PERIOD = 0.1
"""Interval between updates of the page [s]."""
LAST = 0.5
"""Time for browsers to receive the last state before the server ends [s]."""


class LivePage:
    """The live page, served at `url` from its creation.

    address, port : interface and port to listen on; port 0 is any free one.
    process : identifier of the only process whose session is shown; None for any.

    Raises InvalidInput if the address cannot be used, or if sessions on this computer are not announced.
    """

    def __init__(self, address: str, port: int, *, with_token: bool = True, process: int | None = None) -> None:
        if sessions_folder() is None:
            why = (
                "the live page finds sessions through their announcements in this folder, which only this user may "
                "access: unset the variable, or set it to such a folder"
            )
            raise InvalidInput(FOLDER, os.environ.get(FOLDER, "not set"), why)
        self._feed, self._follower = Feed(), SessionFollower(process)
        self._server = PageServer(address, port, secrets.token_urlsafe(16) if with_token else "", self._feed)
        self.url = self._server.url
        self._server.start()

    def serve(self, over: threading.Event) -> None:
        """Follow the sessions until `over` is set; then end all connections."""
        try:
            while not waiting.wait(over, PERIOD):
                self._update()
            # the last message of the run may arrive together with the request to end
            waiting.wait(threading.Event(), PERIOD)
            self._update()
            waiting.wait(threading.Event(), LAST if self._feed.has_readers else 0.0)
        finally:
            self._follower.close()
            self._server.close()

    def _update(self) -> None:
        self._follower.update()
        if self._feed.has_readers:
            self._feed.publish(document_of(self._follower))
