"""Sessions in processes that are forked from one which has imported what they need: they begin in milliseconds.

Everything else is the program's: the process of a session reads the address of its client, connects, and ends by itself
or by a signal. Where there is no fork, as on Windows, each session is started by itself.
"""

import json
import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
from types import SimpleNamespace
from typing import IO, Any, Self

_SERVER = """
import json, os, socket, sys
from bench.app.ipc import process
from sim.loading import BENCH, load_model

load_model(modules=BENCH)
link = socket.socket(fileno=int(sys.argv[1]))
# what is installed for the test that began this server is not there for every session
own = os.environ.get("PYTHONPATH", "").split(os.pathsep)

def ask():
    # the folder and the environment of a session, its standard input and output, and where its end is told
    text, given = b"", []
    while not text.endswith(b"\\n"):
        part, handles, *_ = socket.recv_fds(link, 65_536, 3)
        if not part:
            sys.exit()
        text, given = text + part, given + list(handles)
    return json.loads(text), given

def session(request, handles):
    os.setsid()
    link.close()
    os.environ.clear()
    os.environ.update(request["environment"])
    os.chdir(request["folder"])
    added = os.environ.get("PYTHONPATH", "")
    sys.path[:] = [*filter(None, added.split(os.pathsep)), *(each for each in sys.path if each not in own)]
    for handle, target in ((handles[0], 0), (handles[1], 1), (handles[1], 2)):
        os.dup2(handle, target)
    for handle in handles:
        os.close(handle)
    process.main()
    sys.exit()

while True:
    request, handles = ask()
    watcher = os.fork()
    if watcher == 0:
        link.close()
        child = os.fork()
        if child == 0:
            session(request, handles)
        # an end of the standard input that stayed open here would keep it open for the session
        os.close(handles[0])
        os.write(handles[2], b"%d\\n" % child)
        code = os.waitstatus_to_exitcode(os.waitpid(child, 0)[1])
        try:
            os.write(handles[2], b"%d\\n" % code)
        except BrokenPipeError:
            # the client of this session was killed
            pass
        os._exit(0)
    for handle in handles:
        os.close(handle)
    while os.waitpid(-1, os.WNOHANG)[0]:
        pass
"""


class ForkedProcess:
    """The process of a session, with what its client uses of a `subprocess.Popen`."""

    def __init__(self, link: socket.socket, output: IO[bytes]) -> None:
        taken, given = os.pipe()
        told, tell = os.pipe()
        request = {"environment": dict(os.environ), "folder": os.getcwd()}
        socket.send_fds(link, [json.dumps(request).encode() + b"\n"], [taken, output.fileno(), tell])
        for handle in (taken, tell):
            os.close(handle)
        self.stdin = os.fdopen(given, "w")
        self._told = os.fdopen(told)
        self.pid = int(self._told.readline())
        self._code: int | None = None
        self._waiting = threading.Thread(target=self._wait, daemon=True)
        self._waiting.start()

    def _wait(self) -> None:
        with self._told:
            self._code = int(self._told.readline())

    def poll(self) -> int | None:
        return self._code

    def wait(self, timeout: float | None = None) -> int:
        self._waiting.join(timeout)
        if self._code is None:
            raise subprocess.TimeoutExpired("session", timeout or 0.0)
        return self._code

    def kill(self) -> None:
        if self._code is None:
            os.kill(self.pid, signal.SIGKILL)


def forking(link: socket.socket) -> SimpleNamespace:
    """In place of the module `subprocess` in `bench.app.ipc.client`: sessions are forked by the server at the other end
    of `link`.
    """

    def start(_command: object, *, stdout: IO[bytes], **_more: Any) -> ForkedProcess:
        return ForkedProcess(link, stdout)

    return SimpleNamespace(Popen=start, PIPE=subprocess.PIPE)


class ForkedSessions:
    """Within, there is a process that sessions can be forked from; it begins when it is first used."""

    def __init__(self) -> None:
        self._server: subprocess.Popen[bytes] | None = None
        self._link: socket.socket | None = None
        # not a pipe, which nobody would read
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 - closed at the end

    @property
    def link(self) -> socket.socket:
        """For `forking`, here or in a child process."""
        if self._link is None:
            self._link, there = socket.socketpair()
            command = [sys.executable, "-P", "-c", _SERVER, str(there.fileno())]
            with there:
                self._server = subprocess.Popen(
                    command, pass_fds=[there.fileno()], stdin=subprocess.DEVNULL, stderr=self._errors
                )
        return self._link

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._link is not None and self._server is not None:
            self._link.close()
            self._server.wait()
        self._errors.close()
