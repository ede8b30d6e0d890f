"""Announcement of a session to the windows on this machine, and the listener through which they attach."""

import json
import os
import secrets
import threading
import time
from collections.abc import Generator
from contextlib import contextmanager, suppress
from dataclasses import asdict
from multiprocessing import AuthenticationError
from multiprocessing.connection import Client, Listener

from bench.app.ipc.messages import Attached, Published, Run
from bench.app.ipc.server import SessionServer
from bench.app.ipc.sessions import RunningSession, lock_of, remove, sessions_folder
from bench.events import Warned
from sim import waiting


@contextmanager
def announced(server: SessionServer, run: Run, owner: str) -> Generator[None]:
    """Context manager in which clients can attach to the session of `server`, which carries out `run` for its `owner`,
    "window" or "terminal". If that is impossible, the run has a warning, and its owner is the only client.
    """
    folder = sessions_folder()
    if folder is None:
        yield
        return
    began, key, operator = time.time(), secrets.token_bytes(32), run.about.get("operator", "")
    path = folder / f"{os.getpid()}-{key[:4].hex()}.json"
    lock = lock_of(path)
    try:
        lock.acquire()
        listener = Listener(authkey=key)
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
        server.outbox.put(Published(Warned(why, time=0.0)))
        yield
        return
    over = threading.Event()

    def accept() -> None:
        with listener:
            while not over.is_set():
                # another program of this user, or a client that left at once
                with suppress(OSError, EOFError, AuthenticationError):
                    connection = listener.accept()
                    if not over.is_set():
                        server.attach(connection, Attached(run, operator, owner, time.time() - began))

    thread = threading.Thread(target=accept, name="attaching", daemon=True)
    thread.start()
    try:
        yield
    finally:
        remove(path, lock)
        over.set()
        with suppress(OSError, EOFError, AuthenticationError):
            Client(listener.address, authkey=key).close()
        waiting.join(thread, 1.0)
