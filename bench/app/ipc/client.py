"""The client's side of the connection: starts the session process, sends requests and buffers incoming messages."""

import json
import secrets
import subprocess
import sys
import tempfile
import threading
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from multiprocessing import AuthenticationError
from multiprocessing.connection import Client, Connection
from pathlib import Path
from queue import SimpleQueue
from typing import Literal, cast

from bench.app.ipc.messages import (
    SILENCE,
    Alive,
    Answer,
    Ask,
    Ended,
    FromClient,
    FromSession,
    Leave,
    Note,
    PlanCheck,
    PlanChecked,
    ReadOnly,
    Refused,
    Run,
    Traces,
    ended_by_files,
    receive,
)
from bench.app.ipc.sessions import RunningSession, open_listener
from bench.results import SUMMARY
from drivers.child import OWN_CONSOLE
from drivers.clock import now

KEPT = 20_000
"""Maximum number of buffered messages; if there are more, the oldest are discarded."""

# Ctrl-C in the terminal must reach only the client, which sends a request to the session
_OWN_GROUP = 0x200 if sys.platform == "win32" else 0
"""CREATE_NEW_PROCESS_GROUP (Windows); elsewhere a new session has the same effect."""
_GIVES_WAY = 0x4000 if sys.platform == "win32" else 0
"""BELOW_NORMAL_PRIORITY_CLASS (Windows), for plan checks; elsewhere the process lowers its own priority."""


class ClientConnection:
    """A client's connection to a session. All methods return at once, and may be called by any thread.

    The client's main loop must call `alive` at least every `bench.app.ipc.messages.BEAT` seconds; otherwise the session
    considers the client frozen. `on_message` is called in a thread of the connection when messages have arrived. `out`
    is the folder of a run: if the last message was lost, the end of the run is read from the files in it. It is None
    for other sessions.
    """

    def __init__(self, out: Path | None, on_message: Callable[[], None]) -> None:
        self._out, self._tell = out, on_message
        self._received: deque[FromSession] = deque(maxlen=KEPT)
        self._outgoing = SimpleQueue[FromClient | None]()
        self._heard = now()
        self._begun = self._over = False

    def alive(self) -> None:
        """Report that the client's main loop is running."""
        if self._begun and not self._over:
            self._outgoing.put(Alive())

    def ask(self, end: Literal["stop", "abort", "halt"]) -> None:
        """Request the end of the run; may be called repeatedly, and before the connection is established."""
        self._outgoing.put(Ask(end))

    def answer(self, number: int, *, agreed: bool) -> None:
        """Answer question `number`."""
        self._outgoing.put(Answer(number, agreed))

    def note(self, text: str, by: str) -> None:
        """Add a note to the log and to the data file; `by` is the operator's name."""
        self._outgoing.put(Note(text, by))

    def take(self) -> list[FromSession]:
        """Messages since the last call, in order."""
        return [self._received.popleft() for _ in range(len(self._received))]

    @property
    def silence(self) -> float:
        """Time since the last message of the session process [s]."""
        return now() - self._heard

    @property
    def status(self) -> Literal["starting", "linked", "no link", "over"]:
        """State of the connection: "no link" if the session is silent, or ended without its final message."""
        if self._over:
            return "over"
        if not self.lives:
            return "no link"
        if not self._begun:
            return "starting"
        return "linked" if self.silence <= SILENCE else "no link"

    @property
    def lives(self) -> bool:
        """Whether the session can still send messages."""
        raise NotImplementedError

    def leave(self) -> None:
        """Disconnect."""
        self._outgoing.put(Leave())

    def _converse(self, connection: Connection) -> None:
        """Receive messages until the connection ends, while another thread sends."""
        sender = threading.Thread(target=self._send, args=(connection,), name="link, sending", daemon=True)
        sender.start()
        try:
            while True:
                message = receive(connection)
                self._heard, self._begun = now(), True
                if message is not None:
                    self._keep(cast(FromSession, message))
                    self._tell()
        finally:
            self._outgoing.put(None)
            sender.join(SILENCE)

    def _keep(self, message: FromSession) -> None:
        # if the client does not read, traces are discarded first
        if isinstance(message, Traces) and len(self._received) > KEPT // 2:
            return
        self._received.append(message)
        self._over = self._over or isinstance(message, Ended | Refused | PlanChecked)

    def _send(self, connection: Connection) -> None:
        with suppress(OSError):
            while (message := self._outgoing.get()) is not None:
                connection.send(message)

    def _end_without_message(self, text: str, details: str, *, by_files: bool = True) -> None:
        """Report the end of a session that sent no final message: from its files if it wrote them, else with `text` as
        the reason.
        """
        if self._over:
            return
        if by_files and (ended := self._by_the_files()) is not None:
            self._keep(ended)
        else:
            # not a final message of the session, so the status stays "no link"
            self._received.append(Refused(text, failed=True, details=details))
        self._tell()

    def _by_the_files(self) -> Ended | None:
        """The end of a run as stated in its summary file, to replace a lost final message; None without a readable
        file.
        """
        return None if self._out is None else ended_by_files(self._out)


