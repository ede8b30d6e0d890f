"""The client's side of the link: starts the session's process, asks and answers, and keeps what it says."""

import json
import secrets
import subprocess
import sys
import tempfile
import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Client, Connection, Listener
from queue import SimpleQueue
from typing import Literal

from bench.link.messages import (
    SILENCE,
    Alive,
    Answer,
    Ask,
    Ended,
    FromClient,
    FromSession,
    Leave,
    Refused,
    Run,
    Survey,
    Surveyed,
    Traces,
)
from bench.results import SUMMARY
from drivers.clock import now

KEPT = 20_000
"""Messages that wait for a client that does not take them; of more, the oldest are lost."""

# Ctrl-C in the terminal of the client is for the client: the session hears of it over the link
_OWN_GROUP = 0x200 if sys.platform == "win32" else 0
"""CREATE_NEW_PROCESS_GROUP of Windows; elsewhere a session of its own does the same."""
_GIVES_WAY = 0x4000 if sys.platform == "win32" else 0
"""BELOW_NORMAL_PRIORITY_CLASS of Windows, for surveys; elsewhere the process says it of itself."""


class Link:
    """A session's process, and the connection to it. All methods return at once, and may be called by any thread.

    The client's main loop calls `alive` at least every `bench.link.messages.BEAT` seconds: only that keeps the session
    from taking the client for frozen. `heard` is called in a thread of the link whenever there is something to take.
    """

    def __init__(self, assignment: Survey, heard: Callable[[], None] = lambda: None) -> None:
        self._tell = heard
        self._received: deque[FromSession] = deque(maxlen=KEPT)
        self._outgoing = SimpleQueue[FromClient | None]()
        self._heard = now()
        self._begun = self._over = False
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 - closed with the process
        self._surveying = not isinstance(assignment, Run)
        # a summary that is there before the run is another's
        summary = assignment.out / SUMMARY
        self._out = None if self._surveying or summary.exists() else assignment.out
        key = secrets.token_bytes(32)
        self._listener = Listener(authkey=key)
        self.process = subprocess.Popen(
            [sys.executable, "-m", "bench.link.process"],
            stdin=subprocess.PIPE,
            stdout=self._errors,
            stderr=self._errors,
            text=True,
            creationflags=_OWN_GROUP | (_GIVES_WAY if self._surveying else 0),
            start_new_session=sys.platform != "win32",
        )
        assert self.process.stdin is not None
        with suppress(OSError), self.process.stdin as stdin:
            stdin.write(json.dumps({"address": self._listener.address, "key": key.hex()}) + "\n")
        self._address = self._listener.address
        self._talking = threading.Thread(target=self._talk, args=(assignment,), name="link", daemon=True)
        self._talking.start()
        threading.Thread(target=self._wait, args=(key,), name="session's process", daemon=True).start()

    def alive(self) -> None:
        """The client's main loop turns."""
        if self._begun and not self._over:
            self._outgoing.put(Alive())

    def ask(self, end: Literal["stop", "abort", "halt"]) -> None:
        """Ask for an end; also before the connection stands, and any number of times."""
        self._outgoing.put(Ask(end))

    def answer(self, number: int, *, agreed: bool) -> None:
        """Answer question `number`."""
        self._outgoing.put(Answer(number, agreed))

    def take(self) -> list[FromSession]:
        """What the session has said since the last call, in its order."""
        return [self._received.popleft() for _ in range(len(self._received))]

    @property
    def silence(self) -> float:
        """Seconds since the session's process was last heard."""
        return now() - self._heard

    @property
    def standing(self) -> Literal["starting", "linked", "no link", "over"]:
        """How the link is: "no link" when the process died or is silent before it told how it ended."""
        if self._over:
            return "over"
        if self.process.poll() is not None:
            return "no link"
        if not self._begun:
            return "starting"
        return "linked" if self.silence <= SILENCE else "no link"

    def leave(self) -> None:
        """Let go of the session: a run ramps out, unless it was told to go on. A survey is given up."""
        self._outgoing.put(Leave())
        if self._surveying:
            self.process.kill()

    def _talk(self, assignment: Survey) -> None:
        """The thread that hears; it starts the one that sends, and ends it."""
        with suppress(OSError, EOFError):
            with self._listener:
                connection = self._listener.accept()
            with connection:
                connection.send(assignment)
                sender = threading.Thread(target=self._send, args=(connection,), name="link, sending", daemon=True)
                sender.start()
                try:
                    while True:
                        message = connection.recv()
                        self._heard, self._begun = now(), True
                        self._keep(message)
                        self._tell()
                finally:
                    self._outgoing.put(None)
                    sender.join(SILENCE)

    def _keep(self, message: FromSession) -> None:
        # a client that does not look for long loses pictures first
        if isinstance(message, Traces) and len(self._received) > KEPT // 2:
            return
        self._received.append(message)
        self._over = self._over or isinstance(message, Ended | Refused | Surveyed)

    def _send(self, connection: Connection) -> None:
        with suppress(OSError):
            while (message := self._outgoing.get()) is not None:
                connection.send(message)

    def _wait(self, key: bytes) -> None:
        """Tell of a process that ends without a word, and wake the hearing thread if it never connected."""
        code = self.process.wait()
        with suppress(OSError, EOFError):
            Client(self._address, authkey=key).close()
        # what it said last may still wait to be heard
        self._talking.join(SILENCE)
        if not self._over and code == 0 and (ended := self._by_the_files()) is not None:
            self._keep(ended)
            self._tell()
        if not self._over:
            self._errors.seek(0)
            last_words = self._errors.read().decode(errors="replace").strip()
            told = f": {last_words.splitlines()[-1]}" if last_words else ""
            text = f"the session's process ended without a word (exit code {code}){told}"
            self._received.append(Refused(text, failed=True, details=last_words))
            self._tell()
        self._errors.close()

    def _by_the_files(self) -> Ended | None:
        """How a run ended whose last word did not pass, for the client stood still: by its summary, if there is one."""
        if self._out is None:
            return None
        with suppress(OSError, ValueError, KeyError):
            content = json.loads((self._out / SUMMARY).read_text(encoding="utf-8"))
            passed = content.get("passed", True) is not False
            return Ended(content["status"], content["reason"], content, "", self._out, passed)
        return None
