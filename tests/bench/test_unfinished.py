"""Files in the making are removed, also by the ending of a process that runs no `finally`."""

import subprocess
import sys
from pathlib import Path

LEAVE = """
import sys
from pathlib import Path
from bench.app.cli.interrupt import leave
from bench.unfinished import temporary_folder

with temporary_folder() as folder:
    (folder / "figure.pdf").write_text("half")
    print(folder, flush=True)
    {ending}
"""


def folder_after(ending: str, code: int) -> Path:
    """The temporary folder of a process that ends within it."""
    done = subprocess.run([sys.executable, "-c", LEAVE.format(ending=ending)], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (code, "")
    return Path(done.stdout.strip())


def test_the_folder_is_removed_after_its_block() -> None:
    assert not folder_after("pass", 0).exists()


def test_the_folder_is_removed_when_the_process_is_ended_within() -> None:
    assert not folder_after("leave(130)", 130).exists()
