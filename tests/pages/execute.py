"""Executes the blocks of a page in a folder that has the files which the page speaks of."""

import json
import lzma
import os
import shutil
import signal
import subprocess
import sys
import time
import tomllib
from collections.abc import Callable, Iterator
from contextlib import chdir, contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass
from functools import cache
from io import StringIO
from pathlib import Path
from unittest.mock import patch

from bench.app.cli.main import main
from tests.bench.accelerograms.real import CAMPAIGN as CAMPAIGN_RECORDS
from tests.pages.blocks import ROOT, Block, Command, blocks
from tests.patience import LONG

CAMPAIGN = ROOT / "tests" / "data" / "first_edition" / "harmonic_point.h5.xz"
"""A recorded campaign, for pages that read one."""

RECORDS = {
    "pacoima.AT2": "RSN77_SFERN_PUL164.AT2",
    "RSN77_SFERN_PUL164.AT2": "RSN77_SFERN_PUL164.AT2",
    "newhall.AT2": "RSN1044_NORTHR_NWH360.AT2",
    "kobe.csv": "RSN1119_KOBE_TAZ000.csv",
}
"""Names of earthquake records in the pages, and of the files in the collection."""

SERVERS = ("emulate",)
"""Commands that serve until they are interrupted: started before the rest of their block, ended after it."""

PATIENCE = 900.0
"""Time limit of one command [s]."""


@dataclass(frozen=True)
class Failure:
    """A command or file of a page that does not do what the page says."""

    where: str
    line: str
    text: str

    def __str__(self) -> str:
        return f"{self.where}: {self.line}\n    {self.text}"


def collection() -> Path | None:
    """Folder of the recorded ground motions, or None where they are not available."""
    return CAMPAIGN_RECORDS if CAMPAIGN_RECORDS.is_dir() else None


def furnish(folder: Path, specimen: str) -> None:
    """Put the files into `folder` that the pages name; `specimen` is the text of a specimen file."""
    (folder / "campaign.h5").write_bytes(_campaign())
    (folder / "bench.toml").write_text("[simulation]\nseed = 5\n", encoding="utf-8")
    (folder / "better.toml").write_text("[analysis]\nlaser_linearity = 0.0005\n", encoding="utf-8")
    (folder / "specimen.json").write_text(specimen, encoding="utf-8")
    records = collection()
    for name, source in RECORDS.items() if records else ():
        shutil.copy(records / source, folder / name)


@cache
def _campaign() -> bytes:
    return lzma.decompress(CAMPAIGN.read_bytes())


Execute = Callable[[list[str], Path], subprocess.CompletedProcess[str]]
"""Executes a command of the program, given its arguments, in a folder."""


def failures(block: Block, folder: Path, *, here: bool = False) -> Iterator[Failure]:
    """Execute a block in `folder`; yields what does not agree with the page.

    Each command and each Python block is a process of its own or, with `here`, executed in this one.
    """
    if block.language in ("sh", "console"):
        with _servers(block, folder):
            for command in block.commands:
                if command.arguments[0] == "rockbench" and command.arguments[1] not in SERVERS:
                    yield from _run(block, command, folder, command_here if here else command_process)
    elif block.language == "toml":
        yield from _parsed(block, tomllib.loads)
    elif block.language == "json":
        yield from _parsed(block, json.loads)
    elif block.language == "python":
        why = _python_here(block.text, folder) if here else _python_process(block.text, folder)
        if why is not None:
            yield Failure(block.where, "python", why)


def agrees(shown: tuple[str, ...], printed: str) -> bool:
    """Whether `printed` is what a page shows: line by line, a line of three dots standing for any number of lines."""
    return _match([line.rstrip() for line in shown if line.strip()], [*filter(str.strip, printed.splitlines())])


def _match(shown: list[str], printed: list[str]) -> bool:
    if not shown:
        return not printed
    if shown[0].strip() == "...":
        return any(_match(shown[1:], printed[start:]) for start in range(len(printed) + 1))
    if not printed:
        return False
    head, dots, _ = shown[0].partition("...")
    same = printed[0].startswith(head) if dots else shown[0] == printed[0].rstrip()
    return same and _match(shown[1:], printed[1:])


def _run(block: Block, command: Command, folder: Path, execute: Execute) -> Iterator[Failure]:
    done = execute([*command.arguments[1:]], folder)
    if done.returncode != 0:
        last = (done.stderr.strip() or done.stdout.strip() or "no output").splitlines()[-1]
        yield Failure(block.where, command.line, f"exit code {done.returncode}: {last}")
    elif command.output and not agrees(command.output, done.stdout):
        yield Failure(block.where, command.line, "the page shows another output; printed was:\n" + done.stdout)


def _parsed(block: Block, parse: Callable[[str], object]) -> Iterator[Failure]:
    try:
        parse(block.text)
    except ValueError as error:
        yield Failure(block.where, block.language, str(error))


def command_process(arguments: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a command of the program in a process of its own."""
    return process([sys.executable, "-m", "bench", *arguments], folder)


def command_here(arguments: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a command of the program in this process, without the second that a start takes."""
    out, err = StringIO(), StringIO()
    with chdir(folder), patch.dict(os.environ, COLUMNS="200"), redirect_stdout(out), redirect_stderr(err):
        code = main(arguments)
    return subprocess.CompletedProcess(arguments, code, out.getvalue(), err.getvalue())


def _python_process(text: str, folder: Path) -> str | None:
    done = process([sys.executable, "-c", text], folder)
    return done.stderr.strip().splitlines()[-1] if done.returncode else None


def _python_here(text: str, folder: Path) -> str | None:
    with chdir(folder), redirect_stdout(StringIO()), redirect_stderr(StringIO()):
        try:
            exec(compile(text, "<page>", "exec"), {"__name__": "__main__"})
        except Exception as error:
            return f"{type(error).__name__}: {error}"
    return None


def process(arguments: list[str], folder: Path) -> subprocess.CompletedProcess[str]:
    """Run a command in `folder` with the project importable and no terminal."""
    environment = os.environ | {"PYTHONPATH": str(ROOT), "QT_QPA_PLATFORM": "offscreen", "COLUMNS": "200"}
    return subprocess.run(
        arguments,
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        encoding="utf-8",
        timeout=PATIENCE,
        stdin=subprocess.DEVNULL,
        check=False,
    )


@contextmanager
def _servers(block: Block, folder: Path) -> Iterator[None]:
    """The servers of a block, ready when the context is entered."""
    lines = [each.arguments for each in block.commands if each.arguments[:1] == ["rockbench"]]
    started = []
    for words in (each for each in lines if each[1] in SERVERS):
        process = subprocess.Popen(
            [sys.executable, "-m", "bench", *words[1:]],
            cwd=folder,
            env=os.environ | {"PYTHONPATH": str(ROOT)},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        started.append(process)
        written = folder / words[words.index("--write") + 1]
        deadline = time.monotonic() + LONG
        while not written.exists() and process.poll() is None and time.monotonic() < deadline:
            time.sleep(0.1)
    try:
        yield
    finally:
        for process in started:
            process.send_signal(signal.SIGINT)
            process.wait(30.0)


def specimen_text() -> str:
    """The specimen file that docs/specimen.md shows."""
    return next(block.text for block in blocks(ROOT / "docs" / "specimen.md") if block.language == "json")
