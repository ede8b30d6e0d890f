"""Announcement of a session to clients on this computer, and the listener through which they attach."""

import json
import os
import secrets
import threading
import time
from collections.abc import Generator
from contextlib import contextmanager, suppress
from dataclasses import asdict
from multiprocessing import AuthenticationError
from multiprocessing.connection import Client, Connection, answer_challenge, deliver_challenge
from typing import cast

from bench.app.ipc.messages import PATIENCE, Attached, Published, Run
from bench.app.ipc.server import SessionServer
from bench.app.ipc.sessions import RunningSession, lock_of, open_listener, remove, sessions_folder
from bench.events import Warned
from sim import waiting


@contextmanager
def announced(server: SessionServer, run: Run, owner: str) -> Generator[None]:
    """Context manager in which clients can attach to the session of `server`, which carries out `run` for its `owner`,
    "window" or "terminal". Without a folder for announcements, the owner remains the only client, as after an error,
    which is published as a warning.
    """
    folder = sessions_folder()
    if folder is None:
        yield
        return
    began, key, operator = time.time(), secrets.token_bytes(32), run.about.get("operator", "")
    path = folder / f"{os.getpid()}-{key[:4].hex()}.json"
    lock = None
    try:
        lock = lock_of(path)
        listener = open_listener()
        session = RunningSession(
            os.getpid(),
            str(listener.address),
            key.hex(),
            run.protocol,
            operator,
            owner,
            str(run.out.absolute()),
            run.configuration.backend == "hardware",
            began,
        )
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with os.fdopen(handle, "w", encoding="utf-8") as file:
            json.dump(asdict(session), file)
    except OSError as error:
        remove(path, lock)
        why = f"no other window can attach to this run: {error}"
        server.broadcast.put(Published(Warned(why, time=0.0)))
        yield
        return
    # a closed listener has no address
    over, address = threading.Event(), listener.address

    def admit(connection: Connection) -> None:
        """Attach a client that has the key."""
        try:
            _authenticate(connection, key)
        except (OSError, EOFError, AuthenticationError, ValueError, AssertionError):
            # the connection is from another program of this user, or from a client that left at once
            connection.close()
            return
        if over.is_set():
            connection.close()
        else:
            server.attach(connection, Attached(run, operator, owner, time.time() - began))

    def accept() -> None:
        with listener:
            while not over.is_set():
                with suppress(OSError, EOFError):
                    connection = listener.accept()
                    # a client that sends nothing must delay neither the others nor the end of the session
                    threading.Thread(target=admit, args=(connection,), name="admitting", daemon=True).start()

    def wake() -> None:
        with suppress(OSError, EOFError):
            Client(address).close()

    thread = threading.Thread(target=accept, name="attaching", daemon=True)
    thread.start()
    try:
        yield
    finally:
        remove(path, lock)
        over.set()
        threading.Thread(target=wake, name="end of attaching", daemon=True).start()
        waiting.join(thread, 1.0)


class _Limited:
    """A connection that raises TimeoutError if a message does not arrive within `PATIENCE` seconds."""

    def __init__(self, connection: Connection) -> None:
        self._connection = connection
        self.send_bytes = connection.send_bytes

    def recv_bytes(self, maxlength: int | None = None) -> bytes:
        if not self._connection.poll(PATIENCE):
            raise TimeoutError
        return self._connection.recv_bytes(maxlength)


def _authenticate(connection: Connection, key: bytes) -> None:
    """Exchange proofs of the key, as `Listener.accept` does. Raises OSError, EOFError or AuthenticationError, and after
    an unexpected message AssertionError or ValueError.
    """
    limited = cast(Connection, _Limited(connection))
    deliver_challenge(limited, key)
    answer_challenge(limited, key)