class SessionClient(ClientConnection):
    """Connection to a session process that this client starts, for a run, which it then owns, or for a plan check."""

    def __init__(self, assignment: PlanCheck, on_message: Callable[[], None] = lambda: None) -> None:
        self._checks_plan = not isinstance(assignment, Run)
        # an existing summary is from another run
        summary = assignment.out / SUMMARY
        super().__init__(None if self._checks_plan or summary.exists() else assignment.out, on_message)
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 - closed with the process
        key = secrets.token_bytes(32)
        self._listener = open_listener(key)
        self.process = subprocess.Popen(
            [sys.executable, "-P", "-m", "bench.app.ipc.process"],
            stdin=subprocess.PIPE,
            stdout=self._errors,
            stderr=self._errors,
            text=True,
            creationflags=_OWN_GROUP | OWN_CONSOLE | (_GIVES_WAY if self._checks_plan else 0),
            start_new_session=sys.platform != "win32",
        )
        assert self.process.stdin is not None
        with suppress(OSError), self.process.stdin as stdin:
            stdin.write(json.dumps({"address": self._listener.address, "key": key.hex()}) + "\n")
        self._address = self._listener.address
        self._talking = threading.Thread(target=self._talk, args=(assignment,), name="link", daemon=True)
        self._talking.start()
        threading.Thread(target=self._wait, args=(key,), name="session's process", daemon=True).start()

    def leave(self) -> None:
        """Disconnect. A run ramps out, unless it is set to continue without a client; a plan check is cancelled."""
        super().leave()
        if self._checks_plan:
            self.process.kill()

    @property
    def lives(self) -> bool:
        return self.process.poll() is None

    def _talk(self, assignment: PlanCheck) -> None:
        """Body of the receiving thread, which starts and ends the sending thread."""
        with suppress(OSError, EOFError):
            with self._listener:
                connection = self._listener.accept()
            with connection:
                connection.send(assignment)
                self._converse(connection)

    def _wait(self, key: bytes) -> None:
        """Report a process that ends without a final message; if the process never connected, wake the receiving
        thread.
        """
        code = self.process.wait()
        with suppress(OSError, EOFError):
            Client(self._address, authkey=key).close()
        # its last messages may still be on the way
        self._talking.join(SILENCE)
        self._errors.seek(0)
        last_words = self._errors.read().decode(errors="replace").strip()
        told = f": {last_words.splitlines()[-1]}" if last_words else ""
        text = f"the session process ended without a message (exit code {code}){told}"
        self._end_without_message(text, last_words, by_files=code == 0)
        self._errors.close()


class AttachedClient(ClientConnection):
    """Connection to a session that another window or a terminal has started; with `read_only`, the session ignores
    requests of this client.
    """

    def __init__(
        self, session: RunningSession, on_message: Callable[[], None] = lambda: None, *, read_only: bool = False
    ) -> None:
        self._folder = Path(session.out)
        super().__init__(self._folder, on_message)
        if read_only:
            self._outgoing.put(ReadOnly())
        self._talking = threading.Thread(target=self._talk, args=(session,), name="link", daemon=True)
        self._talking.start()

    @property
    def lives(self) -> bool:
        return self._talking.is_alive()

    def _keep(self, message: FromSession) -> None:
        # the folder of the message may be relative to the working folder of the session
        super()._keep(replace(message, out=self._folder) if isinstance(message, Ended) else message)

    def _talk(self, session: RunningSession) -> None:
        with (
            suppress(OSError, EOFError, AuthenticationError),
            Client(session.address, authkey=bytes.fromhex(session.key)) as connection,
        ):
            self._converse(connection)
        self._end_without_message("the session ended without a message", "")
