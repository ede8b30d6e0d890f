"""Programs in processes of their own, forked from one that has imported what they need: a start takes milliseconds.

Where there is no fork, as on Windows, each program is started by itself.
"""

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Self

FORKS = sys.platform != "win32"

_SERVER = """
import json, os, sys, traceback
exec(sys.argv[1])

def program(request):
    os.environ.clear()
    os.environ.update(request["environment"])
    os.chdir(request["folder"])
    added = os.environ.get("PYTHONPATH", "")
    sys.path[:0] = added.split(os.pathsep) if added else []
    sys.path.insert(0, "")
    for descriptor, name in ((1, "out"), (2, "err")):
        os.dup2(os.open(request[name], os.O_WRONLY | os.O_CREAT | os.O_TRUNC), descriptor)
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)
    try:
        exec(compile(request["prepare"] + chr(10) + request["code"], "<string>", "exec"), {"__name__": "__main__"})
        code = 0
    except BaseException:
        traceback.print_exc()
        code = 1
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)

sys.path.remove("")
for line in sys.stdin:
    child = os.fork()
    if child == 0:
        program(json.loads(line))
    print(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]), flush=True)
"""


class Programs:
    """Starts programs given as Python source.

    preload : source that is executed once; what it imports is there for every program.
    prepare : source that each forked program executes first, such as one that reads the environment again.
    """

    def __init__(self, preload: str, prepare: str = "") -> None:
        self._preload, self._prepare = preload, prepare
        self._server: subprocess.Popen[str] | None = None

    def run(
        self, code: str, environment: Mapping[str, str], folder: Path, *, fresh: bool = False
    ) -> subprocess.CompletedProcess[str]:
        """Execute `code` in `folder`; `fresh`: in an interpreter that imports everything itself."""
        if fresh or not FORKS:
            arguments = [sys.executable, "-c", code]
            return subprocess.run(
                arguments, env=environment, cwd=folder, capture_output=True, text=True, encoding="utf-8", check=False
            )
        if self._server is None:
            self._server = self._start(environment)
        assert self._server.stdin is not None
        assert self._server.stdout is not None
        with tempfile.TemporaryDirectory() as place:
            out, err = Path(place) / "out", Path(place) / "err"
            request: dict[str, Any] = {"code": code, "prepare": self._prepare, "environment": dict(environment)}
            request |= {"folder": str(folder), "out": str(out), "err": str(err)}
            self._server.stdin.write(json.dumps(request) + "\n")
            self._server.stdin.flush()
            returned = int(self._server.stdout.readline())
            printed = (each.read_text(encoding="utf-8") for each in (out, err))
            return subprocess.CompletedProcess([code], returned, *printed)

    def _start(self, environment: Mapping[str, str]) -> "subprocess.Popen[str]":
        given = {name: value for name, value in environment.items() if name != "PYTHONPATH"}
        command = [sys.executable, "-c", _SERVER, self._preload]
        return subprocess.Popen(
            command, env=given, cwd=os.sep, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, encoding="utf-8"
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        if self._server is not None:
            self._server.communicate()
